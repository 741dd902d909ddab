"""Gaussian processes through the runs of any design, with the seed noise they were measured with.

Arrays in, arrays out.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve
from sklearn.gaussian_process import GaussianProcessRegressor

from calibrator.errors import CalibratorError
from calibrator.responses.box import inside
from calibrator.responses.interpolant import (
    FEWEST_DEGREES,
    Learnt,
    TrainingRuns,
    checked_runs,
    common_source,
)
from calibrator.responses.kernel import JITTER, kernel_of, likeliest, likeliest_with_noise
from calibrator.threads import on_one_thread

CHUNK = 4096  # rows predicted at once: keeps the covariance block in the processor's cache

# The search for a kernel takes the cube of the number of points, some hundred times over; more
# points hardly change what it finds (benchmarks/numerics/interpolant.py).
KERNEL_POINTS = 500
MOST_POINTS = 10_000  # a covariance of 0.8 GB, and the process holds a few of its size


@dataclass(frozen=True, eq=False)
class GaussianProcess:
    """One independent Gaussian process per response, for any design of runs.

    Covariance: a constant times a Matern 5/2 kernel with one length scale per parameter, plus a
    linear trend as a dot-product kernel of fixed broad variance (universal kriging). The trend as
    part of the covariance cross-validates better than a least-squares trend with a process on its
    residual, and keeps the leave-one-out predictions in closed form. Length scales and amplitude
    maximise the marginal likelihood times a prior (see `kernel`).

    Attributes
    ----------
    responses : keys of the m responses
    parameters : names of the d parameters
    bounds : (2, d) box of the design
    points : (p, d) distinct points
    values : (p, m) mean responses, NaN where not measured
    counts : (p, m) runs behind each mean
    noise : (m,) seed noise of a single run
    noise_sources : (m,) "given", "replicates" (pooled) or "estimated" (by maximum likelihood, too
        few replicates to pool)
    """

    responses: list[str]
    parameters: list[str]
    bounds: np.ndarray
    points: np.ndarray
    values: np.ndarray
    counts: np.ndarray
    noise: np.ndarray
    noise_sources: tuple[str, ...]
    processes: tuple[Process, ...]

    @classmethod
    @on_one_thread
    def fit(
        cls,
        points: np.ndarray,
        values: np.ndarray,
        names: Sequence[str],
        bounds: np.ndarray,
        noise: np.ndarray | None = None,
        counts: np.ndarray | None = None,
        *,
        parameters: Sequence[str] | None = None,
        restarts: int = 3,
        seed: int = 1,
        learnt: Learnt | None = None,
    ) -> GaussianProcess:
        """Processes through the mean responses, smoothing by the seed noise.

        Beyond KERNEL_POINTS points the search for the kernel sees a random subset of that many.

        Parameters
        ----------
        points : (n, d) parameter sets, replicates repeated
        values : (n, m) responses, NaN where not measured
        names : m response keys
        bounds : (2, d) of the design, which must hold all points
        noise : (m,) known seed noise; where None pooled from replicates, or estimated with the
            kernel where those give less than FEWEST_DEGREES degrees of freedom
        counts : (n,) runs that each row averages, with noise only
        parameters : d names for messages
        restarts, seed : extra starts of the likelihood search, drawn with seed like the subset
        learnt : what an earlier fit of the same runs found, instead of the search and of noise

        Raises
        ------
        CalibratorError : a point lies outside bounds, a response has fewer than d + 2 distinct
            points, or there are more than MOST_POINTS of them
        """
        noise = noise if learnt is None else learnt.noise
        runs = checked_runs(points, values, names, noise, counts, parameters, FEWEST_DEGREES)
        bounds = np.asarray(bounds, float)
        inside(runs.points, bounds[0], bounds[1], runs.parameters)
        kernels = None if learnt is None else learnt.kernels
        processes = tuple(
            fit_process(runs, i, bounds, restarts, seed, None if kernels is None else kernels[i])
            for i in range(len(names))
        )
        return cls._through(runs, bounds, processes)

    @classmethod
    def _through(
        cls, runs: TrainingRuns, bounds: np.ndarray, processes: tuple[Process, ...]
    ) -> GaussianProcess:
        """The processes of all responses, and the runs that they were conditioned on."""
        return cls(
            runs.responses,
            runs.parameters,
            bounds,
            runs.points,
            runs.values,
            runs.counts,
            np.array([process.noise for process in processes]),
            runs.noise_sources,
            processes,
        )

    @property
    def learnt(self) -> Learnt:
        """Logarithms of the kernels' hyperparameters (m, d + 1), and the seed noise."""
        return Learnt(np.array([p.regressor.kernel_.theta for p in self.processes]), self.noise)

    @property
    def trend(self) -> np.ndarray:
        """Degrees of freedom (m,) that the trend takes: a slope for each parameter."""
        return np.full(len(self.responses), self.points.shape[1])

    @property
    def noise_source(self) -> str:
        """Origin of the seed noise where it is the same for all responses, else "mixed"."""
        return common_source(self.noise_sources)

    def unit(self, points: np.ndarray) -> np.ndarray:
        """The points (k, d) in half ranges from the centre; CalibratorError outside the bounds."""
        return _unit(inside(points, self.bounds[0], self.bounds[1], self.parameters), self.bounds)

    @on_one_thread
    def predict(self, points: np.ndarray) -> np.ndarray:
        """Mean responses (k, m) at points (k, d); CalibratorError outside the bounds."""
        unit = self.unit(points)
        return np.column_stack([_chunked(process.mean, unit) for process in self.processes])

    @on_one_thread
    def predict_with_error(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean responses and the standard deviation of that mean, both (k, m).

        The seed noise of a new run is not included. Raises CalibratorError outside the bounds.
        """
        unit = self.unit(points)
        both = np.stack(
            [_chunked(process.mean_and_std, unit) for process in self.processes], axis=1
        )
        return both[..., 0], both[..., 1]

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Each distinct point predicted by the other points with the kernel kept, both (p, m).

        Closed form of Rasmussen & Williams (2006), Eqs. 5.10-5.12. The standard deviation is that
        of measured mean minus prediction, seed noise of that mean included, so (values -
        predictions) / std should scatter by one. NaN where the response was not measured.
        """
        predictions, std = np.full((2, *self.values.shape), np.nan)
        for column, process in enumerate(self.processes):
            predictions[process.rows, column], std[process.rows, column] = process.leave_one_out()
        return predictions, std


@dataclass(frozen=True, eq=False)
class Process:
    """A conditioned process of one response and its training rows.

    It works in standardised units, (value - centre) / scale; noise is in the response's own.
    """

    regressor: GaussianProcessRegressor
    rows: np.ndarray
    centre: float
    scale: float
    noise: float

    def mean(self, unit: np.ndarray) -> np.ndarray:
        """Mean responses (k,) at points (k, d) of the unit box."""
        return np.asarray(self.centre + self.scale * self.regressor.predict(unit))

    def mean_and_std(self, unit: np.ndarray) -> np.ndarray:
        """Mean responses and their standard deviations as two columns (k, 2)."""
        with warnings.catch_warnings():
            # they are rounding at a noiseless training point
            warnings.filterwarnings("ignore", "Predicted variances smaller than 0")
            mean, std = self.regressor.predict(unit, return_std=True)
        return np.column_stack([self.centre + self.scale * mean, self.scale * std])

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Prediction of each row without it, and its expected scatter, both (rows,)."""
        precision = np.diag(cho_solve((self.regressor.L_, True), np.eye(len(self.rows))))
        predictions = self.regressor.y_train_ - self.regressor.alpha_ / precision
        return self.centre + self.scale * predictions, self.scale / np.sqrt(precision)


def _unit(points: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Points scaled to [-1, 1] by the bounds: half ranges from the centre.

    There the trend pivots.
    """
    return np.asarray((2 * points - bounds[0] - bounds[1]) / (bounds[1] - bounds[0]))


def _chunked(function: Callable[[np.ndarray], np.ndarray], rows: np.ndarray) -> np.ndarray:
    """The function of all rows, worked out CHUNK rows at a time."""
    return np.concatenate(
        [function(rows[i : i + CHUNK]) for i in range(0, max(1, len(rows)), CHUNK)]
    )


def fit_process(
    runs: TrainingRuns,
    column: int,
    bounds: np.ndarray,
    restarts: int = 3,
    seed: int = 1,
    theta: np.ndarray | None = None,
) -> Process:
    """The process of one response; theta : its kernel's hyperparameters, where they are known."""
    rows = np.flatnonzero(~np.isnan(runs.values[:, column]))
    require_points(runs.responses[column], len(rows), bounds.shape[1])
    unit, values = _unit(runs.points[rows], bounds), runs.values[rows, column]
    counts = runs.counts[rows, column]
    centre, scale = values.mean(), values.std() or 1.0
    standard, noise = (values - centre) / scale, runs.noise[column] / scale
    if theta is not None:
        kernel = kernel_of(bounds.shape[1]).clone_with_theta(theta)
    elif np.isnan(noise):
        raw = ~np.isnan(runs.raw_values[:, column])
        raw_standard = (runs.raw_values[raw, column] - centre) / scale
        some = _subset(len(raw_standard), seed)
        kernel, noise = likeliest_with_noise(
            _unit(runs.raw_points[raw], bounds)[some], raw_standard[some], restarts, seed
        )
    else:
        some = _subset(len(rows), seed)
        alpha = noise**2 / counts[some] + JITTER
        kernel = likeliest(
            kernel_of(bounds.shape[1]), unit[some], standard[some], alpha, restarts, seed
        )
    alpha = noise**2 / counts + JITTER
    regressor = GaussianProcessRegressor(kernel, alpha=alpha, optimizer=None).fit(unit, standard)
    return Process(regressor, rows, centre, scale, noise * scale)


def require_points(response: str, points: int, dimensions: int) -> None:
    """Raise CalibratorError where the points are too few for a trend, or too many for memory.

    response : setup.response.
    """
    if points == 0:
        setup, _, name = response.partition(".")
        raise CalibratorError(
            f"no good run of {setup} has measured {name}: see in database.csv how its runs ended"
            " and what they have, then change the set-up or leave that target out"
        )
    if points < dimensions + 2:
        raise CalibratorError(
            f"{response} was measured at {points} distinct points: "
            f"give at least {dimensions + 2} for {dimensions} parameters"
        )
    if points > MOST_POINTS:
        raise CalibratorError(
            f"a Gaussian process through {points} parameter sets does not fit into memory (at"
            f" most {MOST_POINTS}): interpolate with the multilinear method, or calibrate on a part"
            " of the database"
        )


def _subset(count: int, seed: int) -> np.ndarray:
    """Rows that the search for the kernel sees: all, or KERNEL_POINTS of them."""
    if count <= KERNEL_POINTS:
        return np.arange(count)
    return np.sort(np.random.default_rng(seed).choice(count, KERNEL_POINTS, replace=False))
