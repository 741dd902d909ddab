"""From a Pareto front to candidates: a spread along it, one compromise, and whether the targets can be reached at all."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from calibrator.errors import CalibratorError
from calibrator.interpolation import Interpolant, box_sample
from calibrator.objectives import relative_errors, target_columns, target_errors
from calibrator.problem import Problem

OUT_OF_REACH = 2.0  # combined standard errors
MOST_CORNERS = 10  # dimensions up to which all corners of the box are tried

Predict = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def spread(objectives: np.ndarray, count: int = 4) -> np.ndarray:
    """Members of a front that span it, like individuals A to D of the paper's Table 6.

    Parameters
    ----------
    objectives : (p, k >= 2) of the front; ties in one objective are broken by the other.
    count : members wanted.

    Returns
    -------
    Indices (up to count,) from the smallest first objective to the smallest second one; those between are the nearest to
    equal spacing in the second objective. Fewer where the front has fewer distinct members.
    """
    if objectives.ndim != 2 or objectives.shape[1] < 2 or not len(objectives):
        raise CalibratorError(f"a front of shape {objectives.shape} has no spread: give (p, 2) objectives or more, p > 0")
    if count < 2:
        raise CalibratorError(f"count = {count}: ask for 2 members or more")
    first = int(np.lexsort((objectives[:, 1], objectives[:, 0]))[0])
    last = int(np.lexsort((objectives[:, 0], objectives[:, 1]))[0])
    if first == last:
        return np.array([first])
    chosen = [first, last]
    left = set(np.unique(objectives[:, :2], axis=0, return_index=True)[1]) - {first, last}
    for wanted in np.linspace(objectives[first, 1], objectives[last, 1], count)[1:-1]:
        if left:
            nearest = min(sorted(left), key=lambda i: abs(objectives[i, 1] - wanted))
            chosen.append(nearest)
            left.remove(nearest)
    return np.array(sorted(chosen, key=lambda i: (-objectives[i, 1], objectives[i, 0])))


def bands(problem: Problem, noise: Mapping[str, float]) -> np.ndarray:
    """Half width (t,) within which a prediction counts as met: the tolerance, but no less than two seed noises."""
    return np.array([max(t.tolerance * abs(t.value), 2 * noise[t.key]) for t in problem.targets])


def compromise(
    problem: Problem,
    objectives: np.ndarray,
    predicted: Mapping[str, np.ndarray],
    std: Mapping[str, np.ndarray],
    noise: Mapping[str, float],
    replicates: int = 1,
) -> tuple[int, str]:
    """The one member to recommend: the cheapest that meets every target.

    Cheapest is the smallest second objective (the only one where there is one). A target is met where the prediction lies
    within its band (see `bands`) even after a reserve: two standard errors of the difference between the prediction and
    the mean of the verification's runs. Without it the cheapest member would sit on the edge of its band, and fail every
    second verification. If no member meets all targets the reserve is given up; if still none does, the smallest total
    error is taken.

    Parameters
    ----------
    objectives : (p, k) of the front; predicted, std : response key -> (p,) predictions and their standard errors;
    noise : response key -> seed noise of a single run; replicates : runs that will verify the member.

    Returns
    -------
    index of the member, and a sentence that says which rule chose it and which targets it misses.
    """
    miss = np.column_stack([np.abs(predicted[t.key] - t.value) for t in problem.targets])
    reserve = np.column_stack([2 * np.hypot(std[t.key], noise[t.key] / np.sqrt(replicates)) for t in problem.targets])
    band = bands(problem, noise)
    cost = objectives[:, min(1, objectives.shape[1] - 1)]
    total = relative_errors(problem, predicted) @ np.array([t.weight for t in problem.targets])
    rules = ((miss + reserve, "with two standard errors in reserve"), (miss, "but with nothing in reserve"))
    for excess, words in rules:
        met = np.flatnonzero((excess <= band).all(axis=1))
        if len(met):
            index = met[np.lexsort((total[met], cost[met]))[0]]
            return int(index), f"cheapest of the {len(met)} (of {len(miss)}) front members that meet every target {words}"
    index = int(np.lexsort((cost, total))[0])
    missed = [
        f"{t.key} by {miss[index, i] / abs(t.value):.1%} (band {band[i] / abs(t.value):.1%})"
        for i, t in enumerate(problem.targets)
        if miss[index, i] > band[i]
    ]
    return index, "no front member meets every target; the smallest total error misses " + " and ".join(missed)


@dataclass(frozen=True)
class TargetReach:
    """How close the interpolated response comes to one target anywhere in the box.

    low and high bound the values found, best is the nearest to the target value, gap its distance in combined standard
    errors of target and interpolant; the target is out of reach beyond 2.
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
        return f"{self.key} = {self.value:.4g} cannot be reached: {span}, {self.gap:.1f} standard errors short; widen the bounds"


