"""A curve as a target: a few components that are responses like any other.

The curves of the runs, on one grid of the measured x, are described by their principal components
over the sets of the design. How far a curve goes along a component's shape is a response of its
run, and the measured curve's is a target. What the measured curve has that no component describes
is one more such shape and target, so that a curve which the model cannot have is a target out of
reach, not one that is met. A component's unit is the curve's: it is the root mean square over x by
which the curve moves along that shape.

The points of a curve are no measurements of their own. Those of one replicate scatter together, as
those of simulated replicates do, and they share the scale and the origin of the photograph or the
clock: from both follows the covariance of the points, and from that the error of each component.
Inside the plane of the principal components the shapes are turned so that their errors are
uncorrelated, as everything else here takes the errors of targets to be.

After Higdon et al., J. Am. Stat. Assoc. 103 (2008) 570, and for functional data Ramsay & Silverman,
Functional Data Analysis, 2nd ed. 2005, chapter 8.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2 as chi_squared

from calibrator.case.curve import MeasuredCurve
from calibrator.case.problem import Target
from calibrator.case.vocabulary import DIFFERENCE, MOST_COMPONENTS, OPEN_ENDED
from calibrator.errors import CalibratorError
from calibrator.responses.interpolant import average_replicates, grouped

GRID = 51
"""Evenly spaced values of x between the first and the last measured one."""
LEFT_OUT = 0.5
"""What components may leave out of the sets' curves, in standard errors of the measured one."""
BY_CHANCE = 0.99
"""Quantile of what seed noise alone makes of a component, beyond which it says something."""
BEYOND = 0.05
"""Of the measured range of x, that simulated curves may fall short of it where a wall ends them."""


@dataclass(frozen=True, eq=False)
class Components:
    """The components of one curve.

    Attributes
    ----------
    curve : the target that is the curve; targets : the K that stand for it.
    grid : (q,) values of x; value, error : (q,) measured there, and its standard error.
    shapes : (K, q), each of root mean square 1 over x, and orthogonal to the others.
    left_out : root mean square of what the sets' curves have beside these shapes.
    """

    curve: Target
    targets: tuple[Target, ...]
    grid: np.ndarray
    value: np.ndarray
    error: np.ndarray
    shapes: np.ndarray
    left_out: float

    def of(self, curve: np.ndarray) -> dict[str, float]:
        """The responses, by name, of a simulated curve (2, n)."""
        found = self.shapes @ self.on_grid(curve) / len(self.grid)
        return {t.response: float(one) for t, one in zip(self.targets, found, strict=True)}

    def on_grid(self, curve: np.ndarray) -> np.ndarray:
        """Values (q,) of a curve (2, n) at the grid; beyond its ends those at the ends."""
        return np.asarray(np.interp(self.grid, *curve))


def components(target: Target, points: np.ndarray, curves: Sequence[np.ndarray]) -> Components:
    """The components of a curve, from runs at points (n, d), each with its curve (2, m).

    Runs at the same point are replicates; without any the points' errors are taken as independent
    of each other. Raises CalibratorError where the simulated curves end well before the measured
    one does.
    """
    measured = target.curve
    assert measured is not None
    _require_covered(target, measured, curves)
    grid = np.linspace(measured.x[0], measured.x[-1], GRID)
    rows = np.array([np.interp(grid, *curve) for curve in curves])
    sets, means, counts = average_replicates(points, rows)
    left = rows - means[grouped(points, rows, np.ones(len(rows)))[0]]
    noise = left.T @ left / max(len(rows) - len(means), 1)
    errors = _covariance(measured, target.replicates, grid, noise)
    error = _root_mean(errors) or target.tolerance * measured.span / 2
    if not error:
        raise CalibratorError(
            f"target {target.key} has neither scatter nor tolerance: give at least one of them"
        )
    of_a_set = noise * np.mean(1 / counts[:, 0])
    shapes, left_out = _principal(sets, means, of_a_set, LEFT_OUT * error)
    shapes = _uncorrelated(shapes, errors if errors.any() else noise)
    value = np.interp(grid, measured.x, measured.value)
    variances = np.einsum("ij,jk,ik->i", shapes, errors, shapes) / GRID**2
    names = [str(i + 1) for i in range(len(shapes))]
    beside = _beside(shapes, value - means.mean(axis=0))
    if np.sqrt(np.mean(beside**2)) > 1e-9 * measured.span:
        shapes = np.vstack([shapes, beside / np.sqrt(np.mean(beside**2))])
        others = _beside(shapes[:-1], _beside(shapes[:-1], errors).T)
        more = left_out**2 + np.trace(noise) / GRID / counts[:, 0].sum()
        variances = np.append(variances, np.trace(others) / GRID + bool(errors.any()) * more)
        names.append(DIFFERENCE)
    found = zip(names, shapes @ value / GRID, np.sqrt(variances), strict=True)
    targets = tuple(_target(target, name, v, e, len(names)) for name, v, e in found)
    spread = np.sqrt(np.diag(errors))
    return Components(target, targets, grid, value, spread, shapes, left_out)


