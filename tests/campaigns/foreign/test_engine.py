"""Each effect in LIGGGHTS on one or two grains, against a formula."""

import math
import shutil

import numpy as np
import pytest

from benchmarks.runs.dem import core_seconds
from benchmarks.runs.rolling_grains import size_classes, write_grains
from benchmarks.runs.rolling_scans import grain_mass, mean_grain_mass
from calibrator.case.physics import GRAVITY
from calibrator.runs.request import Request
from tests.campaigns.foreign import engine

# `make test` installs LIGGGHTS, which takes root; elsewhere these tests are shown as skipped, with
# the command.
needs_liggghts = pytest.mark.skipif(
    shutil.which("liggghts") is None,
    reason="liggghts not installed: run `make liggghts` as root or with sudo",
)
R, MU, E = 1e-3, 0.5, 1e6
LOG = """
variable s equal step
variable u equal vx[{i}]
variable h equal z[{i}]
variable v equal vz[{i}]
compute spins all property/atom omegay
compute spin all reduce sum c_spins
variable w equal c_spin
fix log all print 1 "${{s}} ${{u}} ${{h}} ${{v}} ${{w}}" file grain.txt screen no
run {steps}
"""


def parameters(**given):
    common = dict(young_modulus=E, sliding_friction=MU, rolling_friction=0.0, restitution=0.9)
    return Request.of("conical_pile", **{**common, **given}).parameters


def weight(p):
    return grain_mass(p) * GRAVITY


def follow(folder, p, centres, velocity, steps, walls="", after="", viscosity=0.0, dt=None, g=9.81):
    """Step, velocity, height, vertical velocity, spin (5, n) of the last grain; the time step."""
    dt = dt or engine.step_of(p)
    wide = (-0.1, 0.1)
    write_grains(folder, p, np.array(centres), np.array(velocity), [wide] * 3, False)
    head = engine.head(p, viscosity, dt, "f", walls.replace("LAW", engine.law(p, viscosity)))
    head = head.replace("gravity 9.81", f"gravity {g:.10g}")
    log = LOG.format(i=len(centres), steps=steps)
    (folder / "in.run").write_text(head + after + log)
    core_seconds(["liggghts", "-in", "in.run"], folder)
    return np.loadtxt(folder / "grain.txt").T, dt


def reduced_modulus(p):
    return p["young_modulus"] / (2 * (1 - p["poisson_ratio"] ** 2))


FLOOR = "fix w all wall/gran LAW primitive type 2 zplane 0.0"


def hung(p, load, factor, effective_radius, strength):
    """Overlap [m] at which a grain hangs from a contact with a load [N]: the stable root.

    With delta = x^2 the pull is factor k R x^2 - 4/3 E* sqrt(R) x^3; it is stable where it falls
    with x.
    """
    a = 4 / 3 * reduced_modulus(p) * math.sqrt(effective_radius)
    b = factor * strength * effective_radius
    roots = np.roots([-a, b, 0.0, -load])
    real = roots[abs(roots.imag) < 1e-9 * abs(roots).max()].real
    return float(max(real) ** 2) if len(real) else (2 * b / (3 * a)) ** 2


def hertz(p, effective_radius):
    """Force over overlap to the power of 1.5 [N/m^1.5]."""
    return 4 / 3 * reduced_modulus(p) * math.sqrt(effective_radius)


def test_a_contact_under_five_weights_pulls_with_the_bond_number_and_twice_that_at_a_wall():
    p = parameters(bond_number=0.7)
    sides = ((4 * math.pi, R / 2, 0.7), (2 * math.pi, R, 1.4))
    for k, (c, radius, bond) in zip(engine.cohesion_energy_density(p), sides, strict=True):
        overlap = (5 * weight(p) / hertz(p, radius)) ** (2 / 3)
        assert k * c * radius * overlap == pytest.approx(bond * weight(p))


@needs_liggghts
@pytest.mark.parametrize("where", ["grains", "wall"])
@pytest.mark.parametrize("bond", [5.0, 8.0])
def test_the_cohesion_model_parts_at_its_pull_off_force(tmp_path, where, bond):
    """A grain hangs from another (or a roof) at 0.98 of (c k)^3 R^2/(12 E*^2), not at 1.02."""
    p, ends = parameters(bond_number=bond), {}
    k = engine.cohesion_energy_density(p)[where == "wall"]
    c, radius = (2 * math.pi, R) if where == "wall" else (4 * math.pi, R / 2)
    pull_off = (c * k) ** 3 * radius**2 / (12 * reduced_modulus(p) ** 2)
    for share in (0.98, 1.02):
        delta = hung(p, share * pull_off, c, radius, k)
        if where == "wall":
            roof = f"fix w all wall/gran LAW primitive type 2 zplane {R - delta:.10g}"
            grains, held = [[0, 0, 0.0]], ""
        else:
            grains, roof = [[0, 0, 0.0], [0, 0, -2 * R + delta]], ""
            held = "group held id 1\nfix still held setforce 0 0 0\n"
        g, still = share * pull_off / grain_mass(p), [[0, 0, 0]] * len(grains)
        # until a grain that fell freely would have fallen some tens of radii
        steps = int(math.sqrt(2 * 0.05 / g) / engine.step_of(p))
        rows, _ = follow(tmp_path, p, grains, still, steps, roof, held, g=g)
        ends[share] = rows[2][-1] - rows[2][0]
    assert abs(ends[0.98]) < 0.02 * R < -ends[1.02]


