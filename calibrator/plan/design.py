"""Designs: which parameter sets the database holds."""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from calibrator.case.problem import Problem


def full_grid(problem: Problem) -> np.ndarray:
    """Every combination of `samples` values per parameter, (n, d): the paper's design.

    Values are equally spaced on the parameter's scale. Sets that the constraints rule out are left
    out.
    """
    axes = [p.values_at(np.linspace(0, 1, p.samples)) for p in problem.parameters]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    return np.asarray(points[problem.excess(points) == 0])


def sobol(problem: Problem, sets: int) -> np.ndarray:
    """The first points (n, d) of the unscrambled Sobol sequence in the box.

    Its degenerate corner is left out, and what the constraints rule out: the sequence goes on until
    enough are allowed. A longer plan starts with the points of a shorter one, so that a database
    can grow without losing a run.
    """
    size = _power_of_two(sets + 1)
    while True:
        with np.errstate(all="ignore"):
            unit = qmc.Sobol(len(problem.parameters), scramble=False).random(size)[1:]
        points = problem.values_at(unit)
        allowed = points[problem.excess(points) == 0][:sets]
        if len(allowed) == sets:
            return np.asarray(allowed)
        size *= 2


def cells(dimensions: int, count: int) -> np.ndarray:
    """Shares (count, dimensions) of an unscrambled Sobol sequence, in the middle of their cells.

    However few they are, each part of one share's range goes with all parts of the others'.
    """
    size = _power_of_two(count)
    return np.asarray(qmc.Sobol(dimensions, scramble=False).random(size)[:count] + 0.5 / size)


def _power_of_two(count: int) -> int:
    """The smallest power of two that is not below count."""
    return 1 << (count - 1).bit_length()
