"""Which targets no parameter set can meet, alone or together."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from calibrator.case.problem import Problem
from calibrator.responses.box import corners, refined, sample_of
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.success import Success
from calibrator.responses.targets import bands, ruling, target_columns
from calibrator.search.parts import OUT_OF_REACH, JointReach, Reachability, TargetReach

Predict = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def unreachable(
    problem: Problem,
    interpolant: Interpolant,
    success: Success | None = None,
    samples: int = 2**13,
    seed: int = 1,
) -> Reachability:
    """Which targets the model cannot reach inside the box, singly or together.

    The interpolant is asked at a Sobol sample and the corners of the box; the closest approach to
    each target, and to all of them together, is refined in boxes that shrink around it. Distances
    are in combined standard errors: half the band within which a mean without seed noise meets the
    target (see `targets.bands`), and the interpolant's, added in quadrature.

    What is met only where runs are likely to fail counts as out of reach, and is said to be that.
    success : where they succeed; everywhere, unless given.
    """
    rng = np.random.default_rng(seed)
    success = success or Success(problem, ())
    predict = _target_predictions(problem, interpolant)
    box = np.concatenate([sample_of(problem, samples, rng), corners(problem)])
    sample = success.among(box)
    mean, misfit = predict(sample)
    singly = tuple(
        _target_reach(problem, predict, i, sample, mean[:, i], success, rng)
        for i in map(int, np.flatnonzero(ruling(problem.targets)))
    )
    start = sample[np.argmin(misfit.max(axis=1))]
    point = refined(_worst_within(predict, success), start, problem, rng)
    misfit = predict(point[None])[1][0]
    worst = int(np.argmax(misfit))
    joint = JointReach(
        float(misfit[worst]), problem.targets[worst].key, tuple(float(x) for x in point)
    )
    found = Reachability(singly, joint)
    return found if found.all or success.certain else _with_failing(problem, predict, box, found)


def _worst_within(predict: Predict, success: Success) -> Callable[[np.ndarray], np.ndarray]:
    """The largest misfit (n,) of points (n, d), infinite where runs are likely to fail."""

    def loss(points: np.ndarray) -> np.ndarray:
        return np.where(success.shortfall(points) > 0, np.inf, predict(points)[1].max(axis=1))

    return loss


def _with_failing(
    problem: Problem, predict: Predict, box: np.ndarray, found: Reachability
) -> Reachability:
    """The findings, which say of what is out of reach whether it is met where runs fail.

    box : points (n, d) of the whole box.
    """
    mean, misfit = predict(box)
    values = np.array([t.value for t in problem.targets])
    between = (mean.min(axis=0) <= values) & (values <= mean.max(axis=0))
    singly = between | (misfit.min(axis=0) <= OUT_OF_REACH)
    rng, start = np.random.default_rng(1), box[np.argmin(misfit.max(axis=1))]
    point = refined(lambda p: predict(p)[1].max(axis=1), start, problem, rng)
    together = bool(predict(point[None])[1].max() <= OUT_OF_REACH)
    targets = tuple(
        dataclasses.replace(t, only_failing=bool(met and not t.reachable))
        for t, met in zip(found.targets, singly, strict=True)
    )
    failing = together and not found.joint.reachable
    return Reachability(targets, dataclasses.replace(found.joint, only_failing=failing))


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
    success: Success,
    rng: np.random.Generator,
) -> TargetReach:
    """Closest approach to one target; mean (n,) are its predictions at sample (n, d)."""
    target = problem.targets[index]
    start = sample[np.argmin(np.abs(mean - target.value))]

    def loss(points: np.ndarray) -> np.ndarray:
        away = np.abs(predict(points)[0][:, index] - target.value)
        return np.where(success.shortfall(points) > 0, np.inf, away)

    near = refined(loss, start, problem, rng)
    best, gap = (float(every[0, index]) for every in predict(near[None]))
    low, high = min(float(mean.min()), best), max(float(mean.max()), best)
    # a continuous response takes every value between two that it takes
    if low <= target.value <= high:
        best, gap = target.value, 0.0
    return TargetReach(target.key, target.value, low, high, best, gap)
