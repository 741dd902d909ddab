"""A made-up world whose runs leave curves, and a laboratory that photographs such a heap.

Heap and drained crater are smooth functions of the two frictions. What single runs scatter by is
smooth along the curve, as it is where grains lie differently: neighbouring points scatter together.
"""

from pathlib import Path

import numpy as np

from calibrator.case.curve import MeasuredCurve, curve_file
from calibrator.case.vocabulary import RESPONSES
from tests import fake_yade
from tests.stand_in import World

RADII = np.linspace(0.5e-3, 20e-3, 30)
"""Positions [m] at which a surface is scanned."""
NOISE = 0.15e-3
"""Standard deviation [m] of a single run at a point."""
REACH = 4e-3
"""Distance [m] over which points of a run scatter together."""
TRUTH = {"rolling_friction": 0.25, "sliding_friction": 0.5}
CASE = """
name = "toy"
measured = "lab.csv"
[parameters.rolling_friction]
low = 0.05
high = 0.45
[parameters.sliding_friction]
low = 0.2
high = 0.7
[plan]
sets = 14
replicates = 2
[search]
population = 60
generations = 20
objectives = ["error"]
[verify]
replicates = 5
[validate]
replicates = 4
"""
HEAD = "setup,response,value,scatter,replicates,unit,role\n"


def heap(rolling, sliding, at=RADII):
    """Surface (n,) [m] of a heap over the distance from its axis.

    Rolling friction makes it higher, sliding friction narrower.
    """
    foot, top = 19e-3 - 6e-3 * sliding, 10e-3 * np.tan(np.radians(12 + 30 * np.tanh(2 * rolling)))
    cone = top * (1 - np.hypot(at, 3e-3) / foot)
    return 0.5e-3 * np.logaddexp(0, cone / 0.5e-3)


def crater(rolling, sliding, at=RADII):
    """Surface (n,) [m] of what stays in the hourglass: it rises outwards."""
    return np.tan(np.radians(25 + 20 * rolling + 8 * sliding)) * np.maximum(at - 4e-3, 0)


def scatter(rng, at=RADII):
    """What one run has (n,) [m] beside the mean: smooth along the curve."""
    alike = np.exp(-((at[:, None] - at) ** 2) / (2 * REACH**2)) + 1e-8 * np.eye(len(at))
    return NOISE * np.linalg.cholesky(alike) @ rng.normal(size=len(at))


def curves_of(setup, p, seed):
    """The arrays of a run."""
    surface = {"conical_pile": heap, "hourglass": crater}.get(setup)
    if surface is None:
        return {}
    kind = ("conical_pile", "hourglass").index(setup)
    mean = surface(p["rolling_friction"], p["sliding_friction"])
    rng = np.random.default_rng([seed, kind])
    return {"profile_radius": RADII, "profile_height": mean + scatter(rng)}


def world(**more):
    """The world, with what else is asked for."""
    return World(curves_of=curves_of, **more)


def photographed(
    rng, surface=heap, replicates=5, scale_error=0.0, bump=0.0, points=60, truth=TRUTH
):
    """A measured curve: the mean of replicates at the truth, read at many points.

    scale_error : of the photographs, all of which share it; bump : height [m] of what no simulated
    surface has.
    """
    at = np.linspace(1e-3, 18e-3, points)
    mean = surface(*truth.values(), at)
    found = mean + np.mean([scatter(rng, at) for _ in range(replicates)], axis=0)
    found = found * (1 + scale_error * rng.normal()) + bump * np.sin(at / 1.5e-3)
    noise = np.full(points, NOISE)
    return MeasuredCurve(*(tuple(map(float, one)) for one in (at, found, noise)), scale_error)


def write(folder: Path, rows: str, curves: dict[str, MeasuredCurve], case: str = "") -> Path:
    """Write a case with the rows of its lab file and its curves; returns the case file's path."""
    (folder / "lab.csv").write_text(HEAD + rows)
    for name, curve in curves.items():
        (folder / name).write_text(curve_file(curve))
    path = folder / "toy.toml"
    path.write_text(CASE + case)
    return path


def scalar_row(setup, response, scatter=0.004, role="calibrate"):
    """A row of the lab file with what the fake YADE gives at the truth."""
    value = fake_yade.responses_of(setup, {**TRUTH, "young_modulus": 5e6})[response]
    return f"{setup},{response},{value!r},{scatter * value!r},5,{RESPONSES[response].unit},{role}\n"


def photographed_heap():
    """One and the same photographed heap."""
    return photographed(np.random.default_rng(3))
