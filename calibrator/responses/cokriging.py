"""Gaussian processes of dear runs that lean on those of cheap runs: linear co-kriging.

Kennedy & O'Hagan, Biometrika 87 (2000) 1: dear(x) = rho cheap(x) + delta(x). The cheap response is
the Gaussian process that the calibrator fits to any runs, given the cheap ones; the discrepancy is
an independent process of the same family, with a mean that is not known, a trend and a smooth part.
Given the cheap runs, the dear response is again a Gaussian process, of mean rho m(x) and covariance
rho^2 C(x, x') + delta(x, x'), m and C those of the cheap one. Conditioned on the dear runs this is
the joint normal distribution of all runs, seed noise of both kinds included (see `dear_process`).

Arrays in, arrays out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.errors import CalibratorError
from calibrator.responses.box import inside
from calibrator.responses.dear_process import Alone, DearProcess, Link
from calibrator.responses.gaussian_process import CHUNK, GaussianProcess, fit_process
from calibrator.responses.interpolant import (
    FEWEST_DEGREES,
    Learnt,
    TrainingRuns,
    checked_runs,
)
from calibrator.threads import on_one_thread

# Difference of logarithms from which dear runs are said to be better predicted without cheap ones.
BETTER = 2.0


@dataclass(frozen=True, eq=False)
class CheapRuns:
    """Cheap runs of the same responses: points (n, d), values (n, m), replicates repeated."""

    points: np.ndarray
    values: np.ndarray

    def of(self, columns: Sequence[int], seen: Sequence[int]) -> CheapRuns:
        """Some responses, over some parameters, of the runs that have any of them."""
        rows = np.isfinite(self.values[:, columns]).any(axis=1)
        return CheapRuns(self.points[np.ix_(rows, seen)], self.values[np.ix_(rows, columns)])


@dataclass(frozen=True, eq=False)
class CoKriged:
    """Dear responses given dear and cheap runs; it offers what the `Interpolant` protocol asks for.

    Attributes
    ----------
    responses, points, values, noise, noise_sources : of the dear runs, as those of
        `GaussianProcess`.
    cheap : the processes of the cheap runs, on the same box.
    """

    responses: list[str]
    points: np.ndarray
    values: np.ndarray
    noise: np.ndarray
    noise_sources: tuple[str, ...]
    cheap: GaussianProcess
    _dear: tuple[DearProcess | Alone, ...]

    @classmethod
    @on_one_thread
    def fit(
        cls,
        points: np.ndarray,
        values: np.ndarray,
        names: Sequence[str],
        bounds: np.ndarray,
        cheap: CheapRuns,
        noise: np.ndarray | None = None,
        *,
        parameters: Sequence[str] | None = None,
        learnt: Learnt | None = None,
    ) -> CoKriged:
        """Processes of the dear responses.

        Parameters
        ----------
        points, values, names, bounds, noise, parameters : of dear runs, as for `GaussianProcess`
        cheap : runs of the same box and responses
        learnt : what an earlier fit of the same runs found

        Raises
        ------
        CalibratorError : as `GaussianProcess.fit` does for the cheap runs; a response has fewer
            than FEWEST distinct dear points
        """
        noise = noise if learnt is None else learnt.noise
        runs = checked_runs(points, values, names, noise, None, parameters, FEWEST_DEGREES)
        bounds = np.asarray(bounds, float)
        inside(runs.points, bounds[0], bounds[1], runs.parameters)
        known = None if learnt is None else Learnt(learnt.kernels[:, :-3], learnt.kernels[:, -3])
        try:
            below = GaussianProcess.fit(
                cheap.points, cheap.values, names, bounds, parameters=parameters, learnt=known
            )
        except CalibratorError as error:
            raise CalibratorError(f"the cheap runs of [fidelity]: {error}") from None
        dear = tuple(
            _best(runs, i, below) if learnt is None else _known(runs, i, below, learnt.kernels[i])
            for i in range(len(names))
        )
        return cls(
            runs.responses,
            runs.points,
            runs.values,
            np.array([one.noise for one in dear]),
            runs.noise_sources,
            below,
            dear,
        )

    @property
    def links(self) -> tuple[Link, ...]:
        """How each response hangs on its cheap one."""
        return tuple(one.link for one in self._dear)

    @property
    def trend(self) -> np.ndarray:
        """Degrees of freedom (m,) that the trend takes from the dear points.

        None where they lean on the cheap ones, which hold the trend.
        """
        alone = np.array([isinstance(one, Alone) for one in self._dear])
        return np.where(alone, self.points.shape[1], 0)

    @property
    def learnt(self) -> Learnt:
        """Hyperparameters of the processes, noise of the cheap runs, rho and size, (m, d + 4).

        The processes are the cheap ones, and where rho is 0 those of the dear runs alone.
        """
        own = [
            [*one.process.regressor.kernel_.theta, noise, one.link.rho, one.link.size]
            for one, noise in zip(self._dear, self.cheap.noise, strict=True)
        ]
        return Learnt(np.array(own), self.noise)

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Mean responses (k, m) at points (k, d); CalibratorError outside the bounds."""
        return self.predict_with_error(points)[0]

    def predict_with_error(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean responses and the standard deviation of that mean, both (k, m).

        The seed noise of a new run is not included. Raises CalibratorError outside the bounds.
        """
        return self._in_chunks("mean_and_error", points)

    def told(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """By how much one more run at a point lowers the variance of the dear mean there.

        Both (k, m), of a cheap run and of a dear one, in squares of the response's unit.
        """
        return self._in_chunks("told", points)

    @on_one_thread
    def _in_chunks(self, what: str, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Two columns (k, 2) of each response, as two arrays (k, m)."""
        unit = self.cheap.unit(points)
        parts = range(0, max(1, len(unit)), CHUNK)
        found = [
            np.concatenate([getattr(one, what)(unit[i : i + CHUNK]) for i in parts])
            for one in self._dear
        ]
        both = np.stack(found, axis=1)
        return both[..., 0], both[..., 1]

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Each distinct dear point predicted from the other runs, cheap ones at it included.

        The prediction and the scatter that is expected of it, both (p, m), as
        `GaussianProcess.leave_one_out` does.
        """
        predictions, std = np.full((2, *self.values.shape), np.nan)
        for column, one in enumerate(self._dear):
            predictions[one.rows, column], std[one.rows, column] = one.leave_one_out()
        return predictions, std


def _best(runs: TrainingRuns, column: int, below: GaussianProcess) -> DearProcess | Alone:
    """The process that leans on the cheap runs, or the one without, whichever predicts better.

    What is compared is how probable each dear point is as the other runs predict it; with as few
    dear points as a process alone cannot be fitted to, there is nothing to compare.
    """
    leant = DearProcess.of(runs, column, below, None)
    points = len(leant.rows)
    if points < below.bounds.shape[1] + 2:
        return leant
    alone = Alone(fit_process(runs, column, below.bounds))
    own = runs.values[leant.rows, column]
    return alone if _probability(alone, own) > _probability(leant, own) + BETTER else leant


def _known(
    runs: TrainingRuns, column: int, below: GaussianProcess, kernel: np.ndarray
) -> DearProcess | Alone:
    """The process that an earlier fit found; kernel : its row of `CoKriged.learnt`."""
    *theta, _, rho, size = kernel.tolist()
    if rho == 0:
        return Alone(fit_process(runs, column, below.bounds, theta=np.array(theta)))
    return DearProcess.of(runs, column, below, Link(rho, size))


def _probability(process: DearProcess | Alone, values: np.ndarray) -> float:
    """Logarithm of how probable values (n,) are, each predicted without itself."""
    mean, error = process.leave_one_out()
    return float(-((((values - mean) / error) ** 2) / 2 + np.log(error)).sum())
