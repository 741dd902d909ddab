"""From a Pareto front to candidates: a spread along it, one compromise, and whether the targets can
be reached at all.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calibrator.case.problem import Problem
from calibrator.errors import CalibratorError
from calibrator.responses.targets import bands, relative_errors


def spread(objectives: np.ndarray, count: int = 4) -> np.ndarray:
    """Members of a front that span it, like individuals A to D of the paper's Table 6.

    Parameters
    ----------
    objectives : (p, k >= 2) of the front; ties in one objective are broken by the other.
    count : members wanted.

    Returns
    ------- Indices (up to count,) from the smallest first objective to the smallest second one;
    those between are the nearest to equal spacing in the second objective. Fewer where the front
    has fewer distinct members.
    """
    if objectives.ndim != 2 or objectives.shape[1] < 2 or not len(objectives):
        raise CalibratorError(
            f"a front of shape {objectives.shape} has no spread: give (p, 2) objectives or more,"
            " p > 0"
        )
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


def compromise(
    problem: Problem,
    objectives: np.ndarray,
    predicted: Mapping[str, np.ndarray],
    std: Mapping[str, np.ndarray],
    noise: Mapping[str, float],
    replicates: int = 1,
) -> tuple[int, str]:
    """The one member to recommend: the cheapest that meets every target.

    Cheapest is the smallest second objective (the only one where there is one). A target is met
    where the prediction lies within its band (see `bands`) even after a reserve: two standard
    errors of the difference between the prediction and the mean of the verification's runs. Without
    it the cheapest member would sit on the edge of its band, and fail every second verification. If
    no member meets all targets the reserve is given up; if still none does, the smallest total
    error is taken.

    Parameters
    ----------
    objectives : (p, k) of the front; predicted, std : response key -> (p,) predictions and their
    standard errors;
    noise : response key -> seed noise of a single run; replicates : runs that will verify the
    member.

    Returns
    -------
    index of the member, and a sentence that says which rule chose it and which targets it misses.
    """
    miss = np.column_stack([np.abs(predicted[t.key] - t.value) for t in problem.targets])
    reserve = np.column_stack(
        [2 * np.hypot(std[t.key], noise[t.key] / np.sqrt(replicates)) for t in problem.targets]
    )
    band = bands(problem, noise)
    cost = objectives[:, min(1, objectives.shape[1] - 1)]
    total = relative_errors(problem, predicted) @ np.array([t.weight for t in problem.targets])
    rules = (
        (miss + reserve, "with two standard errors in reserve"),
        (miss, "but with nothing in reserve"),
    )
    for excess, words in rules:
        met = np.flatnonzero((excess <= band).all(axis=1))
        if len(met):
            index = met[np.lexsort((total[met], cost[met]))[0]]
            return (
                int(index),
                (
                    f"cheapest of the {len(met)} (of {len(miss)}) front members that meet every"
                    f" target {words}"
                ),
            )
    index = int(np.lexsort((cost, total))[0])
    missed = [
        f"{t.key} by {miss[index, i] / abs(t.value):.1%} (band {band[i] / abs(t.value):.1%})"
        for i, t in enumerate(problem.targets)
        if miss[index, i] > band[i]
    ]
    return (
        index,
        "no front member meets every target; the smallest total error misses "
        + " and ".join(missed),
    )
