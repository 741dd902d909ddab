"""What the exported values mean in LIGGGHTS and LAMMPS, on one and two grains, against formulas."""

import math

import numpy as np
import pytest

from calibrator.case.physics import GRAVITY
from calibrator.handover import contact
from tests.handover.engines import FLOOR, each_engine, follow, inertia, period_of, spring_period
from tests.handover.materials import material

HELD = "fix still all setforce 0 0 0\n"
SAND = dict(young_modulus=1e6, restitution=0.8, sliding_friction=0.4, rolling_friction=0.3)


def held_pair(engine, chosen, folder, spin, duration, dt):
    """Two grains held at the overlap of five grain weights, turning against each other."""
    p = chosen.numbers
    r = p["particle_radius"]
    apart = 2 * r - contact.overlap(p, r / 2)
    centres = [(0, 0, 0), (0, 0, apart)]
    still = np.zeros((2, 3))
    steps = round(duration / dt)
    return follow(engine, chosen, folder, centres, still, (-spin, spin), steps, dt, HELD)


@each_engine
def test_the_rolling_moment_of_two_grains_is_capped_at_mu_r_r_eff_f_n(engine, tmp_path):
    chosen = material(**SAND)
    p = chosen.numbers
    cap = p["rolling_friction"] * p["particle_radius"] / 2 * 5 * contact.grain_mass(p) * GRAVITY
    slowing, spin = cap / inertia(p), 400.0
    found = held_pair(engine, chosen, tmp_path, spin, 0.8 * spin / slowing, 2e-6)
    late = found["time"] > 0.2 * spin / slowing
    slope = np.polyfit(found["time"][late], found["spin"][late], 1)[0]
    assert -slope * inertia(p) == pytest.approx(cap, rel=0.01)


@each_engine
@pytest.mark.parametrize("ratio", [1.0, 4.0])
def test_the_rolling_spring_is_what_the_file_says_of_it(engine, ratio, tmp_path):
    """LAMMPS has the calibration's ratio, LIGGGHTS 1 whatever that is."""
    chosen = material(**{**SAND, "rolling_stiffness_ratio": ratio})
    p = chosen.numbers
    r_eff = p["particle_radius"] / 2
    own = ratio if engine == "lammps" else 1.0
    stiffness = own * contact.shear_stiffness(p, r_eff) * r_eff**2
    period = spring_period(p, stiffness)
    found = held_pair(engine, chosen, tmp_path, 1e-3, 5 * period, period / 200)
    assert period_of(found["time"], found["spin"]) == pytest.approx(period, rel=0.01)


@each_engine
def test_the_soft_rolling_spring_too(engine, tmp_path):
    chosen = material(**{**SAND, "rolling_spring": "epsd"})
    p = chosen.numbers
    r_eff = p["particle_radius"] / 2
    # k_n = 4/3 E* a in all three
    normal = 4 / 3 * contact.effective_modulus(p)
    normal *= math.sqrt(r_eff * contact.overlap(p, r_eff))
    period = spring_period(p, 2.25 * normal * p["rolling_friction"] ** 2 * r_eff**2)
    found = held_pair(engine, chosen, tmp_path, 1e-3, 5 * period, period / 200)
    assert period_of(found["time"], found["spin"]) == pytest.approx(period, rel=0.01)


@each_engine
@pytest.mark.parametrize("restitution", [0.5, 0.9])
def test_two_grains_rebound_with_the_restitution(engine, restitution, tmp_path):
    chosen = material(**{**SAND, "restitution": restitution})
    r = chosen.numbers["particle_radius"]
    centres, speed = [(0, 0, 0), (0, 0, 2.001 * r)], 0.1
    velocities = [(0, 0, speed / 2), (0, 0, -speed / 2)]
    found = follow(engine, chosen, tmp_path, centres, velocities, (0, 0), 4000, 1e-6)
    assert found["height"][-1] > 2 * r, "they still touch"
    rebound = (found["rise"][-1] - found["rise_1"][-1]) / speed
    assert rebound == pytest.approx(restitution, abs=0.01)


def on_floor(engine, chosen, folder, velocity, spin, duration):
    """A grain on a floor, in its static overlap, from a velocity and a spin."""
    p = chosen.numbers
    r = p["particle_radius"]
    weight = contact.grain_mass(p) * GRAVITY
    centres = [(0, 0, r - contact.overlap(p, r, weight))]
    more = f"fix g all gravity {GRAVITY} vector 0 0 -1\n{FLOOR[engine]}\n"
    dt = 1e-5
    steps = round(duration / dt)
    return follow(engine, chosen, folder, centres, [(velocity, 0, 0)], (spin,), steps, dt, more)


@each_engine
def test_a_grain_that_rolls_on_a_floor_is_slowed_by_mu_r(engine, tmp_path):
    """The moment mu_r R m g at the contact slows it by 5/7 mu_r g."""
    chosen = material(**{**SAND, "sliding_friction": 0.8})
    slowing, speed = 5 / 7 * 0.3 * GRAVITY, 0.2
    r = chosen.numbers["particle_radius"]
    found = on_floor(engine, chosen, tmp_path, speed, speed / r, 0.8 * speed / slowing)
    late = found["time"] > 0.2 * speed / slowing
    slope = np.polyfit(found["time"][late], found["velocity"][late], 1)[0]
    assert -slope == pytest.approx(slowing, rel=0.01)


@each_engine
def test_a_grain_that_slides_on_a_floor_is_slowed_by_the_walls_friction(engine, tmp_path):
    chosen = material(**{**SAND, "rolling_friction": 0.0, "wall_friction_ratio": 0.5})
    slowing, speed = 0.5 * 0.4 * GRAVITY, 0.2
    found = on_floor(engine, chosen, tmp_path, speed, 0.0, 0.1 * speed / slowing)
    slope = np.polyfit(found["time"][50:], found["velocity"][50:], 1)[0]
    assert -slope == pytest.approx(slowing, rel=0.02)


@each_engine
def test_a_grain_rests_on_a_floor_in_hertz_overlap_with_r_eff_its_radius(engine, tmp_path):
    chosen = material(**SAND)
    p = chosen.numbers
    r = p["particle_radius"]
    found = on_floor(engine, chosen, tmp_path, 0.0, 0.0, 0.05)
    static = contact.overlap(p, r, contact.grain_mass(p) * GRAVITY)
    assert r - found["height"][-1] == pytest.approx(static, rel=0.01)