@dataclass(frozen=True)
class JointReach:
    """The point (d,) of the box where the worst-met target is met best, its misfit in combined standard errors and its key."""

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
            return f"all targets can be met together, the worst ({self.worst}) within {self.misfit:.1f} standard errors"
        return f"the targets cannot be met together: {self.worst} stays {self.misfit:.1f} standard errors off at best"


@dataclass(frozen=True)
class Reachability:
    """Each target by itself, and all of them at one point."""

    targets: tuple[TargetReach, ...]
    joint: JointReach


def unreachable(problem: Problem, interpolant: Interpolant, samples: int = 2**13, seed: int = 1) -> Reachability:
    """Which targets the model cannot reach inside the box, singly or together.

    The interpolant is asked at a Sobol sample and the corners of the box; the closest approach to each target, and to all
    of them together, is refined in boxes that shrink around it. Distances are in combined standard errors, those of the
    target (see `objectives.target_errors`) and of the interpolant added in quadrature.
    """
    rng = np.random.default_rng(seed)
    predict = _target_predictions(problem, interpolant)
    sample = np.concatenate([box_sample(problem.low, problem.high, samples, rng), _corners(problem)])
    mean, misfit = predict(sample)
    singly = tuple(_target_reach(problem, predict, i, sample, mean[:, i], rng) for i in range(len(problem.targets)))
    start = sample[np.argmin(misfit.max(axis=1))]
    point = refined(lambda p: predict(p)[1].max(axis=1), start, problem, rng)
    misfit = predict(point[None])[1][0]
    worst = int(np.argmax(misfit))
    joint = JointReach(float(misfit[worst]), problem.targets[worst].key, tuple(float(x) for x in point))
    return Reachability(singly, joint)


def _target_predictions(problem: Problem, interpolant: Interpolant) -> Predict:
    """Function from points (n, d) to the predictions of the targets and their misfits in combined standard errors, (n, t)."""
    columns, (errors, _) = target_columns(problem, interpolant.responses), target_errors(problem)
    values = np.array([target.value for target in problem.targets])

    def predict(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mean, std = interpolant.predict_with_error(points)
        return mean[:, columns], np.abs(mean[:, columns] - values) / np.hypot(errors, std[:, columns])

    return predict


def _target_reach(
    problem: Problem, predict: Predict, index: int, sample: np.ndarray, mean: np.ndarray, rng: np.random.Generator
) -> TargetReach:
    """Closest approach to one target; mean (n,) are its predictions at sample (n, d)."""
    target = problem.targets[index]
    start = sample[np.argmin(np.abs(mean - target.value))]
    near = refined(lambda p: np.abs(predict(p)[0][:, index] - target.value), start, problem, rng)
    best, gap = (float(every[0, index]) for every in predict(near[None]))
    low, high = min(float(mean.min()), best), max(float(mean.max()), best)
    if low <= target.value <= high:  # a continuous response takes every value between two that it takes
        best, gap = target.value, 0.0
    return TargetReach(target.key, target.value, low, high, best, gap)


def _corners(problem: Problem) -> np.ndarray:
    if len(problem.parameters) > MOST_CORNERS:
        return np.empty((0, len(problem.parameters)))
    return np.array(list(itertools.product(*zip(problem.low, problem.high, strict=True))))


def refined(
    loss: Callable[[np.ndarray], np.ndarray], start: np.ndarray, problem: Problem, rng: np.random.Generator, rounds: int = 10
) -> np.ndarray:
    """Point (d,) of smallest loss found in boxes around the best so far, each half the size of the one before."""
    best, half = start, (problem.high - problem.low) / 2
    for _ in range(rounds):
        half = half / 2
        nearby = box_sample(np.maximum(best - half, problem.low), np.minimum(best + half, problem.high), 256, rng)
        candidates = np.concatenate([best[None], nearby])
        best = candidates[np.argmin(loss(candidates))]
    return best
