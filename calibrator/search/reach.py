"""Which targets no parameter set can meet, alone or together."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from calibrator.case.problem import Problem
from calibrator.responses.box import corners, refined, sample_of
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.targets import bands, ruling, target_columns
from calibrator.search.parts import JointReach, Reachability, TargetReach

Predict = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def unreachable(
    problem: Problem, interpolant: Interpolant, samples: int = 2**13, seed: int = 1
) -> Reachability:
    """Which targets the model cannot reach inside the box, singly or together.

    The interpolant is asked at a Sobol sample and the corners of the box; the closest approach to
    each target, and to all of them together, is refined in boxes that shrink around it. Distances
    are in combined standard errors: half the band within which a mean without seed noise meets the
    target (see `targets.bands`), and the interpolant's, added in quadrature.
    """
    rng = np.random.default_rng(seed)
    predict = _target_predictions(problem, interpolant)
    sample = np.concatenate([sample_of(problem, samples, rng), corners(problem)])
    mean, misfit = predict(sample)
    singly = tuple(
        _target_reach(problem, predict, i, sample, mean[:, i], rng)
        for i in map(int, np.flatnonzero(ruling(problem.targets)))
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
    """Function from points (n, d) to the targets' predictions and misfits, both (n, t).

    Misfits are in combined standard errors (see `unreachable`).
    """
    columns = target_columns(problem, interpolant.responses)
    values = np.array([target.value for target in problem.targets])
    errors = bands(problem.targets, np.zeros(len(values)), 1) / 2

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
