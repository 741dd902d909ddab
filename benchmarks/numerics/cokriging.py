"""Dear runs predicted from cheap ones: linear co-kriging of one response.

Kennedy & O'Hagan, Biometrika 87 (2000) 1: dear(x) = rho cheap(x) + delta(x), cheap and delta two
independent Gaussian processes, each seen with the seed noise of its own runs. Both have an unknown
mean, on which a flat prior is put, so that all is in closed form but for the covariances'
parameters; those are the likeliest (restricted likelihood, Rasmussen & Williams, Gaussian Processes
for Machine Learning, 2006, section 2.7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.optimize import minimize

LENGTHS = (0.2, 10.0)  # of a covariance, in ranges of a parameter
SIZES = (0.03, 30.0)  # of a process, in standard deviations of its runs
SLOPES = (-3.0, 3.0)  # rho


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs of one fidelity: points (n, d) of the unit box, one response (n,), its seed noise."""

    points: np.ndarray
    values: np.ndarray
    noise: float


@dataclass(frozen=True)
class Likeliest:
    """The parameters of the covariances.

    Attributes
    ----------
    rho : slope; size, lengths : standard deviation and length scales (d,) of the cheap process.
    delta, smooth : the same of the discrepancy, whose length is one in all parameters.
    """

    rho: float
    size: float
    lengths: tuple[float, ...]
    delta: float
    smooth: float


@dataclass(frozen=True, eq=False)
class CoKriging:
    """The dear response given cheap and dear runs."""

    cheap: Runs
    dear: Runs
    found: Likeliest

    @classmethod
    def fit(cls, cheap: Runs, dear: Runs) -> CoKriging:
        """With the likeliest covariances."""
        spread = cheap.values.std(), dear.values.std()
        d = cheap.points.shape[1]
        bounds = [SLOPES, *[tuple(np.log(LENGTHS))] * (d + 1), *[tuple(np.log(SIZES))] * 2]

        def unpacked(x: np.ndarray) -> Likeliest:
            lengths, (size, delta) = np.exp(x[1 : d + 2]), np.exp(x[d + 2 :])
            own = tuple(map(float, lengths[:d]))
            return Likeliest(x[0], size * spread[0], own, delta * spread[1], float(lengths[d]))

        def loss(x: np.ndarray) -> float:
            return -cls(cheap, dear, unpacked(x)).log_likelihood

        starts = [
            np.array([rho, *np.log([1.0] * d), np.log(3.0), 0.0, np.log(share)])
            for rho, share in ((1.0, 0.1), (1.0, 0.5), (0.0, 1.0))
        ]
        tried = [minimize(loss, start, method="L-BFGS-B", bounds=bounds) for start in starts]
        return cls(cheap, dear, unpacked(min(tried, key=lambda one: float(one.fun)).x))

    def covariance(
        self, a: np.ndarray, b: np.ndarray, dear_a: np.ndarray, dear_b: np.ndarray
    ) -> np.ndarray:
        """Covariance (n, m) without noise of points a (n, d) and b (m, d), dear or cheap."""
        f = self.found
        slopes = np.where(dear_a, f.rho, 1.0)[:, None] * np.where(dear_b, f.rho, 1.0)
        both = dear_a[:, None] & dear_b
        first = f.size**2 * _smooth(a / f.lengths, b / f.lengths)
        return np.asarray(slopes * first + both * f.delta**2 * _smooth(a / f.smooth, b / f.smooth))

    @property
    def points(self) -> np.ndarray:
        """All points (n, d), cheap ones first."""
        return np.concatenate([self.cheap.points, self.dear.points])

    @property
    def is_dear(self) -> np.ndarray:
        """Which of all points (n,) are dear."""
        return np.repeat([False, True], [len(self.cheap.values), len(self.dear.values)])

    def _solved(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cholesky root of all runs' covariance, their trend (n, 2), and its weights (2, 2)."""
        dear = self.is_dear
        whole = self.covariance(self.points, self.points, dear, dear)
        whole += np.diag(np.where(dear, self.dear.noise, self.cheap.noise) ** 2)
        root = cholesky(whole + 1e-10 * np.trace(whole) / len(whole) * np.eye(len(whole)), True)
        trend = np.column_stack([~dear, dear]).astype(float)
        return root, trend, trend.T @ cho_solve((root, True), trend)

    @property
    def log_likelihood(self) -> float:
        """Restricted log likelihood, but for a constant."""
        root, trend, weights = self._solved()
        values = np.concatenate([self.cheap.values, self.dear.values])
        means = np.linalg.solve(weights, trend.T @ cho_solve((root, True), values))
        left = values - trend @ means
        misfit = left @ cho_solve((root, True), left)
        logs = 2 * np.log(np.diag(root)).sum() + np.linalg.slogdet(weights)[1]
        return float(-(misfit + logs) / 2)

    def predict(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean dear responses (k,) at points (k, d), and their standard deviations."""
        root, trend, weights = self._solved()
        values = np.concatenate([self.cheap.values, self.dear.values])
        means = np.linalg.solve(weights, trend.T @ cho_solve((root, True), values))
        all_dear = np.ones(len(points), bool)
        across = self.covariance(points, self.points, all_dear, self.is_dear)
        solved = cho_solve((root, True), across.T)
        mean = means[1] + across @ cho_solve((root, True), values - trend @ means)
        prior = self.found.rho**2 * self.found.size**2 + self.found.delta**2
        short = np.array([0.0, 1.0])[:, None] - trend.T @ solved  # what the trend adds
        more = (short * np.linalg.solve(weights, short)).sum(axis=0)
        variance = prior - (across.T * solved).sum(axis=0) + more
        return mean, np.sqrt(np.maximum(variance, 0.0))


def _smooth(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Squared exponential of the distances (n, m) between scaled points (n, d) and (m, d)."""
    return np.asarray(np.exp(-((a[:, None] - b) ** 2).sum(axis=2) / 2))
