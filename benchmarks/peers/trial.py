"""The truth that methods are tried on, and one calibration to be done."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from calibrator.case.case import Case
from calibrator.case.problem import Problem, Target, Value
from calibrator.plan.adaptive import bands
from calibrator.responses.box import sample_of
from calibrator.responses.fit import fit_responses
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.table import response_table
from calibrator.runs.database import Database

RESPONSES = (
    "hourglass.bulk_density",
    "hourglass.drained_equivalent_angle_deg",
    "hourglass.mass_flow_rate",
)
FEW: dict[str, Value] = {
    "particle_radius": 0.4e-3,
    "particle_density": 2800.0,
    "young_modulus": 5e6,
}  # fixed where only frictions are sought
GRID = {2: (5, 6), 5: (5, 6, 3, 3, 3)}  # samples of the reference paper's grids
FIRST = {2: 5, 5: 10}  # sets that our design starts with
BAR = {2: 25, 5: 60}
TOLERANCE = 0.02
VERIFYING = 3  # runs
MOST_RUNS = 600
BEYOND = 1.07  # of the largest density that the box reaches: the target that cannot be met


@dataclass(frozen=True, eq=False)
class Surface:
    """The truth: mean responses over the case's parameters, and the seed noise (t,) of a run."""

    case: Case
    interpolant: Interpolant

    @classmethod
    def of(cls, case: Case, database: Path) -> Surface:
        """Fitted to the good hourglass runs of a database."""
        points, values = response_table(
            case.problem, list(Database.read(database).records.values()), RESPONSES
        )
        return cls(
            case,
            fit_responses(
                case.problem, points, values, RESPONSES, similarity=case.interpolation.similarity
            ),
        )

    @property
    def noise(self) -> np.ndarray:
        """Seed noise of a single run (t,)."""
        return self.interpolant.noise

    def problem(self, count: int) -> Problem:
        """The case's problem with so many parameters: all, or the frictions.

        Targets are still to be set.
        """
        kept = [p for p in self.case.problem.parameters if count == 5 or p.name not in FEW]
        fixed = FEW if count == 2 else {}
        samples = [
            dataclasses.replace(p, samples=n) for p, n in zip(kept, GRID[count], strict=True)
        ]
        return dataclasses.replace(
            self.case.problem, parameters=tuple(samples), held_out=(), fixed=fixed
        )

    def mean(self, problem: Problem, points: np.ndarray) -> np.ndarray:
        """Noise-free responses (k, t) at points (k, d) of such a problem."""
        columns = problem.columns(points)
        full = [np.broadcast_to(columns[name], len(points)) for name in self.case.problem.names]
        return self.interpolant.predict(np.column_stack(full))


@dataclass(eq=False)
class Trial:
    """One calibration to be done: targets, runs that are counted, and the judgement of a set."""

    surface: Surface
    problem: Problem
    seed: int
    made: int = 0
    rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng([self.seed, 1])

    @property
    def similarity(self) -> bool:
        """Whether the density can be taken out by similarity."""
        return self.surface.case.interpolation.similarity and len(self.problem.names) == 5

    def run(self, points: np.ndarray) -> np.ndarray:
        """Responses (k, t) of one run at each of the points (k, d)."""
        self.made += len(points)
        mean = self.surface.mean(self.problem, points)
        return mean + self.surface.noise * self.rng.standard_normal(mean.shape)

    def missed(self, points: np.ndarray) -> np.ndarray:
        """Distance (k, t) of the noise-free responses at points (k, d) from the targets."""
        return np.abs(
            self.surface.mean(self.problem, points) - [t.value for t in self.problem.targets]
        )

    def worst(self, point: np.ndarray) -> float:
        """Largest relative error of the noise-free responses at a set (d,)."""
        return float(
            (self.missed(point[None])[0] / np.abs([t.value for t in self.problem.targets])).max()
        )

    def meets(self, point: np.ndarray) -> bool:
        """Whether every noise-free response at a set (d,) is within tolerance or noise."""
        return bool(self.met(point[None])[0])

    def met(self, points: np.ndarray) -> np.ndarray:
        """`meets` (k,) for points (k, d)."""
        return np.all(
            self.missed(points) <= bands(self.problem.targets, self.surface.noise, VERIFYING),
            axis=1,
        )

    def share(self) -> float:
        """Share of the box that meets the targets: the chance of a set drawn at random."""
        return float(self.met(sample_of(self.problem, 2**12, np.random.default_rng(0))).mean())


def reachable_trial(surface: Surface, count: int, seed: int) -> Trial:
    """Targets that a set in the central 80 % of each range has."""
    problem = surface.problem(count)
    shares = np.random.default_rng([seed, 0]).uniform(0.1, 0.9, count)
    truth = np.array([p.values_at(s) for p, s in zip(problem.parameters, shares, strict=True)])
    return Trial(surface, with_targets(problem, surface.mean(problem, truth[None])[0]), seed)


def unreachable_trial(surface: Surface, count: int, seed: int) -> Trial:
    """The same, but for a density beyond the largest of the box."""
    trial = reachable_trial(surface, count, seed)
    values = np.array([t.value for t in trial.problem.targets])
    sample = sample_of(trial.problem, 2**12, np.random.default_rng(0))
    values[0] = BEYOND * surface.mean(trial.problem, sample)[:, 0].max()
    return Trial(surface, with_targets(trial.problem, values), seed)


def with_targets(problem: Problem, values: np.ndarray) -> Problem:
    """The problem with these values (t,) of the responses as targets."""
    names = [key.split(".") for key in RESPONSES]
    targets = (
        Target(setup, name, float(v), tolerance=TOLERANCE)
        for (setup, name), v in zip(names, values, strict=True)
    )
    return dataclasses.replace(problem, targets=tuple(targets))
