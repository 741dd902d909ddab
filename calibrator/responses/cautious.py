"""An interpolant that claims no more than left-out runs bear out, and nothing impossible."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from calibrator.case.vocabulary import QUANTITIES
from calibrator.responses.interpolant import Around, Interpolant, known_noise

# A grid point without its own lines is predicted over twice the spacing, where straight lines are
# four times as far from a smooth response. Half of that error, not a quarter, because points at the
# faces lack the error along one axis or more, and because bends are worse in some places.
OF_TWICE_THE_SPACING = 0.5

# Of the rise between the only two values of a parameter, about which no run says how it bends. A
# square or a root on [0, 1] is a quarter of its rise away from its line in the middle.
BETWEEN_TWO = 0.1


@dataclass(frozen=True, eq=False)
class Cautious(Around):
    """Honest errors and physical means around an interpolant; it offers all that one does.

    The standard deviation that a process claims is the one of its own model. Each distinct point
    predicted without itself says whether it is borne out: where the scaled errors scatter by more
    than one, all deviations are multiplied by that (as a Birge ratio does, Phys. Rev. 40 (1932)
    207). They are widened from the normal's to Student's t as well, because the amplitude of a
    process is learnt from the points beyond those that its trend takes.

    Straight lines on a grid know their seed noise only; the error of leaving points out is added in
    quadrature. Means are clipped to what the vocabulary says is possible: no rate below zero, no
    angle of repose beyond 90 degrees.

    Attributes
    ----------
    inner : the interpolant.
    """

    inner: Interpolant

    @classmethod
    def of(cls, inner: Interpolant) -> Cautious:
        """The cautious one; an interpolant that is so already stays as it is."""
        return inner if isinstance(inner, cls) else cls(inner)

    @property
    def points(self) -> np.ndarray:
        """Distinct points (p, d)."""
        return self.inner.points

    @property
    def values(self) -> np.ndarray:
        """Mean responses (p, m) there."""
        return self.inner.values

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Mean responses (k, m) at points (k, d); CalibratorError outside the box."""
        return self._possible(self.inner.predict(points))

    def predict_with_error(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean responses and their standard deviations, both (k, m).

        Raises CalibratorError outside the box.
        """
        mean, error = self.inner.predict_with_error(points)
        factor, bend = self._lessons
        return self._possible(mean), np.hypot(error * factor, bend)

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Prediction of each distinct point without it, and the scatter that was claimed for it."""
        return self._left_out

    @functools.cached_property
    def _left_out(self) -> tuple[np.ndarray, np.ndarray]:
        return self.inner.leave_one_out()

    @functools.cached_property
    def _lessons(self) -> tuple[np.ndarray, np.ndarray]:
        """Factor (m,) on the deviations, and the deviation (m,) that lines have beside them."""
        predicted, claimed = self._left_out
        off, m = predicted - self.values, len(self.responses)
        if "none" not in self.noise_sources and self.learnt.kernels.shape[1]:
            degrees = np.isfinite(off).sum(axis=0) - self.trend
            few = student.ppf(0.975, np.maximum(degrees, 2)) / 1.96
            return few * np.maximum(1.0, _root_mean_square(off / claimed)), np.zeros(m)
        known = np.isfinite(known_noise(self))
        beyond = np.sqrt(np.maximum(_mean(off**2) - np.where(known, _mean(claimed**2), 0), 0))
        # without a known noise the same errors hold the seed noise as well, and count in full
        bend = beyond * np.where(known, OF_TWICE_THE_SPACING, 1.0)
        return np.ones(m), np.hypot(bend, BETWEEN_TWO * _rise_between_two(self.inner))

    def _possible(self, mean: np.ndarray) -> np.ndarray:
        low, high = possible(self.responses)
        return np.asarray(np.clip(mean, low, high))


def possible(keys: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest value (m,) that responses can have; keys : m, setup.response.

    >>> [ends.tolist() for ends in possible(["ledge.residual_fraction", "ledge.bulk_density"])]
    [[0.0, 0.0], [1.0, inf]]
    """
    quantities = [QUANTITIES[key.split(".")[1]] for key in keys]
    low = [-np.inf if q.low is None else q.low for q in quantities]
    high = [np.inf if q.high is None else q.high for q in quantities]
    return np.array(low), np.array(high)


def _rise_between_two(grid: Interpolant) -> np.ndarray:
    """Root mean square rise (m,) along the axes of a grid that have two values only."""
    squares = np.zeros(len(grid.responses))
    for column in grid.points.T:
        ends = np.unique(column)
        if len(ends) == 2:  # points are in lexical order, so the two halves are in the same
            low, high = (grid.values[column == end] for end in ends)
            squares += _mean((high - low) ** 2)
    return np.sqrt(squares)


def _mean(columns: np.ndarray) -> np.ndarray:
    """Mean (m,) of what is finite in each column (p, m); 0 where nothing is."""
    there = np.isfinite(columns)
    sums = np.where(there, columns, 0).sum(axis=0)
    return np.asarray(sums / np.maximum(there.sum(axis=0), 1))


def _root_mean_square(columns: np.ndarray) -> np.ndarray:
    """Root mean square (m,) of what is finite in each column (p, m)."""
    return np.asarray(np.sqrt(_mean(columns**2)))
