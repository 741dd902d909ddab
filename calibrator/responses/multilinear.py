"""Multilinear interpolation on a full grid of runs, the reference paper's choice.

Arrays in, arrays out.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from calibrator.errors import CalibratorError
from calibrator.responses.box import inside
from calibrator.responses.interpolant import (
    FEWEST_DEGREES,
    Learnt,
    TrainingRuns,
    checked_runs,
    common_source,
)


@dataclass(frozen=True, eq=False)
class Multilinear:
    """Multilinear interpolation on a full grid, the paper's choice.

    It is scipy's RegularGridInterpolator. Its error estimate knows the seed noise only, not the
    error of straight lines between curved samples; `leave_one_out` measures the latter.

    Attributes
    ----------
    responses : keys of the m responses
    parameters : names of the d parameters
    points : (p, d) distinct grid points
    values : (p, m) mean responses
    counts : (p, m) runs behind each mean
    noise : (m,) seed noise of a single run; NaN where noise_sources says "none"
    noise_sources : (m,) "given", "replicates" or "none" (too few replicates)
    axes : d ascending sample arrays
    """

    responses: list[str]
    parameters: list[str]
    points: np.ndarray
    values: np.ndarray
    counts: np.ndarray
    noise: np.ndarray
    noise_sources: tuple[str, ...]
    axes: tuple[np.ndarray, ...]
    _interpolator: RegularGridInterpolator

    @classmethod
    def fit(
        cls,
        points: np.ndarray,
        values: np.ndarray,
        names: Sequence[str],
        noise: np.ndarray | None = None,
        counts: np.ndarray | None = None,
        *,
        parameters: Sequence[str] | None = None,
    ) -> Multilinear:
        """Interpolant through the mean response of each grid point.

        Parameters
        ----------
        points : (n, d) grid points, replicates repeated
        values : (n, m) responses
        names : m response keys
        noise : (m,) known seed noise; where None pooled from replicates, if those give
            FEWEST_DEGREES degrees of freedom
        counts : (n,) runs that each row averages, with noise only
        parameters : d names for messages

        Raises
        ------
        CalibratorError : the points are not a full grid of two or more samples per axis, or a
            response is missing
        """
        runs = checked_runs(points, values, names, noise, counts, parameters, FEWEST_DEGREES)
        axes = tuple(np.unique(column) for column in runs.points.T)
        _require_full_grid(runs, axes)
        shape = (*(len(axis) for axis in axes), len(names))
        interpolator = RegularGridInterpolator(axes, runs.values.reshape(shape))
        sources = tuple(
            "none" if source == "estimated" else source for source in runs.noise_sources
        )
        return cls(
            runs.responses,
            runs.parameters,
            runs.points,
            runs.values,
            runs.counts,
            runs.noise,
            sources,
            axes,
            interpolator,
        )

    @property
    def noise_source(self) -> str:
        """Origin of the seed noise where it is the same for all responses, else "mixed"."""
        return common_source(self.noise_sources)

    @property
    def trend(self) -> np.ndarray:
        """Degrees of freedom (m,) that a trend takes: there is none."""
        return np.zeros(len(self.responses), int)

    @property
    def learnt(self) -> Learnt:
        """Nothing but the seed noise."""
        return Learnt(np.empty((len(self.responses), 0)), self.noise)

    @property
    def _low(self) -> np.ndarray:
        """First sample (d,) of each axis."""
        return np.array([axis[0] for axis in self.axes])

    @property
    def _high(self) -> np.ndarray:
        """Last sample (d,) of each axis."""
        return np.array([axis[-1] for axis in self.axes])

    @property
    def _variance(self) -> np.ndarray:
        """Variance of the mean response at each grid point, (p, m); 0 where it is not known."""
        return np.asarray(np.nan_to_num(self.noise) ** 2 / self.counts)

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Mean responses (k, m) at points (k, d); CalibratorError outside the grid."""
        points = inside(points, self._low, self._high, self.parameters)
        return np.asarray(self._interpolator(points))

    def predict_with_error(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean responses and their standard deviation, both (k, m).

        The latter is due to the seed noise of the surrounding grid points only. Raises
        CalibratorError outside the grid.
        """
        points = inside(points, self._low, self._high, self.parameters)
        variance = np.zeros((len(points), len(self.responses)))
        for rows, weights in _surrounding(points, self.axes):
            variance += weights[:, None] ** 2 * self._variance[rows]
        return self.predict(points), np.sqrt(variance)

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Each grid point predicted from the grid without any line through it, both (p, m).

        Along every axis on which the point is not at an end, its own line is dropped, so the
        prediction uses the neighbours one step away: the test of a grid with twice the spacing,
        whose error is about four times that of the grid itself where the response is smooth. Points
        at an end of every axis have no such prediction: NaN.

        The standard deviation is that of measured mean minus prediction due to seed noise alone.
        """
        shape = (*(len(axis) for axis in self.axes), -1)
        predictions = _without_own_lines(self.values.reshape(shape), self.axes, 1).reshape(
            self.values.shape
        )
        variance = self._variance + _without_own_lines(
            self._variance.reshape(shape), self.axes, 2
        ).reshape(self.values.shape)
        corner = ((self.points == self._low) | (self.points == self._high)).all(axis=1)
        predictions[corner], variance[corner] = np.nan, np.nan
        return predictions, np.sqrt(variance)


def _require_full_grid(runs: TrainingRuns, axes: Sequence[np.ndarray]) -> None:
    """Raise CalibratorError for a single value on an axis, a hole, or a missing response."""
    for name, axis in zip(runs.parameters, axes, strict=True):
        if len(axis) < 2:
            raise CalibratorError(
                f"{name} has the single value {axis[0]:g} in all runs: fix it, or sample two values"
                " or more"
            )
    missing = math.prod(len(axis) for axis in axes) - len(runs.points)
    if missing:
        present = set(map(tuple, runs.points))
        holes = (corner for corner in itertools.product(*axes) if corner not in present)
        raise CalibratorError(
            f"the runs are not a full grid, {missing} of {missing + len(runs.points)} points are"
            f" missing, e.g. {_spelled(runs.parameters, itertools.islice(holes, 2))}: run them, or"
            " interpolate with a Gaussian process"
        )
    unmeasured = np.argwhere(np.isnan(runs.values))
    if len(unmeasured):
        row, column = unmeasured[0]
        raise CalibratorError(
            f"{runs.responses[column]} was not measured at {len(unmeasured)} grid point(s), e.g."
            f" {_spelled(runs.parameters, [runs.points[row]])}: run them again, or interpolate with"
            " a Gaussian process"
        )


def _spelled(parameters: Sequence[str], points: Iterator[Any] | list[Any]) -> str:
    """Points in words, such as (a = 1, b = 2) and (a = 3, b = 4)."""
    return " and ".join(
        "(" + ", ".join(f"{n} = {v:g}" for n, v in zip(parameters, p, strict=True)) + ")"
        for p in points
    )


def _surrounding(
    points: np.ndarray, axes: Sequence[np.ndarray]
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Flat grid index (k,) and multilinear weight (k,) of each corner of the cells around points.

    There are 2^d corners; points : (k, d).
    """
    cells = [
        np.searchsorted(axis[1:-1], x, side="right") for axis, x in zip(axes, points.T, strict=True)
    ]
    parts = [
        (x - axis[c]) / (axis[c + 1] - axis[c])
        for axis, x, c in zip(axes, points.T, cells, strict=True)
    ]
    shape = [len(axis) for axis in axes]
    for corner in itertools.product((0, 1), repeat=len(axes)):
        rows = np.ravel_multi_index(
            [c + step for c, step in zip(cells, corner, strict=True)], shape
        )
        yield (
            rows,
            np.prod(
                [part if step else 1 - part for part, step in zip(parts, corner, strict=True)],
                axis=0,
            ),
        )


def _without_own_lines(grid: np.ndarray, axes: Sequence[np.ndarray], power: int) -> np.ndarray:
    """The grid with every interior line interpolated between its neighbours, axis after axis.

    The product over the axes is the multilinear interpolation in the cell of twice the size. power
    1 interpolates values, 2 propagates variances (squared weights).
    """
    for i, axis in enumerate(axes):
        lines = np.moveaxis(grid, i, 0)
        share = ((axis[1:-1] - axis[:-2]) / (axis[2:] - axis[:-2])).reshape(
            -1, *[1] * (grid.ndim - 1)
        )
        inner = lines[:-2] * (1 - share) ** power + lines[2:] * share**power
        grid = np.moveaxis(np.concatenate([lines[:1], inner, lines[-1:]]), 0, i)
    return grid
