"""Least squares in the unit box: many descents at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

STEP = 1e-4  # of the range: forward difference of the residuals
ROUNDS = 12  # of the descent; it converges quadratically near the minimum

Residuals = Callable[[np.ndarray], np.ndarray]
"""From points (n, d) of the unit box to normalised residuals (n, t)."""


@dataclass(frozen=True, eq=False)
class Points:
    """Points of the unit box, units (n, d), with their chi2 (n,)."""

    units: np.ndarray
    chi2: np.ndarray

    @property
    def best(self) -> Points:
        """The point of smallest chi2 alone."""
        index = int(np.argmin(self.chi2))
        return Points(self.units[index : index + 1], self.chi2[index : index + 1])


def joined(*several: Points) -> Points:
    """All points, in order."""
    return Points(
        np.concatenate([p.units for p in several]), np.concatenate([p.chi2 for p in several])
    )


def descended(residuals: Residuals, starts: np.ndarray, fixed: np.ndarray) -> Points:
    """Levenberg-Marquardt descent of all starts (b, d) at once inside the unit box.

    fixed : (b, d), which coordinates are held.
    """
    units, found, damping = starts, residuals(starts), np.full(len(starts), 1e-3)
    for _ in range(ROUNDS):
        trial = np.clip(units + _step(residuals, units, found, damping, fixed), 0, 1)
        tried = residuals(trial)
        better = (tried**2).sum(axis=1) < (found**2).sum(axis=1)
        units = np.where(better[:, None], trial, units)
        found = np.where(better[:, None], tried, found)
        damping = np.where(better, damping / 10, damping * 10)
    return Points(units, (found**2).sum(axis=1))


def _step(
    residuals: Residuals,
    units: np.ndarray,
    found: np.ndarray,
    damping: np.ndarray,
    fixed: np.ndarray,
) -> np.ndarray:
    """Damped Gauss-Newton steps (b, d).

    A coordinate at the wall that would leave the box is held for this step.
    """
    jacobian = _jacobian(residuals, units, found)
    gradient = np.einsum("btd,bt->bd", jacobian, found)
    held = fixed | ((units <= 0) & (gradient > 0)) | ((units >= 1) & (gradient < 0))
    jacobian, gradient = np.where(held[:, None, :], 0, jacobian), np.where(held, 0, gradient)
    curvature = np.einsum("btd,bte->bde", jacobian, jacobian)
    ridge = damping * (np.trace(curvature, axis1=1, axis2=2) + 1e-12)
    return -np.linalg.solve(
        curvature + ridge[:, None, None] * np.eye(units.shape[1]), gradient[..., None]
    )[..., 0]


def _jacobian(residuals: Residuals, units: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Forward differences (b, t, d), taken towards the inside of the box."""
    count, dimensions = units.shape
    steps = np.where(units < 0.5, STEP, -STEP)
    moved = units[:, None, :] + steps[:, None, :] * np.eye(dimensions)
    differences = (
        residuals(moved.reshape(-1, dimensions)).reshape(count, dimensions, -1) - found[:, None, :]
    )
    return np.swapaxes(differences / steps[..., None], 1, 2)
