"""From a Pareto front to candidates: a spread along it, and one compromise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calibrator.case.problem import Problem, Target
from calibrator.errors import CalibratorError
from calibrator.responses.targets import bands, chances, met, relative_errors

NEARLY = 0.95  # of the highest chance of being verified: more would cost time for little


def spread(objectives: np.ndarray, count: int = 4) -> np.ndarray:
    """Members of a front that span it, like individuals A to D of the paper's Table 6.

    Parameters
    ----------
    objectives : (p, k >= 2) of the front; ties in one objective are broken by the other
    count : members wanted

    Returns
    -------
    indices : up to (count,), from the smallest first objective to the smallest second one; those
        between are the nearest to equal spacing in the second objective. Fewer where the front has
        fewer distinct members.

    Raises
    ------
    CalibratorError : the front has no member or a single objective, or count is below 2
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
    names: Sequence[str] = ("error", "time_cost"),
    success: np.ndarray | float = 1.0,
) -> tuple[int, str]:
    """The one member to recommend: the cheapest that meets every target, and is likely to.

    A target is met where the prediction lies within the band of the verification's runs (see
    `targets.bands`). Of the members that meet all of them those are taken whose chance that the
    verification meets them too is nearly the highest of all, and of these the cheapest: the
    cheapest without that would sit on the edge of its band, and fail every second verification. If
    no member meets every target the smallest total error is taken.

    Parameters
    ----------
    objectives : (p, k) of the front
    predicted, std : response key -> (p,) predictions and their standard errors
    noise : response key -> seed noise of a single run, NaN where it is not known
    replicates : runs that will verify the member
    names : of the k objectives; cheapest is the smallest of the first that is not the error
    success : (p,) probability that runs of a member end well, a factor of its chance

    Returns
    -------
    index, sentence : the member, and which rule chose it or which targets it misses
    """
    targets = problem.targets
    mean, error = (np.column_stack([by[t.key] for t in targets]) for by in (predicted, std))
    one_run = np.array([noise[t.key] for t in targets])
    costs = [i for i, name in enumerate(names) if name != "error"]
    cost = objectives[:, costs[0] if costs else 0]
    total = relative_errors(problem, predicted) @ np.array([t.weight for t in targets])
    good = met(targets, mean, one_run, replicates).all(axis=1)
    if not good.any():
        index = int(np.lexsort((cost, total))[0])
        return index, _missing(targets, mean[index], bands(targets, one_run, replicates))
    chance = success * np.exp(chances(targets, mean, error, one_run, replicates))
    likely = np.flatnonzero(good & (chance >= NEARLY * chance[good].max()))
    index = int(likely[np.lexsort((total[likely], cost[likely]))[0]])
    best = "cheapest" if costs and np.ptp(cost) > 0 else "smallest error"
    return index, (
        f"{best} of the {len(likely)} (of {len(mean)}) front members that meet every target"
        f" with the highest chance of being verified, {chance[index]:.0%}"
    )


def _missing(targets: Sequence[Target], mean: np.ndarray, band: np.ndarray) -> str:
    """Which targets the member misses that no other betters; mean, band : (t,)."""
    miss = np.abs(mean - [t.value for t in targets])
    missed = [
        f"{t.key} by {miss[i] / t.scale:.1%} (band {band[i] / t.scale:.1%})"
        for i, t in enumerate(targets)
        if miss[i] > band[i]
    ]
    words = "no front member meets every target; the smallest total error misses "
    return words + " and ".join(missed)
