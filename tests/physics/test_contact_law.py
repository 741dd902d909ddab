"""The contact law that YADE is given, on one and two grains, against its formulas.

scenes.py makes the measurements inside YADE. Formulas: Hertz (normal force),
Mindlin (tangential stiffness), Coulomb (sliding), and the elastic-plastic rolling resistance whose
moment is capped at mu_r R_eff |F_n|. R_eff = R1 R2/(R1 + R2) between grains and the grain radius r
at a floor. Everything is in SI units.
"""

import math

import pytest

from calibrator.case.physics import time_step

pytestmark = pytest.mark.yade

FLOORS = ("facet", "wall")
PARTNERS = ("grain", *FLOORS)


def e_star(p):
    """Hertz's modulus E* = E/(2 (1 - nu^2)) of two bodies of the same material [Pa]."""
    return p["young_modulus"] / (2 * (1 - p["poisson_ratio"] ** 2))


def g_star(p):
    """Mindlin's modulus G* = G/(2 (2 - nu)) [Pa] of two bodies of the same material.

    G = E/(2 (1 + nu)).
    """
    return p["young_modulus"] / (2 * (1 + p["poisson_ratio"])) / (2 * (2 - p["poisson_ratio"]))


@pytest.mark.parametrize("partner", PARTNERS)
def test_normal_force_is_that_of_hertz(measured, partner):
    """F_n = 4/3 E* sqrt(R_eff) delta^1.5.

    R_eff = r at a floor although YADE's wall is a sphere of 1e8 r.
    """
    m = measured("pressed", partner)
    expected = (
        4 / 3 * e_star(m["parameters"]) * math.sqrt(m["effective_radius"]) * m["overlap"] ** 1.5
    )
    assert m["normal_force"] == pytest.approx(expected, rel=0.005)


@pytest.mark.parametrize("partner", PARTNERS)
def test_tangential_stiffness_is_that_of_mindlin(measured, partner):
    """k_t = 8 G* sqrt(R_eff delta)."""
    m = measured("pressed", partner)
    expected = 8 * g_star(m["parameters"]) * math.sqrt(m["effective_radius"] * m["overlap"])
    assert m["shear_stiffness"] == pytest.approx(expected, rel=0.005)


@pytest.mark.parametrize("partner", PARTNERS)
def test_friction_of_a_contact_is_the_sliding_friction_coefficient(measured, partner):
    """mu_s itself, not its arc tangent and not a mean of two materials."""
    m = measured("pressed", partner)
    assert m["friction"] == pytest.approx(m["parameters"]["sliding_friction"], rel=1e-9)


@pytest.mark.parametrize(("restitution", "tolerance"), [(0.5, 0.07), (0.9, 0.01), (0.93, 0.01)])
@pytest.mark.parametrize("partner", PARTNERS)
def test_restitution_in_a_head_on_impact_is_the_requested_one(
    measured, partner, restitution, tolerance
):
    """A stronger damping is sampled more coarsely: 0.5 comes out up to 6 % low.

    By how much depends on where in the impact the steps fall.
    """
    m = measured("rebound", partner, restitution)
    assert m["contacts_left"] == 0
    assert m["restitution"] == pytest.approx(restitution, rel=tolerance)


@pytest.mark.parametrize("kind", FLOORS)
def test_sliding_impact_changes_the_tangential_velocity_by_mu_times_the_normal_change(
    measured, kind
):
    """Delta v_t = mu_s (1 + e) v_n as long as the surfaces slide."""
    m = measured("sliding_impact", kind)
    assert m["final_slip"] > 0
    assert m["tangential_change"] == pytest.approx(
        m["sliding_friction"] * m["normal_change"], rel=0.01
    )


@pytest.mark.parametrize("kind", FLOORS)
def test_sliding_impact_spins_the_grain_up_by_the_moment_of_the_friction(measured, kind):
    """omega = 5 mu_s (1 + e) v_n/(2 r), from I = 2/5 m r^2."""
    m = measured("sliding_impact", kind)
    expected = 5 * m["sliding_friction"] * m["normal_change"] / (2 * m["radius"])
    assert m["spin"] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("rolling_friction", [0.1, 0.3])
