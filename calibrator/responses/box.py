"""Points of the box of parameters: filling it, staying inside it, refining a place in it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.stats import qmc

from calibrator.case.problem import Problem
from calibrator.errors import CalibratorError


def box_sample(
    low: np.ndarray, high: np.ndarray, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Scrambled Sobol points that fill the box low (d,) to high (d,); count is rounded up to a
    power of two: (n, d).
    """
    unit = qmc.Sobol(len(low), scramble=True, seed=rng).random_base2(
        max(0, math.ceil(math.log2(count)))
    )
    return np.clip(low + (high - low) * unit, low, high)


def inside(
    points: np.ndarray, low: np.ndarray, high: np.ndarray, parameters: Sequence[str]
) -> np.ndarray:
    """Points (k, d) clipped by no more than rounding;

    CalibratorError if one lies outside low (d,) to high (d,).
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
    return np.clip(points, low, high)


MOST_CORNERS = 10  # dimensions up to which all corners of the box are tried


def corners(problem: Problem) -> np.ndarray:
    if len(problem.parameters) > MOST_CORNERS:
        return np.empty((0, len(problem.parameters)))
    return np.array(list(itertools.product(*zip(problem.low, problem.high, strict=True))))


def refined(
    loss: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    problem: Problem,
    rng: np.random.Generator,
    rounds: int = 10,
) -> np.ndarray:
    """Point (d,) of smallest loss found in boxes around the best so far, each half the size of the
    one before.
    """
    best, half = start, (problem.high - problem.low) / 2
    for _ in range(rounds):
        half = half / 2
        nearby = box_sample(
            np.maximum(best - half, problem.low), np.minimum(best + half, problem.high), 256, rng
        )
        candidates = np.concatenate([best[None], nearby])
        best = candidates[np.argmin(loss(candidates))]
    return best
