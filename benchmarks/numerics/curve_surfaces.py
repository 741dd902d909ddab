"""Are the components of real curves predicted as well as they say, at sets left out?

    python -m benchmarks.numerics.curve_surfaces    a minute or two; no run is made

From shipped runs and their curves (grid/missing_effect.csv, grid/missing_effect_curves.npz; no
effect on): heaps from a cylinder of 7 grain diameters, and hourglasses, at 16 sets of two frictions
and a restitution with two seeds each. Each set in turn is the laboratory, its two runs the measured
curve, with the seeds' scatter; the others are the database. Writes
benchmarks/results/curve_surfaces.json: how many components there are, how far the laboratory's
curve is from the mean of all sets and from what the surfaces promise, in the root mean square, and
the deviations of the components in standard errors, whose root mean square should be one.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.common import rounded, write
from benchmarks.numerics.sensitivities import RUNS
from calibrator.case.curve import MeasuredCurve
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.case.vocabulary import EFFECTS
from calibrator.responses.curves import components
from calibrator.responses.fit import fit_responses
from calibrator.responses.interpolant import known_noise
from calibrator.runs.curves import read_companion
from calibrator.runs.database import Database
from calibrator.runs.record import Record

PARAMETERS = (
    Parameter("rolling_friction", 0.05, 0.45),
    Parameter("sliding_friction", 0.2, 0.7),
    Parameter("restitution", 0.4, 0.95),
)
VESSELS = {"conical_pile": ("cylinder_diameter", 14e-3), "hourglass": ("neck_diameter", 14e-3)}
CURVES = {
    ("conical_pile", "profile_height"): (0.5e-3, 20e-3),
    ("hourglass", "profile_height"): (1e-3, 12e-3),
    ("hourglass", "passed_mass"): (0.0, 0.5),
}
"""The ranges of x [m, s] of what a laboratory would read."""
READ = 40  # points


def runs_of(database: Path, setup: str) -> list[Record]:
    """The good runs of a set-up without an effect, in the vessel of which there are replicates."""
    size, value = VESSELS[setup]
    return [
        r
        for r in Database.read(database).records.values()
        if r.request.setup == setup and r.status == "ok" and r.request.value(size) == value
        if not EFFECTS.keys() & r.request.parameters.keys()
    ]


def laboratory(setup: str, name: str, curves: np.ndarray, scatter: np.ndarray) -> Problem:
    """The mean of curves (n, q) as a target; scatter (q,) of one."""
    at = np.linspace(*CURVES[setup, name], READ)
    rows = (at, curves.mean(axis=0), scatter)
    measured = MeasuredCurve(*(tuple(map(float, row)) for row in rows))
    target = Target(setup, name, measured.level, replicates=len(curves), curve=measured)
    return Problem(PARAMETERS, (target,))


def left_out(setup: str, name: str, records: list[Record]) -> dict[str, object]:
    """Each set of these runs once as the laboratory."""
    found = read_companion(RUNS, [r.run_id for r in records])
    there = [r for r in records if r.run_id in found]
    points = np.array([[r.request.value(p.name) for p in PARAMETERS] for r in there], float)
    curves = [found[r.run_id][name] for r in there]
    rows = np.array([np.interp(np.linspace(*CURVES[setup, name], READ), *c) for c in curves])
    sets, own = np.unique(points, axis=0, return_inverse=True)
    means = np.array([rows[own == i].mean(axis=0) for i in range(len(sets))])
    scatter = np.sqrt(((rows - means[own]) ** 2).sum(axis=0) / (len(rows) - len(sets)))
    parts, before, after, scaled = Counter[int](), [], [], list[float]()
    for i, one in enumerate(sets):
        problem = laboratory(setup, name, rows[own == i], scatter)
        inside = [c for c, o in zip(curves, own, strict=True) if o != i]
        curve = components(problem.targets[0], points[own != i], inside)
        values = np.array([list(curve.of(c).values()) for c in inside])
        keys = [t.key for t in curve.targets]
        surface = fit_responses(problem, points[own != i], values, keys)
        mean, error = (a[0] for a in surface.predict_with_error(one[None]))
        off = np.array([t.value for t in curve.targets]) - mean
        count = int((own == i).sum())
        scaled += list(off / np.hypot(error, known_noise(surface) / count**0.5))[:-1]
        before.append(np.mean((means[i] - np.delete(means, i, axis=0).mean(axis=0)) ** 2))
        after.append(np.sum(off**2))
        parts[len(keys)] += 1
    return {
        "sets": len(sets),
        "runs": len(there),
        "components": {str(k): n for k, n in sorted(parts.items())},
        "from_the_mean_of_all_sets": rounded(np.sqrt(np.mean(before)), 3),
        "from_the_surfaces": rounded(np.sqrt(np.mean(after)), 3),
        "seed_noise_of_a_mean": rounded(np.sqrt(np.mean(scatter**2) * len(sets) / len(rows)), 3),
        "in_standard_errors": rounded(np.sqrt(np.mean(np.square(scaled))), 3),
        "beyond_two_standard_errors": f"{int(np.sum(np.abs(scaled) > 2))} of {len(scaled)}",
    }


if __name__ == "__main__":
    write(
        "curve_surfaces",
        {
            "about": "real curves, each set of the database left out in turn; metres and kilograms",
            **{
                f"{setup}.{name}": left_out(setup, name, runs_of(RUNS, setup))
                for setup, name in CURVES
            },
        },
    )
