"""Interpolation of raw bulk responses over the parameter space; a misfit is never interpolated.

Two interpolants with the same verbs: `Multilinear` on a full grid, as in the reference paper, and `GaussianProcess` on any
design. Both refuse to extrapolate. Arrays in, arrays out: rows are points, columns are parameters or responses.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, cast

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.linalg import cho_solve
from scipy.stats import qmc
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, DotProduct, Matern, WhiteKernel
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

from calibrator.errors import CalibratorError

FEWEST_DEGREES = 4  # pooled seed noise with fewer degrees of freedom is uncertain by more than a factor of two
CHUNK = 4096  # rows predicted at once: keeps the covariance block in the processor's cache
TREND_VARIANCE = 10.0  # of the standardised response per half range: broad, so the linear trend is all but free
LENGTH_SCALES = (0.5, 20.0)  # in half ranges: 15-60 points cannot resolve less than a quarter of a range
KERNEL_POINTS = 500  # more hardly change the kernel, and the search for it takes minutes (benchmarks/interpolant.py)
MOST_POINTS = 10_000  # a covariance of 0.8 GB, and the process holds a few of its size
JITTER = 1e-8  # of the standardised variance: keeps the covariance invertible where the noise is measured as zero

Verb = TypeVar("Verb", bound=Callable[..., Any])
_THREADS = ThreadpoolController()


class Interpolant(Protocol):
    """What every interpolant offers: responses (m,) by key, seed noise (m,), and predictions at points (k, d)."""

    @property
    def responses(self) -> list[str]:
        """Keys of the interpolated responses, in column order."""

    @property
    def points(self) -> np.ndarray:
        """Distinct points (p, d) that it was fitted to."""

    @property
    def values(self) -> np.ndarray:
        """Mean responses (p, m) at the distinct points; NaN where not measured."""

    @property
    def noise_sources(self) -> tuple[str, ...]:
        """Where the seed noise of each response (m,) is from."""

    @property
    def noise(self) -> np.ndarray:
        """Seed noise, shape (m,): standard deviation of a single run about the mean response, in the response's unit."""

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Mean responses (k, m) at points (k, d)."""

    def predict_with_error(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean responses and their standard deviations, both (k, m)."""

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Prediction of each distinct point without it and its expected scatter, both (p, m)."""


def _on_one_thread(function: Verb) -> Verb:
    """Keep the linear algebra of function on one thread.

    Matrices of some tens of rows are slower on several, 20 times so on a machine whose cores are busy with runs.
    """
    return cast(Verb, _THREADS.wrap(limits=1, user_api="blas")(function))


def box_sample(low: np.ndarray, high: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Scrambled Sobol points that fill the box low (d,) to high (d,); count is rounded up to a power of two: (n, d)."""
    unit = qmc.Sobol(len(low), scramble=True, seed=rng).random_base2(max(0, math.ceil(math.log2(count))))
    return np.clip(low + (high - low) * unit, low, high)


