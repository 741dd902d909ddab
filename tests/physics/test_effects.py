"""Effects that are off by default, measured on one and two grains (yade_scripts/effects.py)."""

import math

import pytest

pytestmark = pytest.mark.yade
FLOORS = ("facet", "wall")
PARTNERS = ("grain", *FLOORS)


@pytest.mark.parametrize("partner", PARTNERS)
def test_adhesion_pulls_with_the_bond_number_times_the_weight_of_a_grain(measured, partner):
    """DMT: 4 pi R_eff gamma at any overlap, so twice as much at a floor.

    R_eff is there twice that of two grains.
    """
    m = measured("pull_off", partner)
    expected = m["bond_number"] * m["weight"] * (1 if partner == "grain" else 2)
    assert m["pull"] == pytest.approx(expected, rel=1e-3)


def test_a_grain_hangs_from_another_above_a_bond_number_of_one_and_falls_below(measured):
    light, strong = measured("hanging", 0.9), measured("hanging", 1.1)
    assert strong["contacts"] == 1 and abs(strong["fallen"]) < 1e-5
    assert light["contacts"] == 0 and light["fallen"] > 0.01


def test_a_grain_in_a_viscous_bed_falls_with_the_velocity_of_stokes(measured):
    """v = m g/(6 pi eta r); the relaxation time is short against the fall."""
    m = measured("falling", 0.01)
    assert m["speed"] == pytest.approx(m["weight"] / (6 * math.pi * 0.01 * m["radius"]), rel=0.01)


def test_tilt_turns_gravity_towards_x(measured):
    x, y, z = measured("falling_askew", 5.0)["acceleration"]
    angle = math.radians(5.0)
    assert (x, z) == pytest.approx(
        (9.81 * math.sin(angle), -9.81 * math.cos(angle)), rel=1e-6
    ) and y == 0


@pytest.mark.parametrize(("periods", "shaking_time"), [(0.5, 1.0), (1.25, 1.0), (3.0, 0.5 / 50)])
def test_a_shaken_set_up_throws_a_grain_sideways_until_it_stops(measured, periods, shaking_time):
    """v_x = Gamma g/omega (1 - cos omega t), which stays after the vibration.

    Nothing moves along y.
    """
    m = measured("falling_from_a_shaken_hand", 0.8, 50.0, periods, shaking_time)
    omega, time = 2 * math.pi * 50.0, min(m["time"], shaking_time)
    x, y, z = m["velocity"]
    assert (
        x == pytest.approx(0.8 * 9.81 / omega * (1 - math.cos(omega * time)), rel=0.02) and y == 0
    )
    assert z == pytest.approx(-9.81 * m["time"], rel=1e-3)
    assert m["shakes"] is (m["time"] < shaking_time)


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_wall_friction_is_the_requested_share_of_that_between_grains(measured, ratio):
    """Also above one, where YADE by itself would take the smaller friction of the two materials."""
    assert measured("friction_at", "grain", ratio)["friction"] == pytest.approx(0.45, rel=1e-9)
    for floor in FLOORS:
        assert measured("friction_at", floor, ratio)["friction"] == pytest.approx(
            0.45 * ratio, rel=1e-9
        )


@pytest.mark.parametrize("partner", PARTNERS)
def test_twisting_moment_rises_with_the_angle_by_its_share_of_the_rolling_stiffness(
    measured, partner
):
    m = measured("twisted_contact", partner)
    assert m["stiffness"] == pytest.approx(m["expected"], rel=0.02)


def test_the_rolling_cap_of_several_sizes_is_right_in_the_mean_and_within_13_percent_for_each_pair(
    measured,
):
    """mu_r R1 R2/(R1 + R2) against the one eta that YADE has for all pairs."""
    m = measured("sized_caps")
    ratios = [given / wanted for given, wanted in zip(m["given"], m["wanted"], strict=True)]
    assert sum(m["given"]) == pytest.approx(sum(m["wanted"]), rel=0.02)
    assert min(ratios) > 0.87 and max(ratios) < 1.13


def test_grains_of_several_sizes_have_the_requested_moments(measured):
    """Mean radius as given, its coefficient of variation, and the mean mass 1 + 3 cv^2."""
    m = measured("sizes", 0.25)
    assert m["mean"] == pytest.approx(m["nominal"], rel=1e-9)
    assert m["spread"] == pytest.approx(0.25, rel=1e-9)
    assert m["mean_mass"] == pytest.approx(m["expected_mass"], rel=1e-6)


def test_grains_of_given_sizes_have_these_about_the_nominal_radius_in_the_given_numbers(measured):
    """Diameters of 0.8, 1 and 1.4 have the mean 1.05 by number."""
    m = measured("given_sizes", "0.8:1|1.0:2|1.4:1")
    assert m["radii"] == pytest.approx([0.8 / 1.05, 1 / 1.05, 1.4 / 1.05])
    assert m["numbers"] == [250, 500, 250]
    assert m["mean_mass"] == pytest.approx(m["expected_mass"], rel=1e-9)
    assert len(set(m["order"])) == 3  # mixed, not in layers


@pytest.mark.parametrize("aspect", [1.3, 2.0])
def test_a_clump_has_the_mass_of_a_grain_and_the_requested_length(measured, aspect):
    m = measured("clump", aspect)
    assert m["mass"] == pytest.approx(m["grain_mass"], rel=1e-9)
    assert (m["distance"] + 2 * m["sphere_radius"]) / (2 * m["sphere_radius"]) == pytest.approx(
        aspect, rel=1e-9
    )


def test_a_clump_of_two_touching_spheres_has_their_inertia(measured):
    """2/5 m R^2 about the axis, and m R^2 more across it (Steiner)."""
    m = measured("clump", 2.0)
    along = 0.4 * m["mass"] * m["sphere_radius"] ** 2
    assert m["inertia"] == pytest.approx(
        [along, *[along + m["mass"] * m["sphere_radius"] ** 2] * 2], rel=1e-3
    )


def test_a_clump_that_lands_on_its_end_rebounds_with_the_requested_restitution(measured):
    m = measured("clump_rebound")
    assert m["restitution"] == pytest.approx(m["wanted"], rel=0.02) and m["spin"] < 1e-6


def test_a_clump_in_a_viscous_bed_falls_like_the_sphere_of_its_volume(measured):
    m = measured("clump_fall", 0.01)
    assert m["speed"] == pytest.approx(m["weight"] / (6 * math.pi * 0.01 * m["radius"]), rel=0.01)