@pytest.mark.parametrize("kind", FLOORS)
def test_rolling_grain_is_slowed_by_the_requested_rolling_friction(
    measured, kind, rolling_friction
):
    """Rolling without slip under mu_r r m g decelerates by a = 5/7 mu_r g: mu_r = 7 a/(5 g)."""
    m = measured("rolling", kind, rolling_friction)
    assert (m["fewest_contacts"], m["most_contacts"]) == (1, 1)
    assert m["largest_slip"] < 0.01
    assert m["rolling_friction"] == pytest.approx(rolling_friction, rel=0.02)


@pytest.mark.parametrize("rolling_friction", [0.1, 0.3])
@pytest.mark.parametrize("kind", ["edge", "oblique edge"])
def test_shared_edge_of_two_coplanar_facets_does_not_brake_a_rolling_grain(
    measured, kind, rolling_friction
):
    """At the edge the grain touches both facets for a moment and hops; that must not cost speed."""
    m = measured("rolling", kind, rolling_friction)
    assert m["most_contacts"] == 2
    assert m["rolling_friction"] == pytest.approx(rolling_friction, rel=0.05)


@pytest.mark.parametrize(
    "contact", [("grain", 0.2), ("grain", 0.2, 1.5), ("facet", 0.2), ("wall", 0.2)]
)
def test_rolling_moment_is_capped_at_mu_r_times_R_eff_times_the_normal_force(measured, contact):
    """Equal grains, grains with R2/R1 = 1.5, and floors, under a force known from the overlap."""
    m = measured("bent_contact", *contact)
    expected = m["parameters"]["rolling_friction"] * m["effective_radius"] * m["load"]
    assert m["limit"] == pytest.approx(expected, rel=0.01)
    assert m["largest_moment"] == pytest.approx(expected, rel=0.01)


def test_a_yade_that_cannot_tell_grains_from_walls_ends_the_run(measured):
    """The caps rest on a habit of YADE's dispatcher (material.dispatch) that a build may drop."""
    assert "the same rolling cap" in measured("unled_dispatch")["error"]


@pytest.mark.parametrize("restitution", [0.5, 0.9])
@pytest.mark.parametrize("partner", PARTNERS)
def test_impact_takes_no_more_spin_than_the_capped_rolling_moment_can(
    measured, partner, restitution
):
    """With the moment at its cap, Delta omega = mu_r R_eff Delta v_n/(2/5 r^2).

    The cap holds in every step.
    """
    m = measured("spinning_impact", partner, restitution)
    expected = (
        m["rolling_friction"]
        * m["effective_radius"]
        * m["normal_change"]
        / (0.4 * m["radius"] ** 2)
    )
    assert m["spin_loss"] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("partner", PARTNERS)
def test_no_rolling_friction_means_no_rolling_moment(measured, partner):
    """Exactly none: YADE would read a cap of zero as no cap."""
    assert measured("bent_contact", partner, 0.0)["largest_moment"] == 0.0
    if partner in FLOORS:
        assert measured("sliding_impact", partner)["largest_moment"] == 0.0


@pytest.mark.parametrize(
    "contact",
    [
        ("grain", 0.2),
        ("grain", 0.2, 1.5),
        ("facet", 0.2),
        ("wall", 0.2),
        *((partner, 0.2, 1.0, "epsd") for partner in PARTNERS),
    ],
)
def test_rolling_moment_rises_with_the_angle_by_the_rolling_stiffness(measured, contact):
    """Slope of moment over angle below the cap [N m/rad]."""
    m = measured("bent_contact", *contact)
    assert m["slope"] == pytest.approx(m["stiffness"], rel=0.02)


@pytest.mark.parametrize(
    "contact", [("grain", 0.2), ("grain", 0.2, 1.5), ("facet", 0.2), ("wall", 0.2)]
)
def test_default_rolling_stiffness_follows_the_tangential_stiffness(measured, contact):
    """k_r = factor * k_t R_eff^2 with k_t = 8 G* sqrt(R_eff delta) at five grain weights."""
    m = measured("bent_contact", *contact)
    p, r_eff = m["parameters"], m["effective_radius"]
    overlap = (m["load"] / (4 / 3 * e_star(p) * math.sqrt(r_eff))) ** (2 / 3)
    expected = m["stiffness_factor"] * 8 * g_star(p) * math.sqrt(r_eff * overlap) * r_eff**2
    assert m["slope"] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 16.0])