@needs_liggghts
def test_tilted_gravity_and_wall_friction_together(tmp_path):
    """A grain on an incline of 30 degrees slips where 3.5 mu < tan: a = g (sin - mu_wall cos)."""
    p = parameters(tilt_deg=30.0, wall_friction_ratio=0.2)
    overlap = (weight(p) / (4 / 3 * reduced_modulus(p) * math.sqrt(R))) ** (2 / 3)
    rows, dt = follow(tmp_path, p, [[0, 0, R - overlap]], [[0, 0, 0]], 2000, FLOOR)
    slope = np.polyfit(rows[0][500:] * dt, rows[1][500:], 1)[0]
    lean, wall = math.radians(30), 0.2 * MU
    assert slope == pytest.approx(GRAVITY * (math.sin(lean) - wall * math.cos(lean)), rel=2e-3)


def test_friction_at_walls_leaves_that_between_grains_alone():
    lines = engine.pairs(parameters(wall_friction_ratio=0.4), 0.0).splitlines()
    (own,) = (line.split()[-4:] for line in lines if "coefficientFriction" in line)
    assert list(map(float, own)) == [MU, 0.4 * MU, 0.4 * MU, 0.4 * MU]


@needs_liggghts
@pytest.mark.parametrize("restitution", [0.4, 0.9])
def test_an_impact_has_the_restitution(tmp_path, restitution):
    p = parameters(restitution=restitution, time_step=0.0)
    dt = engine.step_of(p) / 20
    rows, _ = follow(tmp_path, p, [[0, 0, 1.01 * R]], [[0, 0, -0.5]], 1500, FLOOR, dt=dt)
    leaves = np.flatnonzero((rows[2] > R) & (rows[3] > 0))[0]
    assert rows[3][leaves] / 0.5 == pytest.approx(restitution, abs=0.02)


@needs_liggghts
def test_soft_grains_sink_in_as_hertz_says(tmp_path):
    p = parameters(young_modulus=4e4, restitution=0.3)
    overlap = (weight(p) / (4 / 3 * reduced_modulus(p) * math.sqrt(R))) ** (2 / 3)
    rows, _ = follow(tmp_path, p, [[0, 0, R]], [[0, 0, 0]], 3000, FLOOR)
    assert R - rows[2][-1] == pytest.approx(overlap, rel=1e-3)


@needs_liggghts
def test_vibration_swings_a_falling_grain(tmp_path):
    """v = a/omega (1 - cos omega t) along x."""
    p = {**parameters(shaking=0.8), "shaking_frequency": 60.0}
    dt = engine.step_of(p)
    shaken = "variable s equal step\n" + engine.shaken(p, dt, "$s")
    rows, _ = follow(tmp_path, p, [[0, 0, 0.05]], [[0, 0, 0]], 1000, after=shaken)
    omega = 2 * math.pi * 60
    expected = 0.8 * GRAVITY / omega * (1 - np.cos(omega * rows[0] * dt))
    assert np.abs(rows[1] - expected).max() < 0.02 * expected.max()


@needs_liggghts
def test_a_rocking_grain_is_damped_by_the_rolling_viscosity(tmp_path):
    """Its spin shrinks by exp(-2 pi zeta/sqrt(1 - zeta^2)) in a period, without friction.

    epsd takes the critical damping of the inertia 7/5 m r^2 about the contact; what rocks here is
    2/5 m r^2, so zeta is the viscosity times sqrt(7/2).
    """
    p, viscosity = parameters(rolling_friction=0.5, sliding_friction=0.0), 0.05
    overlap = (weight(p) / (4 / 3 * reduced_modulus(p) * math.sqrt(R))) ** (2 / 3)
    dt = engine.step_of(p) / 5
    rows, _ = follow(
        tmp_path, p, [[0, 0, R - overlap]], [[0, 0, 0]], 10_000, FLOOR,
        viscosity=viscosity, dt=dt, after="set atom 1 omegay 0.01\n",
    )  # fmt: skip
    w = rows[4]
    peaks = [w[i] for i in range(1, len(w) - 1) if w[i - 1] < w[i] >= w[i + 1] and w[i] > 0]
    ratios, zeta = np.array(peaks[2:5]) / np.array(peaks[1:4]), viscosity * math.sqrt(3.5)
    expected = math.exp(-2 * math.pi * zeta / math.sqrt(1 - zeta**2))
    assert ratios == pytest.approx(expected, rel=0.02)


def test_grains_of_several_sizes_have_the_spread_and_the_mean_mass():
    p = parameters(size_spread=0.25)
    radii = size_classes(p)
    assert radii.std() / radii.mean() == pytest.approx(0.25)
    masses = grain_mass(p) * (radii / R) ** 3
    assert masses.mean() == pytest.approx(mean_grain_mass(p))
