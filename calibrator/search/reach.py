"""Which targets no parameter set can meet, alone or together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calibrator.case.problem import Problem
from calibrator.responses.box import box_sample, corners, refined
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.targets import target_columns, target_errors

OUT_OF_REACH = 2.0  # combined standard errors
Predict = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class TargetReach:
    """How close the interpolated response comes to one target anywhere in the box.

    low and high bound the values found, best is the nearest to the target value, gap its distance
    in combined standard errors of target and interpolant; the target is out of reach beyond 2.
    """

    key: str
    value: float
    low: float
    high: float
    best: float
    gap: float

    @property
    def reachable(self) -> bool:
        """Whether the target lies within 2 combined standard errors of a reachable value."""
        return self.gap <= OUT_OF_REACH

    @property
    def sentence(self) -> str:
        """The finding in plain words."""
        span = f"the box reaches {self.low:.4g} to {self.high:.4g}"
        if self.reachable:
            return f"{self.key} = {self.value:.4g} can be reached: {span}"
        return (
            f"{self.key} = {self.value:.4g} cannot be reached: {span}, {self.gap:.1f} standard"
            " errors short; widen the bounds"
        )


@dataclass(frozen=True)
class JointReach:
    """The point (d,) of the box where the worst-met target is met best, its misfit in combined
    standard errors and its key.
    """

    misfit: float
    worst: str
    point: tuple[float, ...]

    @property
    def reachable(self) -> bool:
        """Whether some point meets every target within 2 combined standard errors."""
        return self.misfit <= OUT_OF_REACH

    @property
    def sentence(self) -> str:
        """The finding in plain words."""
        if self.reachable:
            return (
                f"all targets can be met together, the worst ({self.worst}) within"
                f" {self.misfit:.1f} standard errors"
            )
        return (
            f"the targets cannot be met together: {self.worst} stays {self.misfit:.1f} standard"
            " errors off at best"
        )


@dataclass(frozen=True)
class Reachability:
    """Each target by itself, and all of them at one point."""

    targets: tuple[TargetReach, ...]
    joint: JointReach


def unreachable(
    problem: Problem, interpolant: Interpolant, samples: int = 2**13, seed: int = 1
) -> Reachability:
    """Which targets the model cannot reach inside the box, singly or together.

    The interpolant is asked at a Sobol sample and the corners of the box; the closest approach to
    each target, and to all of them together, is refined in boxes that shrink around it. Distances
    are in combined standard errors, those of the target (see `objectives.target_errors`) and of the
    interpolant added in quadrature.
    """
    rng = np.random.default_rng(seed)
    predict = _target_predictions(problem, interpolant)
    sample = np.concatenate([box_sample(problem.low, problem.high, samples, rng), corners(problem)])
    mean, misfit = predict(sample)
    singly = tuple(
        _target_reach(problem, predict, i, sample, mean[:, i], rng)
        for i in range(len(problem.targets))
    )
    start = sample[np.argmin(misfit.max(axis=1))]
    point = refined(lambda p: predict(p)[1].max(axis=1), start, problem, rng)
    misfit = predict(point[None])[1][0]
    worst = int(np.argmax(misfit))
    joint = JointReach(
        float(misfit[worst]), problem.targets[worst].key, tuple(float(x) for x in point)
    )
    return Reachability(singly, joint)


def _target_predictions(problem: Problem, interpolant: Interpolant) -> Predict:
    """Function from points (n, d) to the predictions of the targets and their misfits in combined
    standard errors, (n, t).
    """
    columns, (errors, _) = target_columns(problem, interpolant.responses), target_errors(problem)
    values = np.array([target.value for target in problem.targets])

    def predict(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mean, std = interpolant.predict_with_error(points)
        return mean[:, columns], np.abs(mean[:, columns] - values) / np.hypot(
            errors, std[:, columns]
        )

    return predict


def _target_reach(
    problem: Problem,
    predict: Predict,
    index: int,
    sample: np.ndarray,
    mean: np.ndarray,
    rng: np.random.Generator,
) -> TargetReach:
    """Closest approach to one target; mean (n,) are its predictions at sample (n, d)."""
    target = problem.targets[index]
    start = sample[np.argmin(np.abs(mean - target.value))]
    near = refined(lambda p: np.abs(predict(p)[0][:, index] - target.value), start, problem, rng)
    best, gap = (float(every[0, index]) for every in predict(near[None]))
    low, high = min(float(mean.min()), best), max(float(mean.max()), best)
    # a continuous response takes every value between two that it takes
    if low <= target.value <= high:
        best, gap = target.value, 0.0
    return TargetReach(target.key, target.value, low, high, best, gap)