@pytest.mark.parametrize("partner", PARTNERS)
def test_rolling_stiffness_ratio_sets_the_spring_and_leaves_the_cap(measured, partner, ratio):
    """k_r = ratio k_t R_eff^2 under five grain weights; the cap is mu_r R_eff |F_n| as ever."""
    m = measured("bent_contact", partner, 0.2, 1.0, "epsd2", ratio)
    p, r_eff = m["parameters"], m["effective_radius"]
    overlap = (m["load"] / (4 / 3 * e_star(p) * math.sqrt(r_eff))) ** (2 / 3)
    expected = ratio * 8 * g_star(p) * math.sqrt(r_eff * overlap) * r_eff**2
    assert m["slope"] == pytest.approx(expected, rel=0.02)
    assert m["limit"] == pytest.approx(p["rolling_friction"] * r_eff * m["load"], rel=0.01)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 16.0])
@pytest.mark.parametrize("kind", FLOORS)
def test_a_grain_rocks_on_its_rolling_spring_with_the_period_of_the_ratio(measured, kind, ratio):
    """omega = sqrt(k_r/I), k_r = ratio k_t r^2, sampled by leapfrog: sin(pi dt/T) = omega dt/2."""
    m = measured("rocking", kind, ratio)
    p, r = m["parameters"], m["effective_radius"]
    overlap = (m["load"] / (4 / 3 * e_star(p) * math.sqrt(r))) ** (2 / 3)
    stiffness = ratio * 8 * g_star(p) * math.sqrt(r * overlap) * r**2
    expected = math.pi * m["step"] / math.asin(m["step"] / 2 * math.sqrt(stiffness / m["inertia"]))
    assert m["period"] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("ratio", [1.0, 16.0])
@pytest.mark.parametrize("kind", FLOORS)
def test_rolling_grain_is_slowed_alike_whatever_its_spring(measured, kind, ratio):
    m = measured("rolling", kind, 0.3, 0.1, ratio)
    assert m["rolling_friction"] == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 4.0, 16.0])
def test_the_calibrator_foresees_the_step_that_follows_the_rolling_spring(measured, ratio):
    """0.28 sqrt(I/k), k the mean of k_t r^2 and the rolling spring; here the bound holds."""
    m = measured("time_steps", ratio)
    p = {n: v for n, v in m["parameters"].items() if not isinstance(v, str)}
    r, r_eff, weight = p["particle_radius"], p["particle_radius"] / 2, p["particle_density"] * 9.81
    load = 5 * 4 / 3 * math.pi * r**3 * weight
    overlap = (load / (4 / 3 * e_star(p) * math.sqrt(r_eff))) ** (2 / 3)
    shear = 8 * g_star(p) * math.sqrt(r_eff * overlap)
    inertia = 0.4 * 4 / 3 * math.pi * r**3 * p["particle_density"] * r**2
    expected = 0.28 * math.sqrt(2 * inertia / (shear * r**2 + ratio * shear * r_eff**2))
    assert expected < 0.4 * m["rayleigh"]
    assert m["time_step"] == pytest.approx(expected, rel=1e-9)
    assert time_step(p) == pytest.approx(m["time_step"], rel=1e-12)


@pytest.mark.parametrize("kind", FLOORS)
def test_spin_about_the_contact_normal_persists(measured, kind):
    """Nothing in the model resists torsion: this is why rest is judged by translational energy."""
    m = measured("spinning", kind)
    assert m["after"] == pytest.approx(m["before"], rel=1e-6)


def test_layer_at_rest_by_translational_energy_still_spins(measured):
    """The translational energy passes 1e-15 J per grain; the total stalls far above.

    It has not fallen 0.1 s later.
    """
    m = measured("settled_layer")
    assert m["threshold"] == 1e-15
    for energy in (m["at_rest"], m["later"]):
        assert energy["translational"] < m["threshold"]
        assert energy["translational"] + energy["rotational"] > 10 * m["threshold"]
    assert m["later"]["rotational"] == pytest.approx(m["at_rest"]["rotational"], rel=0.1)


def test_a_grain_that_has_left_the_vessel_ends_the_filling_soon_and_says_why(measured):
    for speed in (0.0, 0.1):
        m = measured("lost_grain", speed)
        assert "a grain has left the vessel" in m["error"] and m["time"] < 0.1 * m["longest_time"]
        assert ("lower pouring_velocity" in m["error"]) is (speed > 0)  # none is below nothing


def test_a_wait_begins_when_the_last_step_of_the_one_before_has_ended(measured):
    """Else the engines of the new wait are lost, and it never ends.

    One pile in about a hundred ran into its time limit.
    """
    assert 20 <= measured("lingering_step")["steps"] <= 25
