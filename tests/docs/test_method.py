"""The formulas of docs/method.md, written down once more from the page, against the code."""

import math
import sys

import numpy as np
import pytest
from scipy.stats import norm

from calibrator.case import physics
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.case.vocabulary import PARAMETERS, SCRIPTS
from calibrator.responses.objectives import OBJECTIVES
from calibrator.responses.targets import bands, chances
from calibrator.search.nsga2 import decode, generational_distance

GRAIN = {n: q.default for n, q in PARAMETERS.items() if isinstance(q.default, int | float)} | dict(
    particle_radius=4e-4, young_modulus=3e6, restitution=0.5, rolling_stiffness_ratio=2.0
)
TARGETS = (
    Target("hourglass", "bulk_density", 1600.0, scatter=8.0, replicates=4, tolerance=0.001),
    Target("hourglass", "mass_flow_rate", 0.03, scatter=0.002, replicates=4, weight=0.5),
)


@pytest.fixture(scope="module")
def measure():
    """The scripts' module, which needs no YADE."""
    sys.path.insert(0, str(SCRIPTS))
    try:
        import measure
    finally:
        sys.path.remove(str(SCRIPTS))
    return measure


def test_equivalent_angles(measure):
    volume, neck, wall = 3e-6, 7e-3, 15e-3
    crater = 2 * math.pi * ((wall**3 - neck**3) / 3 - neck * (wall**2 - neck**2) / 2)
    assert math.tan(
        math.radians(measure.crater_angle_from_volume(volume, wall, neck))
    ) == pytest.approx(volume / crater)
    wedge = math.tan(math.radians(measure.wedge_angle_from_volume(volume, 0.03, 0.012)))
    assert wedge == pytest.approx(2 * volume / (0.012 * 0.03**2))
    x = np.linspace(-0.02, 0.02, 81)
    heap = np.maximum(0, 6e-3 - 0.5 * np.hypot(x[:, None], x[None, :]))
    area = (x[1] - x[0]) ** 2
    volume = heap.sum() * area
    height = 4 / volume * (heap**2 / 2).sum() * area
    found = math.tan(math.radians(measure.cone_angle_from_moments(x, x, heap)))
    assert found == pytest.approx(height * math.sqrt(math.pi * height / (3 * volume)))
    assert found == pytest.approx(0.5, rel=0.01)  # the heap is a cone of that slope


def test_the_three_bounds_of_the_time_step():
    p, g = GRAIN, physics.GRAVITY
    r, nu, young, rho = (
        p[n] for n in ("particle_radius", "poisson_ratio", "young_modulus", "particle_density")
    )
    mass = 4 / 3 * math.pi * r**3 * rho
    e_star, g_star = young / (2 * (1 - nu**2)), young / (4 * (1 + nu) * (2 - nu))
    overlap = (5 * mass * g / (4 / 3 * e_star * math.sqrt(r / 2))) ** (2 / 3)
    k_t = 8 * g_star * math.sqrt(r / 2 * overlap)
    inertia, c = 0.4 * mass * r**2, p["rolling_stiffness_ratio"]
    shear = young / (2 * (1 + nu))
    first = 0.4 * math.pi * r * math.sqrt(rho / shear) / (0.163 * nu + 0.8766)
    second = 0.28 * math.sqrt(inertia / ((4 + c) / 2 * k_t * (r / 2) ** 2))
    zeta = 6 * physics.damping_ratio(p["restitution"])
    third = 0.8 * math.sqrt(inertia / (k_t * r**2)) * (math.sqrt(1 + zeta**2) - zeta)
    assert p["rayleigh_fraction"] * physics.rayleigh_time(p) == pytest.approx(first)
    assert physics.LARGEST_STEP_SHARE * physics.contact_time(p) == pytest.approx(second)
    assert physics.damped_step(p) == pytest.approx(third)
    assert physics.time_step(p) == pytest.approx(min(first, second, third))


@pytest.fixture(scope="module")
def problem():
    bounds = [("particle_radius", 3e-4, 4e-4), ("particle_density", 2600.0, 2800.0)]
    bounds += [("young_modulus", 5e6, 5e7)]
    return Problem(tuple(Parameter(*one) for one in bounds), TARGETS, {}, {"hourglass": {}})


def test_objectives(problem):
    points = np.array([[3.2e-4, 2650.0, 2e7], [4e-4, 2800.0, 5e6]])
    responses = {
        "hourglass.bulk_density": np.array([1610.0, 1600.0]),
        "hourglass.mass_flow_rate": np.array([0.027, 0.03]),
    }
    columns = problem.columns(points)
    o1 = OBJECTIVES["error"](problem, columns, responses)
    assert o1 == pytest.approx([10 / 1600 + 0.5 * 0.003 / 0.03, 0])
    o2 = OBJECTIVES["time_cost"](problem, columns, responses)
    assert o2 == pytest.approx([0.8 + 0.75 + 1.5e7 / 4.5e7, 0])


def test_what_counts_as_met_and_the_chance_of_it():
    noise, runs = np.array([6.0, 0.003]), 5
    band = bands(TARGETS, noise, runs)
    assert band == pytest.approx(
        [2 * math.sqrt(8**2 / 4 + 6**2 / 5), 2 * math.sqrt(0.002**2 / 4 + 0.003**2 / 5)]
    )
    mean, error = np.array([[1604.0, 0.031]]), np.array([[2.0, 0.001]])
    value, spread = np.array([1600, 0.03]), np.hypot(error, noise / math.sqrt(runs))
    share = norm.cdf((value + band - mean) / spread) - norm.cdf((value - band - mean) / spread)
    assert np.exp(chances(TARGETS, mean, error, noise, runs)) == pytest.approx(share.prod())


def test_the_genetic_code_and_the_generational_distance(problem):
    bits = np.zeros((1, 24), bool)
    bits[0, :8] = [0, 0, 0, 0, 0, 1, 0, 1]  # k = 5 of 8 bits
    assert decode(problem, bits)[0] == pytest.approx([3e-4 + 1e-4 * 5 / 255, 2600, 5e6])
    final = np.array([[0.0, 0.0], [1.0, 0.0]])
    front = np.array([[0.0, 0.3], [1.0, 0.4]])
    assert generational_distance([front, final], final) == pytest.approx([0.35, 0])
