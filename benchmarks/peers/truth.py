"""The truth that methods are tried on: a family of surfaces that none of them fits.

Quadratic in the parameters, by least squares through the good hourglass runs of a database. The
designs of ours fit Gaussian processes, for which similarity takes the density out; the truth keeps
to similarity only as far as real runs do. The shift of each response between pairs of runs at the
ends of the density's range, which ought to be none, is measured (benchmarks/results/
similarity.json), and grows here with the density.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.common import RESULTS
from calibrator.case.case import Case
from calibrator.case.problem import Problem
from calibrator.diagnosis.surfaces import terms
from calibrator.responses.coordinates import DENSITY, Coordinates
from calibrator.responses.table import response_table
from calibrator.runs.database import Database

RESPONSES = (
    "hourglass.bulk_density",
    "hourglass.drained_equivalent_angle_deg",
    "hourglass.mass_flow_rate",
)


def real_shifts() -> np.ndarray:
    """Relative shift (t,) of each response from the lightest to the heaviest grains."""
    found = json.loads((RESULTS / "similarity.json").read_text())["in_use_mean"]
    return np.array([found[key.split(".")[1]]["difference"] for key in RESPONSES])


@dataclass(frozen=True, eq=False)
class Surface:
    """Mean responses over the case's parameters, and the seed noise (t,) of a run.

    Attributes
    ----------
    case : whose parameters these are.
    coefficients : (p, t) of the quadratic terms.
    shifts : (t,) from real pairs.
    noise : (t,), the scatter of replicates, in the responses' units.
    sets : number of parameter sets behind it.
    """

    case: Case
    coefficients: np.ndarray
    shifts: np.ndarray
    noise: np.ndarray
    sets: int

    @classmethod
    def of(cls, case: Case, database: Path) -> Surface:
        """Fitted to the good hourglass runs of a database."""
        records = list(Database.read(database).records.values())
        points, values = response_table(case.problem, records, RESPONSES)
        shifts = real_shifts()
        design = _design(case.problem, points)
        coefficients, *_ = np.linalg.lstsq(
            design, values / _density_factors(case.problem, points, shifts), rcond=None
        )
        _, index = np.unique(points, axis=0, return_inverse=True)
        means = np.array([values[index.ravel() == i].mean(axis=0) for i in range(index.max() + 1)])
        left = values - means[index.ravel()]
        noise = np.sqrt((left**2).sum(axis=0) / (len(values) - len(means)))
        return cls(case, coefficients, shifts, noise, len(means))

    def mean(self, problem: Problem, points: np.ndarray) -> np.ndarray:
        """Noise-free responses (k, t) at points (k, d) of a problem of some of the parameters."""
        columns, own = problem.columns(points), self.case.problem
        full = np.column_stack([np.broadcast_to(columns[n], len(points)) for n in own.names])
        factors = _density_factors(own, full, self.shifts)
        return np.asarray(_design(own, full) @ self.coefficients * factors)


def _design(problem: Problem, points: np.ndarray) -> np.ndarray:
    change = Coordinates(problem, True)
    low, high = change.bounds
    shares = (change.inward(points) - low) / (high - low)
    return terms(shares, np.zeros((len(points), 0)))


def _density_factors(problem: Problem, points: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """What density does (k, t): exactly by similarity, and beyond it."""
    column = problem.names.index(DENSITY)
    share = problem.shares_of(points)[:, column]
    factors = Coordinates(problem, True).factors(points, RESPONSES)
    return np.asarray(factors * (1 + np.outer(share - 0.5, shifts)))
