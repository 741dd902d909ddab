"""Interpolants of responses in whose experiments different parameters vary, side by side.

A ledge has no neck, and dried sand no moisture: their responses are functions of fewer parameters
than those of a moist hourglass, and are interpolated over those alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calibrator.case.problem import Problem
from calibrator.responses.interpolant import Interpolant, Learnt


@dataclass(frozen=True, eq=False)
class Part:
    """Responses that see the same parameters.

    seen : columns of these among the problem's parameters; columns : of the responses among all;
    inner : their interpolant, over the seen parameters.
    """

    seen: list[int]
    columns: list[int]
    inner: Interpolant


@dataclass(frozen=True, eq=False)
class Parted:
    """Several interpolants as one, which offers what the `Interpolant` protocol asks for.

    responses : m keys; parts : cover them all.
    """

    problem: Problem
    responses: list[str]
    parts: tuple[Part, ...]

    @property
    def points(self) -> np.ndarray:
        """Distinct points (p, d) of each part in turn; NaN where a part sees no such parameter."""
        rows = []
        for part in self.parts:
            points = np.full((len(part.inner.points), len(self.problem.names)), np.nan)
            points[:, part.seen] = part.inner.points
            rows.append(points)
        return np.concatenate(rows)

    @property
    def values(self) -> np.ndarray:
        """Mean responses (p, m) at the distinct points; NaN where not measured."""
        return self._blocks(lambda inner: inner.values)

    @property
    def noise(self) -> np.ndarray:
        """Seed noise (m,) of a single run."""
        noise = np.empty(len(self.responses))
        for part in self.parts:
            noise[part.columns] = part.inner.noise
        return noise

    @property
    def trend(self) -> np.ndarray:
        """Degrees of freedom (m,) that the trend takes."""
        found = np.zeros(len(self.responses), int)
        for part in self.parts:
            found[part.columns] = part.inner.trend
        return found

    @property
    def noise_sources(self) -> tuple[str, ...]:
        """Where the seed noise of each response (m,) is from."""
        sources = dict[int, str]()
        for part in self.parts:
            sources.update(zip(part.columns, part.inner.noise_sources, strict=True))
        return tuple(sources[column] for column in range(len(self.responses)))

    @property
    def learnt(self) -> Learnt:
        """What the parts have learnt, NaN behind the kernels that are shorter than others."""
        found = [part.inner.learnt for part in self.parts]
        longest = max(one.kernels.shape[1] for one in found)
        kernels = np.full((len(self.responses), longest), np.nan)
        for part, one in zip(self.parts, found, strict=True):
            kernels[np.ix_(part.columns, range(one.kernels.shape[1]))] = one.kernels
        return Learnt(kernels, self.noise)

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Mean responses (k, m) at points (k, d); CalibratorError outside the box."""
        points = np.atleast_2d(points)
        mean = np.empty((len(points), len(self.responses)))
        for part in self.parts:
            mean[:, part.columns] = part.inner.predict(points[:, part.seen])
        return mean

    def predict_with_error(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean responses and their standard deviations, both (k, m).

        Raises CalibratorError outside the box.
        """
        points = np.atleast_2d(points)
        mean, error = np.empty((2, len(points), len(self.responses)))
        for part in self.parts:
            own = part.inner.predict_with_error(points[:, part.seen])
            mean[:, part.columns], error[:, part.columns] = own
        return mean, error

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Each distinct point predicted without it, and its expected scatter, both (p, m)."""
        found = {id(part.inner): part.inner.leave_one_out() for part in self.parts}
        mean = self._blocks(lambda inner: found[id(inner)][0])
        return mean, self._blocks(lambda inner: found[id(inner)][1])

    def _blocks(self, of: Callable[[Interpolant], np.ndarray]) -> np.ndarray:
        """Arrays of the parts in the rows and columns (p, m) that are theirs, NaN elsewhere."""
        rows = []
        for part in self.parts:
            own = of(part.inner)
            block = np.full((len(own), len(self.responses)), np.nan)
            block[:, part.columns] = own
            rows.append(block)
        return np.concatenate(rows)