def seed_noise(points: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Seed noise of each response, pooled over all points that were run more than once.

    Parameters
    ----------
    points : (n, d) parameter sets; replicates are rows that agree exactly.
    values : (n, m) responses; NaN where a response was not measured.

    Returns
    -------
    std : (m,) square root of the summed squared deviations from each point's mean over the degrees of freedom, in the
        response's unit; NaN without replicates. It assumes that the noise is the same all over the parameter space.
    degrees : (m,) degrees of freedom, the runs less the distinct points.
    """
    group, means, counts = _grouped(points, values, np.ones(len(points)))
    squares = np.nansum((values - means[group]) ** 2, axis=0)
    degrees = np.maximum(counts - 1, 0).sum(axis=0).astype(int)
    return np.sqrt(np.divide(squares, degrees, out=np.full(len(degrees), np.nan), where=degrees > 0)), degrees


def average_replicates(
    points: np.ndarray, values: np.ndarray, counts: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means over the rows at the same point.

    Parameters
    ----------
    points : (n, d); values : (n, m), NaN where not measured; counts : (n,) runs that each row already averages, or None.

    Returns
    -------
    distinct points (p, d) in lexical order, means (p, m) with NaN where nothing was measured, runs behind each mean (p, m).
    """
    _, means, totals = _grouped(points, values, np.ones(len(points)) if counts is None else np.asarray(counts, float))
    return np.unique(points, axis=0), means, totals


def _grouped(points: np.ndarray, values: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Group of each row (n,), and mean and count of each group and response (p, m)."""
    distinct, group = np.unique(points, axis=0, return_inverse=True)
    weights = np.where(np.isnan(values), 0.0, counts[:, None])
    totals, sums = np.zeros((2, len(distinct), values.shape[1]))
    np.add.at(totals, group, weights)
    np.add.at(sums, group, weights * np.nan_to_num(values))
    return group, np.divide(sums, totals, out=np.full_like(sums, np.nan), where=totals > 0), totals


@dataclass(frozen=True, eq=False)
class _Runs:
    """Checked training runs, averaged over replicates: what both interpolants start from."""

    raw_points: np.ndarray  # (n, d)
    raw_values: np.ndarray  # (n, m)
    points: np.ndarray  # (p, d)
    values: np.ndarray  # (p, m)
    counts: np.ndarray  # (p, m)
    noise: np.ndarray  # (m,), NaN where it has to be estimated
    noise_sources: tuple[str, ...]  # (m,)
    responses: list[str]
    parameters: list[str]


def _checked_runs(
    points: np.ndarray,
    values: np.ndarray,
    names: Sequence[str],
    noise: np.ndarray | None,
    counts: np.ndarray | None,
    parameters: Sequence[str] | None,
    fewest_degrees: int,
) -> _Runs:
    points, values = np.asarray(points, float), np.asarray(values, float)
    if points.ndim != 2 or values.shape != (len(points), len(names)) or not len(points):
        raise CalibratorError(
            f"points {points.shape} and values {values.shape} do not fit {len(names)} responses: give (n, d) and (n, m), n > 0"
        )
    if not np.isfinite(points).all() or np.isinf(values).any():
        raise CalibratorError("a training point is not finite or a response is infinite: leave failed runs out")
    if counts is not None and noise is None:
        raise CalibratorError("rows that already average several runs hide the seed noise: give noise together with counts")
    known_noise, sources = _noise_of(points, values, noise, fewest_degrees)
    parameters = list(parameters) if parameters is not None else [f"parameter {i + 1}" for i in range(points.shape[1])]
    return _Runs(points, values, *average_replicates(points, values, counts), known_noise, sources, list(names), parameters)


def _noise_of(
    points: np.ndarray, values: np.ndarray, noise: np.ndarray | None, fewest_degrees: int
) -> tuple[np.ndarray, tuple[str, ...]]:
    if noise is not None:
        return np.broadcast_to(np.asarray(noise, float), values.shape[1]).copy(), ("given",) * values.shape[1]
    pooled, degrees = seed_noise(points, values)
    measured = degrees >= fewest_degrees
    return np.where(measured, pooled, np.nan), tuple("replicates" if m else "estimated" for m in measured)


def _inside(points: np.ndarray, low: np.ndarray, high: np.ndarray, parameters: Sequence[str]) -> np.ndarray:
    """Points (k, d) clipped by no more than rounding; CalibratorError if one lies outside low (d,) to high (d,)."""
    points = np.atleast_2d(np.asarray(points, float))
    if points.shape[1] != len(low):
        raise CalibratorError(f"points have {points.shape[1]} columns: give one for each of {', '.join(parameters)}")
    rounding = 1e-9 * (high - low)
    outside = np.argwhere(~((points >= low - rounding) & (points <= high + rounding)))
    if len(outside):
        row, column = outside[0]
        raise CalibratorError(
            f"{parameters[column]} = {points[row, column]:g} lies outside {low[column]:g} to {high[column]:g}: "
            "an interpolant does not extrapolate, stay inside or add runs there"
        )
    return np.clip(points, low, high)


def _common(sources: Sequence[str]) -> str:
    return sources[0] if len(set(sources)) == 1 else "mixed"


@dataclass(frozen=True, eq=False)
class Multilinear:
    """Multilinear interpolation on a full grid (scipy's RegularGridInterpolator), the paper's choice.

    Its error estimate knows the seed noise only, not the error of straight lines between curved samples; `leave_one_out`
    measures the latter.

    Attributes
    ----------
    responses : keys of the m responses; parameters : names of the d parameters.
    points (p, d), values (p, m), counts (p, m) : distinct grid points, mean responses and runs behind each.
    noise : (m,) seed noise of a single run; zero where noise_sources says "none".
    noise_sources : (m,) "given", "replicates" or "none" (no replicates).
    axes : d ascending sample arrays.
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
        points : (n, d) grid points, replicates repeated; values : (n, m) responses; names : m response keys.
        noise : (m,) known seed noise; measured from replicates where None.
        counts : (n,) runs that each row averages, with noise only; parameters : d names for messages.

        Raises
        ------
        CalibratorError : the points are not a full grid of two or more samples per axis, or a response is missing.
        """
        runs = _checked_runs(points, values, names, noise, counts, parameters, 1)
        axes = tuple(np.unique(column) for column in runs.points.T)
        _require_full_grid(runs, axes)
        shape = (*(len(axis) for axis in axes), len(names))
        interpolator = RegularGridInterpolator(axes, runs.values.reshape(shape))
        sources = tuple("none" if source == "estimated" else source for source in runs.noise_sources)
        known_noise = np.nan_to_num(runs.noise)
        return cls(
            runs.responses, runs.parameters, runs.points, runs.values, runs.counts, known_noise, sources, axes, interpolator
        )

    @property
    def noise_source(self) -> str:
        """Origin of the seed noise where it is the same for all responses, else "mixed"."""
        return _common(self.noise_sources)

    @property
    def _low(self) -> np.ndarray:
        return np.array([axis[0] for axis in self.axes])

    @property
    def _high(self) -> np.ndarray:
        return np.array([axis[-1] for axis in self.axes])

    @property
    def _variance(self) -> np.ndarray:
        """Variance of the mean response at each grid point, (p, m)."""
        return self.noise**2 / self.counts

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Mean responses (k, m) at points (k, d); CalibratorError outside the grid."""
        return self._interpolator(_inside(points, self._low, self._high, self.parameters))

    def predict_with_error(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean responses and their standard deviation, both (k, m): seed noise of the surrounding grid points only."""
        points = _inside(points, self._low, self._high, self.parameters)
        variance = np.zeros((len(points), len(self.responses)))
        for rows, weights in _surrounding(points, self.axes):
            variance += weights[:, None] ** 2 * self._variance[rows]
        return self.predict(points), np.sqrt(variance)

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Each grid point predicted from the grid without any line through it, both (p, m).

        Along every axis on which the point is not at an end, its own line is dropped, so the prediction uses the
        neighbours one step away: the test of a grid with twice the spacing, whose error is about four times that of the
        grid itself where the response is smooth. Points at an end of every axis have no such prediction: NaN.

        The standard deviation is that of measured mean minus prediction due to seed noise alone.
        """
        shape = (*(len(axis) for axis in self.axes), -1)
        predictions = _without_own_lines(self.values.reshape(shape), self.axes, 1).reshape(self.values.shape)
        variance = self._variance + _without_own_lines(self._variance.reshape(shape), self.axes, 2).reshape(self.values.shape)
        corner = ((self.points == self._low) | (self.points == self._high)).all(axis=1)
        predictions[corner], variance[corner] = np.nan, np.nan
        return predictions, np.sqrt(variance)


def _require_full_grid(runs: _Runs, axes: Sequence[np.ndarray]) -> None:
    for name, axis in zip(runs.parameters, axes, strict=True):
        if len(axis) < 2:
            raise CalibratorError(f"{name} has the single value {axis[0]:g} in all runs: fix it, or sample two values or more")
    missing = math.prod(len(axis) for axis in axes) - len(runs.points)
    if missing:
        present = set(map(tuple, runs.points))
        holes = (corner for corner in itertools.product(*axes) if corner not in present)
        raise CalibratorError(
            f"the runs are not a full grid, {missing} of {missing + len(runs.points)} points are missing, e.g. "
            f"{_spelled(runs.parameters, itertools.islice(holes, 2))}: run them, or interpolate with a Gaussian process"
        )
    unmeasured = np.argwhere(np.isnan(runs.values))
    if len(unmeasured):
        row, column = unmeasured[0]
        raise CalibratorError(
            f"{runs.responses[column]} was not measured at {len(unmeasured)} grid point(s), e.g. "
            f"{_spelled(runs.parameters, [runs.points[row]])}: run them again, or interpolate with a Gaussian process"
        )


def _spelled(parameters: Sequence[str], points: Iterator[Any] | list[Any]) -> str:
    return " and ".join("(" + ", ".join(f"{n} = {v:g}" for n, v in zip(parameters, p, strict=True)) + ")" for p in points)


def _surrounding(points: np.ndarray, axes: Sequence[np.ndarray]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """For each of the 2^d corners of the cells around points (k, d): flat grid index (k,) and multilinear weight (k,)."""
    cells = [np.searchsorted(axis[1:-1], x, side="right") for axis, x in zip(axes, points.T, strict=True)]
    parts = [(x - axis[c]) / (axis[c + 1] - axis[c]) for axis, x, c in zip(axes, points.T, cells, strict=True)]
    shape = [len(axis) for axis in axes]
    for corner in itertools.product((0, 1), repeat=len(axes)):
        rows = np.ravel_multi_index([c + step for c, step in zip(cells, corner, strict=True)], shape)
        yield rows, np.prod([part if step else 1 - part for part, step in zip(parts, corner, strict=True)], axis=0)


def _without_own_lines(grid: np.ndarray, axes: Sequence[np.ndarray], power: int) -> np.ndarray:
    """Replace every interior line by interpolation between its neighbours, one axis after the other.

    The product over the axes is the multilinear interpolation in the cell of twice the size. power 1 interpolates values,
    2 propagates variances (squared weights).
    """
    for i, axis in enumerate(axes):
        lines = np.moveaxis(grid, i, 0)
        share = ((axis[1:-1] - axis[:-2]) / (axis[2:] - axis[:-2])).reshape(-1, *[1] * (grid.ndim - 1))
        inner = lines[:-2] * (1 - share) ** power + lines[2:] * share**power
        grid = np.moveaxis(np.concatenate([lines[:1], inner, lines[-1:]]), 0, i)
    return grid


@dataclass(frozen=True, eq=False)
class GaussianProcess:
    """One independent Gaussian process per response, for any design of runs.

    Covariance: a constant times a Matern 5/2 kernel with one length scale per parameter, plus a linear trend as a
    dot-product kernel of fixed broad variance (universal kriging). The trend as part of the covariance cross-validates
    better than a least-squares trend with a process on its residual, and keeps the leave-one-out predictions in closed
    form. Length scales and amplitude maximise the marginal likelihood (Rasmussen & Williams, Gaussian Processes for
    Machine Learning, 2006, Eq. 5.8).

    Attributes
    ----------
    responses : keys of the m responses; parameters : names of the d parameters; bounds : (2, d) box of the design.
    points (p, d), values (p, m), counts (p, m) : distinct points, mean responses (NaN where not measured) and runs behind each.
    noise : (m,) seed noise of a single run.
    noise_sources : (m,) "given", "replicates" (pooled) or "estimated" (by maximum likelihood, too few replicates to pool).
    """

    responses: list[str]
    parameters: list[str]
    bounds: np.ndarray
    points: np.ndarray
    values: np.ndarray
    counts: np.ndarray
    noise: np.ndarray
    noise_sources: tuple[str, ...]
    _processes: tuple[_Process, ...]

    @classmethod
    @_on_one_thread
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
    ) -> GaussianProcess:
        """Processes through the mean responses, smoothing by the seed noise.

        A search for the kernel takes the cube of the number of points, some hundred times over. Beyond KERNEL_POINTS it
        sees a random subset of that many (drawn with seed); the process itself is conditioned on all points.

        Parameters
        ----------
        points : (n, d) parameter sets, replicates repeated; values : (n, m) responses, NaN where not measured.
        names : m response keys; bounds : (2, d) lower and upper bounds of the design, which must hold all points.
        noise : (m,) known seed noise; where None it is pooled from replicates if they give 4 or more degrees of freedom,
            else estimated with the kernel.
        counts : (n,) runs that each row averages, with noise only; parameters : d names for messages.
        restarts : extra starts of the likelihood search, drawn with seed.

        Raises
        ------
        CalibratorError : a point lies outside bounds, a response has fewer than d + 2 distinct points, or there are more than
            MOST_POINTS of them.
        """
        runs = _checked_runs(points, values, names, noise, counts, parameters, FEWEST_DEGREES)
        bounds = np.asarray(bounds, float)
        _inside(runs.points, bounds[0], bounds[1], runs.parameters)
        processes = tuple(_fit_process(runs, column, bounds, restarts, seed) for column in range(len(names)))
        found = np.array([process.noise for process in processes])
        return cls(
            runs.responses, runs.parameters, bounds, runs.points, runs.values, runs.counts, found, runs.noise_sources, processes
        )

    @property
    def noise_source(self) -> str:
        """Origin of the seed noise where it is the same for all responses, else "mixed"."""
        return _common(self.noise_sources)

    def _unit(self, points: np.ndarray) -> np.ndarray:
        return _unit(_inside(points, self.bounds[0], self.bounds[1], self.parameters), self.bounds)

    @_on_one_thread
    def predict(self, points: np.ndarray) -> np.ndarray:
        """Mean responses (k, m) at points (k, d); CalibratorError outside the bounds."""
        unit = self._unit(points)
        return np.column_stack([_chunked(process.mean, unit) for process in self._processes])

    @_on_one_thread
    def predict_with_error(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean responses and the standard deviation of that mean (seed noise of a new run not included), both (k, m)."""
        unit = self._unit(points)
        both = np.stack([_chunked(process.mean_and_std, unit) for process in self._processes], axis=1)
        return both[..., 0], both[..., 1]

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Each distinct point predicted by the other points with the kernel kept, both (p, m).

        Closed form of Rasmussen & Williams (2006), Eqs. 5.10-5.12. The standard deviation is that of measured mean minus
        prediction, seed noise of that mean included, so (values - predictions) / std should scatter by one.
        NaN where the response was not measured.
        """
        predictions, std = np.full((2, *self.values.shape), np.nan)
        for column, process in enumerate(self._processes):
            predictions[process.rows, column], std[process.rows, column] = process.leave_one_out()
        return predictions, std


@dataclass(frozen=True, eq=False)
class _Process:
    """A conditioned process of one response in standardised units (value - centre) / scale, and its training rows."""

    regressor: GaussianProcessRegressor
    rows: np.ndarray
    centre: float
    scale: float
    noise: float

    def mean(self, unit: np.ndarray) -> np.ndarray:
        return self.centre + self.scale * self.regressor.predict(unit)

    def mean_and_std(self, unit: np.ndarray) -> np.ndarray:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Predicted variances smaller than 0")  # rounding at a noiseless training point
            mean, std = self.regressor.predict(unit, return_std=True)
        return np.column_stack([self.centre + self.scale * mean, self.scale * std])

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        precision = np.diag(cho_solve((self.regressor.L_, True), np.eye(len(self.rows))))
        predictions = self.regressor.y_train_ - self.regressor.alpha_ / precision
        return self.centre + self.scale * predictions, self.scale / np.sqrt(precision)


def _unit(points: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Points scaled to [-1, 1] by the bounds: half ranges from the centre, so that the trend pivots there."""
    return (2 * points - bounds[0] - bounds[1]) / (bounds[1] - bounds[0])


def _chunked(function: Callable[[np.ndarray], np.ndarray], rows: np.ndarray) -> np.ndarray:
    return np.concatenate([function(rows[i : i + CHUNK]) for i in range(0, max(1, len(rows)), CHUNK)])


def _fit_process(runs: _Runs, column: int, bounds: np.ndarray, restarts: int, seed: int) -> _Process:
    rows = np.flatnonzero(~np.isnan(runs.values[:, column]))
    if len(rows) < bounds.shape[1] + 2:
        raise CalibratorError(
            f"{runs.responses[column]} was measured at {len(rows)} distinct points: "
            f"give at least {bounds.shape[1] + 2} for {bounds.shape[1]} parameters"
        )
    if len(rows) > MOST_POINTS:
        raise CalibratorError(
            f"a Gaussian process through {len(rows)} parameter sets does not fit into memory (at most {MOST_POINTS}): "
            "interpolate with the multilinear method, or calibrate on a part of the database"
        )
    unit, values, counts = _unit(runs.points[rows], bounds), runs.values[rows, column], runs.counts[rows, column]
    centre, scale = values.mean(), values.std() or 1.0
    standard, noise = (values - centre) / scale, runs.noise[column] / scale
    if np.isnan(noise):
        raw = ~np.isnan(runs.raw_values[:, column])
        raw_standard = (runs.raw_values[raw, column] - centre) / scale
        some = _subset(len(raw_standard), seed)
        kernel, noise = _kernel_and_noise(_unit(runs.raw_points[raw], bounds)[some], raw_standard[some], restarts, seed)
    else:
        some = _subset(len(rows), seed)
        alpha = noise**2 / counts[some] + JITTER
        kernel = _likeliest(_kernel(bounds.shape[1]), unit[some], standard[some], alpha, restarts, seed)
    regressor = GaussianProcessRegressor(kernel, alpha=noise**2 / counts + JITTER, optimizer=None).fit(unit, standard)
    return _Process(regressor, rows, centre, scale, noise * scale)


def _subset(count: int, seed: int) -> np.ndarray:
    """Rows that the search for the kernel sees: all, or KERNEL_POINTS of them."""
    if count <= KERNEL_POINTS:
        return np.arange(count)
    return np.sort(np.random.default_rng(seed).choice(count, KERNEL_POINTS, replace=False))


def _kernel(dimensions: int) -> Any:
    smooth = ConstantKernel(1.0, (1e-3, 1e3)) * Matern(np.ones(dimensions), LENGTH_SCALES, nu=2.5)
    return smooth + ConstantKernel(TREND_VARIANCE, "fixed") * DotProduct(1.0, "fixed")


def _kernel_and_noise(unit: np.ndarray, standard: np.ndarray, restarts: int, seed: int) -> tuple[Any, float]:
    """Likeliest kernel and seed noise together, from single runs: replicates, where there are some, speak through them."""
    found = _likeliest(_kernel(unit.shape[1]) + WhiteKernel(0.01, (1e-6, 1.0)), unit, standard, JITTER, restarts, seed)
    return found.k1, math.sqrt(found.k2.noise_level)


def _likeliest(kernel: Any, unit: np.ndarray, standard: np.ndarray, alpha: Any, restarts: int, seed: int) -> Any:
    search = GaussianProcessRegressor(kernel, alpha=alpha, n_restarts_optimizer=restarts, random_state=seed)
    with warnings.catch_warnings():
        # a parameter without influence drives its length scale to the bound, which is the right answer
        warnings.simplefilter("ignore", ConvergenceWarning)
        return search.fit(unit, standard).kernel_
