"""The Gaussian process of one response of dear runs, given that of cheap ones (see `cokriging`).

The cheap process is conditioned on the cheap runs already, so that what is sought for the dear runs
are few numbers: the slope rho, the size of the discrepancy, and the seed noise where it is not
known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.optimize import minimize

from calibrator.errors import CalibratorError
from calibrator.responses.gaussian_process import GaussianProcess, Process
from calibrator.responses.interpolant import TrainingRuns, grouped
from calibrator.responses.kernel import JITTER, matern

# All in standard deviations of the cheap response over its runs.
UNKNOWN_MEAN = 10.0  # what is known beforehand of the discrepancy's mean
RHO_PRIOR = (1.0, 0.5)  # a cheap version is chosen because it behaves alike
# Of the discrepancy's size, a normal prior of its logarithm: a fifth within a factor of three. The
# likelihood of few runs alone puts it to zero, and then claims that nothing is left to learn.
SIZE_PRIOR = (math.log(0.2), 1.1)
SIZES = (0.01, 10.0)
RHOS = (-3.0, 3.0)
NOISES = (0.001, 3.0)  # of a dear run where it is not known
SMOOTHER = 1.0  # half ranges: the discrepancy is no rougher than that, as dear runs are few
FEWEST = 3  # dear sets: a mean, a slope and one to spare


@dataclass(frozen=True)
class Link:
    """How a dear response hangs on the cheap one.

    Attributes
    ----------
    rho : slope; 0 where the dear runs are better predicted without the cheap ones.
    size : of the discrepancy, in standard deviations of the cheap response.
    """

    rho: float
    size: float


@dataclass(frozen=True, eq=False)
class Alone:
    """The process of one dear response that leans on nothing; see `DearProcess` for its verbs."""

    process: Process

    @property
    def link(self) -> Link:
        """None, but for numbers that say so."""
        return Link(0.0, 1.0)

    @property
    def rows(self) -> np.ndarray:
        """Which of all dear points (n,) it was conditioned on."""
        return self.process.rows

    @property
    def noise(self) -> float:
        """Seed noise of a single run."""
        return self.process.noise

    def mean_and_error(self, unit: np.ndarray) -> np.ndarray:
        """Mean responses and their standard deviations as two columns (k, 2)."""
        return self.process.mean_and_std(unit)

    def told(self, unit: np.ndarray) -> np.ndarray:
        """How much a cheap and a dear run at each point lower the variance there, (k, 2)."""
        variance = self.process.mean_and_std(unit)[:, 1] ** 2
        jitter = JITTER * self.process.scale**2
        dear = variance**2 / (variance + self.noise**2 + jitter)
        return np.column_stack([np.zeros(len(unit)), dear])

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Prediction of each row without it, and its expected scatter, both (rows,)."""
        return self.process.leave_one_out()


