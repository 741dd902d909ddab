"""Points of the box of parameters: filling it, staying inside it, refining a place in it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.stats import qmc

from calibrator.case.problem import Problem
from calibrator.errors import CalibratorError

MOST_SAMPLED = 2**18  # points of the box of which those that constraints allow are kept
MOST_CORNERS = 10  # dimensions up to which all corners of the box are tried


def box_sample(
    low: np.ndarray, high: np.ndarray, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Scrambled Sobol points (n, d) that fill the box from low (d,) to high (d,).

    n is count, rounded up to a power of two.
    """
    unit = qmc.Sobol(len(low), scramble=True, seed=rng).random_base2(
        max(0, math.ceil(math.log2(count)))
    )
    return np.asarray(np.clip(low + (high - low) * unit, low, high))


def sample_of(problem: Problem, count: int, rng: np.random.Generator) -> np.ndarray:
    """Scrambled Sobol points (n, d) that fill the problem's box on the parameters' scales.

    n is count, rounded up to a power of two. Of a box with constraints only what they allow is
    filled, as evenly, with at least as many points where MOST_SAMPLED in the whole box hold them.
    """
    low, high = problem.scaled_bounds
    points = problem.unscaled(box_sample(low, high, count, rng))
    while problem.constraints:
        allowed = points[problem.excess(points) == 0]
        if len(allowed) >= count or len(points) >= MOST_SAMPLED:
            return np.asarray(allowed)
        points = problem.unscaled(box_sample(low, high, 2 * len(points), rng))
    return points


def inside(
    points: np.ndarray, low: np.ndarray, high: np.ndarray, parameters: Sequence[str]
) -> np.ndarray:
    """Points (k, d) of the box from low (d,) to high (d,), clipped by no more than rounding.

    parameters : d names, for messages. Raises CalibratorError if a point lies outside, or has
    another number of columns.
    """
    points = np.atleast_2d(np.asarray(points, float))
    if points.shape[1] != len(low):
        raise CalibratorError(
            f"points have {points.shape[1]} columns: give one for each of {', '.join(parameters)}"
        )
    rounding = 1e-9 * (high - low)
    outside = np.argwhere(~((points >= low - rounding) & (points <= high + rounding)))
    if len(outside):
        row, column = outside[0]
        raise CalibratorError(
            f"{parameters[column]} = {points[row, column]:g} lies outside {low[column]:g} to"
            f" {high[column]:g}: an interpolant does not extrapolate, stay inside or add runs there"
        )
    return np.asarray(np.clip(points, low, high))


def corners(problem: Problem) -> np.ndarray:
    """All corners (k, d) of the box that the constraints allow.

    None where it has more than MOST_CORNERS dimensions.
    """
    if len(problem.parameters) > MOST_CORNERS:
        return np.empty((0, len(problem.parameters)))
    points = np.array(list(itertools.product(*zip(problem.low, problem.high, strict=True))))
    return np.asarray(points[problem.excess(points) == 0])


def refined(
    loss: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    problem: Problem,
    rng: np.random.Generator,
    rounds: int = 10,
) -> np.ndarray:
    """Allowed point (d,) of smallest loss found in boxes around the best so far.

    Each box is half the size of the one before, on the parameters' scales. loss : points (n, d) ->
    (n,); start : (d,).
    """
    (low, high), best = problem.scaled_bounds, start
    half = (high - low) / 2
    for _ in range(rounds):
        half, centre = half / 2, problem.scaled(best[None])[0]
        nearby = box_sample(
            np.maximum(centre - half, low), np.minimum(centre + half, high), 256, rng
        )
        candidates = np.concatenate([best[None], problem.unscaled(nearby)])
        best = candidates[
            np.argmin(np.where(problem.excess(candidates) > 0, np.inf, loss(candidates)))
        ]
    return best
