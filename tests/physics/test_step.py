"""The step that the damped contact bears, on one held grain, against the leapfrog's formula.

YADE takes forces from the velocity of half a step before. For x'' + 2 zeta omega x' + omega^2 x = 0
that is stable as long as omega dt < 2 (sqrt(1 + zeta^2) - zeta).
"""

import math

import pytest

from calibrator.case.physics import LARGEST_SHARE, LARGEST_STEP_SHARE, contact_time, time_step
from tests.physics.test_contact_law import e_star, g_star

pytestmark = pytest.mark.yade


@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.9])
@pytest.mark.parametrize("mode", ["normal", "spin"])
def test_a_held_grain_is_stable_up_to_the_step_of_a_leapfrog_with_lagged_damping(
    measured, mode, restitution
):
    """Between two grains that are held: k = 2 k_n and zeta = sqrt(2) betan along the contacts.

    It spins on 2 k_t r^2, with zeta = sqrt(5) betan, as I = 2/5 m r^2, and bears less.
    """
    m = measured("largest_stable_step", mode, restitution)
    p, r = m["parameters"], m["parameters"]["particle_radius"]
    mass = 4 / 3 * math.pi * r**3 * p["particle_density"]
    width = math.sqrt(r / 2 * m["overlap"])
    if mode == "normal":
        omega, zeta = math.sqrt(2 * 2 * e_star(p) * width / mass), math.sqrt(2) * m["betan"]
    else:
        omega, zeta = math.sqrt(5 * 8 * g_star(p) * width / mass), math.sqrt(5) * m["betan"]
    expected = 2 * (math.sqrt(1 + zeta**2) - zeta) / omega
    # the arm of the spin is shorter than r by half the overlap
    assert 0.97 * m["stable"] <= expected <= 1.03 * m["unstable"]


def test_the_calibrator_foresees_the_step_of_inelastic_grains(measured):
    for m in measured("damped_steps"):
        p = {n: v for n, v in m["parameters"].items() if not isinstance(v, str)}
        assert time_step(p) == pytest.approx(m["time_step"], rel=1e-9)


def test_inelastic_grains_take_a_shorter_step_and_all_others_the_same_as_ever(measured):
    rows = measured("damped_steps")
    for m in rows:
        p = {n: v for n, v in m["parameters"].items() if not isinstance(v, str)}
        before = min(LARGEST_SHARE * m["rayleigh"], LARGEST_STEP_SHARE * contact_time(p))
        if p["restitution"] >= 0.6:
            assert m["time_step"] == pytest.approx(before, rel=1e-12)
        if p["restitution"] <= 0.3:
            assert m["time_step"] < 0.7 * before


def test_a_grain_far_above_free_fall_ends_filling_and_release_with_the_step_as_the_reason(measured):
    m = measured("shot_grain")
    assert m["speed"] > 5 * m["possible"] and len(m["ends"]) == 2
    for part, said in zip(("filling", "release"), m["ends"], strict=True):
        assert said.startswith(f"{part}: a grain moves at 20 m/s")
        assert f"{m['time_step']:.3g} s is unstable" in said and "rayleigh_fraction" in said
        assert "pouring_velocity" not in said
