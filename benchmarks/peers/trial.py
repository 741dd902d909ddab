"""What is to be calibrated, and one calibration of it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from benchmarks.peers.truth import RESPONSES, Surface
from calibrator.case.case import Case
from calibrator.case.problem import Problem, Target
from calibrator.case.values import Value
from calibrator.plan.adaptive import bands
from calibrator.responses.box import sample_of

DENSE: dict[str, Value] = {"particle_density": 2800.0}
FINE: dict[str, Value] = {"particle_radius": 0.4e-3, "young_modulus": 5e6}
VERIFYING = 3  # runs
MOST_RUNS = 600
BEYOND = 1.07  # of the largest density that the box reaches: the target that cannot be met


@dataclass(frozen=True)
class Task:
    """Which parameters are sought, how closely, and by what designs.

    Attributes
    ----------
    fixed : values of the case's parameters that are not sought.
    tolerance : relative, where the noise allows it.
    grid : samples of each parameter in the reference paper's grid.
    first : sets that our design starts with.
    """

    fixed: dict[str, Value]
    tolerance: float
    grid: tuple[int, ...]
    first: int


TASKS = {
    "2": Task({**DENSE, **FINE}, 0.02, (5, 6), 5),
    "2 hard": Task({**FINE, "sliding_friction": 0.45}, 0.004, (5, 6), 5),
    "5": Task({}, 0.02, (5, 6, 3, 3, 3), 10),
}


@dataclass(eq=False)
class Trial:
    """One calibration to be done: targets, runs that are counted, and the judgement of a set."""

    surface: Surface
    problem: Problem
    task: Task
    seed: int
    made: int = 0
    rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng([self.seed, 1])

    @property
    def similarity(self) -> bool:
        """Whether the density can be taken out by similarity."""
        return self.surface.case.interpolation.similarity and not self.task.fixed

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


def problem_of(case: Case, task: Task) -> Problem:
    """The case's problem with the parameters of a task; targets are still to be set."""
    kept = [p for p in case.problem.parameters if p.name not in task.fixed]
    samples = [dataclasses.replace(p, samples=n) for p, n in zip(kept, task.grid, strict=True)]
    return dataclasses.replace(
        case.problem, parameters=tuple(samples), held_out=(), fixed=task.fixed
    )


def reachable_trial(surface: Surface, task: Task, seed: int) -> Trial:
    """Targets that a set in the central 80 % of each range has."""
    problem = problem_of(surface.case, task)
    shares = np.random.default_rng([seed, 0]).uniform(0.1, 0.9, len(problem.names))
    truth = np.array([p.values_at(s) for p, s in zip(problem.parameters, shares, strict=True)])
    values = surface.mean(problem, truth[None])[0]
    return Trial(surface, with_targets(problem, values, task.tolerance), task, seed)


def unreachable_trial(surface: Surface, task: Task, seed: int) -> Trial:
    """The same, but for a density beyond the largest of the box."""
    trial = reachable_trial(surface, task, seed)
    values = np.array([t.value for t in trial.problem.targets])
    sample = sample_of(trial.problem, 2**12, np.random.default_rng(0))
    values[0] = BEYOND * surface.mean(trial.problem, sample)[:, 0].max()
    return Trial(surface, with_targets(trial.problem, values, task.tolerance), task, seed)


def with_targets(problem: Problem, values: np.ndarray, tolerance: float) -> Problem:
    """The problem with these values (t,) of the responses as targets."""
    names = [key.split(".") for key in RESPONSES]
    targets = (
        Target(setup, name, float(v), tolerance=tolerance)
        for (setup, name), v in zip(names, values, strict=True)
    )
    return dataclasses.replace(problem, targets=tuple(targets))