@dataclass(frozen=True, eq=False)
class DearProcess:
    """The process of one dear response, given the cheap one, in that one's standardised units.

    Attributes
    ----------
    process : the cheap one.
    unit : dear points (n, d) in half ranges; rows : (n,) which of all dear points they are.
    values : (n,) standardised means about their mean; counts : (n,) runs behind each.
    squares, degrees : within the points, of standardised runs about their means.
    centre : mean of the dear values; noise : of a single run, both in the response's unit.
    cheap_mean, cheap_covariance : (n,) and (n, n), standardised, of the cheap response there.
    """

    process: Process
    unit: np.ndarray
    rows: np.ndarray
    values: np.ndarray
    counts: np.ndarray
    squares: float
    degrees: int
    centre: float
    noise: float
    cheap_mean: np.ndarray
    cheap_covariance: np.ndarray
    link: Link = Link(1.0, 1.0)

    @classmethod
    def of(
        cls, runs: TrainingRuns, column: int, below: GaussianProcess, link: Link | None
    ) -> DearProcess:
        """The process through the runs' means; link : where it is known."""
        rows = np.flatnonzero(~np.isnan(runs.values[:, column]))
        if len(rows) < FEWEST:
            raise CalibratorError(
                f"{runs.responses[column]} was measured at {len(rows)} sets by full runs, and takes"
                f" {FEWEST} beside the cheap ones: raise fidelity.dear_sets"
            )
        own, process = runs.values[rows, column], below.processes[column]
        group, means, _ = grouped(
            runs.raw_points, runs.raw_values[:, [column]], np.ones(len(runs.raw_points))
        )
        off = runs.raw_values[:, column] - means[group, 0]
        unit = below.unit(runs.points[rows])
        found = cls(
            process,
            unit,
            rows,
            (own - own.mean()) / process.scale,
            runs.counts[rows, column],
            float(np.nansum(off**2)) / process.scale**2,
            int(np.isfinite(off).sum()) - len(rows),
            float(own.mean()),
            float(runs.noise[column]),
            *process.regressor.predict(unit, return_cov=True),
        )
        return found._likeliest() if link is None else replace(found, link=link)

    def _likeliest(self) -> DearProcess:
        """With the most probable rho, size of the discrepancy and, where it is not known, noise."""

        def at(x: np.ndarray) -> DearProcess:
            noise = (
                self.noise if not math.isnan(self.noise) else math.exp(x[2]) * self.process.scale
            )
            return replace(self, link=Link(float(x[0]), math.exp(x[1])), noise=noise)

        def loss(x: np.ndarray) -> float:
            rho = (x[0] - RHO_PRIOR[0]) / RHO_PRIOR[1]
            size = (x[1] - SIZE_PRIOR[0]) / SIZE_PRIOR[1]
            return -at(x).log_likelihood + 0.5 * float(rho**2 + size**2)

        bounds = [RHOS, tuple(np.log(SIZES)), tuple(np.log(NOISES))]
        starts = [
            [rho, math.log(size), math.log(0.1)] for rho in (1.0, 0.2) for size in (0.05, 0.3, 1.0)
        ]
        tried = [minimize(loss, x, method="L-BFGS-B", bounds=bounds) for x in starts]
        return at(min(tried, key=lambda one: float(one.fun)).x)

    @property
    def log_likelihood(self) -> float:
        """Log likelihood of the dear runs given the cheap ones, but for a constant."""
        root, left = self._root, self._left
        fit = left @ cho_solve((root, True), left) + 2 * np.log(np.diag(root)).sum()
        variance = (self.noise / self.process.scale) ** 2 + JITTER
        return float(-(fit + self.squares / variance + self.degrees * math.log(variance)) / 2)

    @property
    def _left(self) -> np.ndarray:
        """What the cheap mean leaves (n,) of the dear values."""
        return np.asarray(self.values - self.link.rho * self.cheap_mean)

    @cached_property
    def _root(self) -> np.ndarray:
        """Lower Cholesky root (n, n) of the dear runs' covariance, given the cheap ones."""
        whole = self.link.rho**2 * self.cheap_covariance + self._discrepancy(self.unit, self.unit)
        noise = (self.noise / self.process.scale) ** 2 / self.counts
        return np.asarray(cholesky(whole + np.diag(noise + JITTER), lower=True))

    @cached_property
    def _weights(self) -> np.ndarray:
        """Inverse covariance of the cheap runs times their covariance with the dear points."""
        regressor = self.process.regressor
        across = regressor.kernel_(regressor.X_train_, self.unit)
        return np.asarray(cho_solve((regressor.L_, True), across))

    def _discrepancy(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Covariance (n, m) of the discrepancy at points (n, d) and (m, d)."""
        lengths = np.exp(self.process.regressor.kernel_.theta[1:])
        smooth = matern(a, b, np.maximum(lengths, SMOOTHER))
        return np.asarray(UNKNOWN_MEAN**2 + self.link.size**2 * (a @ b.T + smooth))

    def _across(self, unit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Covariance (k, n) of points with the dear points, given the cheap runs.

        That of the cheap responses, and that of the dear ones.
        """
        regressor = self.process.regressor
        cheap = regressor.kernel_(unit, self.unit)
        cheap -= regressor.kernel_(unit, regressor.X_train_) @ self._weights
        return cheap, self.link.rho**2 * cheap + self._discrepancy(unit, self.unit)

    def _variance(
        self, unit: np.ndarray, cheap_error: np.ndarray, across: np.ndarray
    ) -> np.ndarray:
        """Variance (k,) of dear means, from what is known before any dear run."""
        before = UNKNOWN_MEAN**2 + self.link.size**2 * ((unit**2).sum(axis=1) + 1)
        before = before + self.link.rho**2 * cheap_error**2
        told = solve_triangular(self._root, across.T, lower=True)
        return np.asarray(np.maximum(before - (told**2).sum(axis=0), 0.0))

    def mean_and_error(self, unit: np.ndarray) -> np.ndarray:
        """Mean responses and their standard deviations as two columns (k, 2)."""
        below = self.process.mean_and_std(unit)
        cheap_mean, cheap_error = (below - [self.process.centre, 0.0]).T / self.process.scale
        _, across = self._across(unit)
        mean = self.link.rho * cheap_mean + across @ cho_solve((self._root, True), self._left)
        error = np.sqrt(self._variance(unit, cheap_error, across))
        return np.column_stack(
            [self.centre + self.process.scale * mean, self.process.scale * error]
        )

    def told(self, unit: np.ndarray) -> np.ndarray:
        """How much a cheap and a dear run at each point lower the variance there, (k, 2)."""
        cheap_error = self.process.mean_and_std(unit)[:, 1] / self.process.scale
        cheap, across = self._across(unit)
        dear = self._variance(unit, cheap_error, across)
        solved = cho_solve((self._root, True), across.T).T
        both = self.link.rho * (cheap_error**2 - (solved * cheap).sum(axis=1))
        own = cho_solve((self._root, True), cheap.T).T
        left = cheap_error**2 - self.link.rho**2 * (own * cheap).sum(axis=1)
        noises = np.array([self.process.noise, self.noise]) / self.process.scale
        lower = [
            both**2 / (left + noises[0] ** 2 + JITTER),
            dear**2 / (dear + noises[1] ** 2 + JITTER),
        ]
        return np.column_stack(lower) * self.process.scale**2

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Prediction of each row without it, and its expected scatter, both (rows,)."""
        inverse = cho_solve((self._root, True), np.eye(len(self.rows)))
        precision, scale = np.diag(inverse), self.process.scale
        predictions = self.values - inverse @ self._left / precision
        return self.centre + scale * predictions, scale / np.sqrt(precision)