def _target(curve: Target, name: str, value: float, error: float, count: int) -> Target:
    """The target that stands for one of so many components.

    Where all are within their tolerances the curves differ by no more than the curve's tolerance,
    in the root mean square over x; and their share of O1 is no more than that difference, and no
    less than it over the root of their number.
    """
    assert curve.curve is not None
    return dataclasses.replace(
        curve,
        response=f"{curve.response}_{name}",
        value=float(value),
        scatter=float(error) * curve.replicates**0.5,
        weight=curve.weight / count**0.5,
        tolerance=curve.tolerance / count**0.5,
        size=curve.curve.span,
        curve=None,
    )


def _require_covered(target: Target, measured: MeasuredCurve, curves: Sequence[np.ndarray]) -> None:
    """Raise CalibratorError where walls end the simulated curves before the measured one."""
    if (target.response, target.setup) in OPEN_ENDED:
        return
    low, high = (float(np.median([c[0, end] for c in curves])) for end in (0, -1))
    room = BEYOND * (measured.x[-1] - measured.x[0])
    if measured.x[0] < low - room or measured.x[-1] > high + room:
        raise CalibratorError(
            f"{target.key} is measured from x = {measured.x[0]:g} to {measured.x[-1]:g}, and"
            f" simulated from {low:g} to {high:g}: cut the measured curve, or correct its unit or"
            " the vessel"
        )


def _covariance(
    measured: MeasuredCurve, replicates: int, grid: np.ndarray, noise: np.ndarray
) -> np.ndarray:
    """Covariance (q, q) of the errors of a measured curve at the grid (q,).

    noise : covariance (q, q) of simulated replicates, whose correlation is that of the measured
    ones as well.
    """
    scatter = np.interp(grid, measured.x, measured.scatter)
    spread = np.sqrt(np.diag(noise))
    moving = np.divide(1.0, spread, out=np.zeros_like(spread), where=spread > 0)
    alike = moving[:, None] * noise * moving
    np.fill_diagonal(alike, 1.0)
    value = np.interp(grid, measured.x, measured.value)
    shared = np.array(
        [
            measured.scale_error * value,
            np.full(GRID, measured.offset_error),
            measured.shift_error * np.gradient(value, grid),
        ]
    )
    return np.asarray(scatter[:, None] * alike * scatter / replicates + shared.T @ shared)


def _principal(
    points: np.ndarray, means: np.ndarray, noise: np.ndarray, leave: float
) -> tuple[np.ndarray, float]:
    """Principal shapes (k, q) of the mean curves (p, q) of sets (p, d), and what they leave out.

    They are the fewest that leave no more than `leave` of the sets' variation in the root mean
    square, of those that say more than seed noise does; the first one in any case, where there are
    several sets. noise : covariance (q, q) of a set's mean, which is taken off the variation.
    """
    sets, size = means.shape
    if sets < 2:
        return np.empty((0, size)), 0.0
    along, stretch, shapes = np.linalg.svd(means - means.mean(axis=0), full_matrices=False)
    shapes = shapes * size**0.5
    seeds = np.einsum("ij,jk,ik->i", shapes, noise, shapes) / size**2
    own = np.maximum(stretch**2 / (sets * size) - seeds, 0.0)
    enough = np.sqrt(own[::-1].cumsum()[::-1]) > leave
    kept = enough & _telling(points, along * stretch / size**0.5, seeds)
    kept[0], kept[MOST_COMPONENTS:] = True, False
    return shapes[kept], float(np.sqrt(own[~kept].sum()))


def _telling(points: np.ndarray, found: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """Which components (r,) follow the parameters of the sets (p, d) beyond what seeds explain.

    found : (p, r) of each set; seeds : variance (r,) that the seed noise of a set's mean gives it.
    A plane through the sets explains more than noise would in all but one of a hundred cases.
    """
    varied = points[:, np.isfinite(points).all(axis=0)]
    slopes = np.linalg.qr(varied - varied.mean(axis=0))[0]
    explained = ((slopes.T @ found) ** 2).sum(axis=0)
    return np.asarray(explained > chi_squared.ppf(BY_CHANCE, slopes.shape[1]) * seeds)


def _uncorrelated(shapes: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Shapes (k, q) of the same plane along which errors of this covariance are uncorrelated.

    The largest error comes first; each shape is positive where it is largest.
    """
    if not len(shapes):
        return shapes
    turned = np.linalg.eigh(shapes @ covariance @ shapes.T)[1].T[::-1] @ shapes
    largest = np.take_along_axis(turned, np.abs(turned).argmax(axis=1)[:, None], axis=1)
    return np.asarray(turned * np.sign(largest))


def _beside(shapes: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """What rows (..., q) have beside the shapes (k, q)."""
    return np.asarray(rows - rows @ shapes.T @ shapes / shapes.shape[1])


def _root_mean(covariance: np.ndarray) -> float:
    """Root mean square error over the points of a covariance (q, q)."""
    return float(np.sqrt(np.mean(np.diag(covariance))))
