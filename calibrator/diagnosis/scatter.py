"""How runs scatter about their surfaces: seed noise, where it is larger, and lack of fit.

Replicates of a set scatter by their seeds alone; what the residuals have beyond that is what the
surfaces miss (Montgomery, Design and Analysis of Experiments, 8th ed., section 11.4.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

# of the ratio of the variances of lack of fit and seed noise: values, and means of its prior
RATIOS = np.r_[0.0, np.geomspace(0.01, 30, 200)]
MEANS = np.geomspace(0.01, 3, 40)
# spread of the slopes of the log variance, per half range: over a range of one parameter, the
# variance then changes by a factor of four
STEEPNESS = 0.7
LEAST_FREE = 1e-6  # of a set's own weight in its residual: one with less says nothing of the others


@dataclass(frozen=True, eq=False)
class Replicates:
    """Runs of the same sets.

    Attributes
    ----------
    sets : (s, c) what distinguishes them.
    index : (m,) of each run's set.
    counts : (s,) runs of each.
    squares : (s, n) sums of squares of the values about each set's mean.
    """

    sets: np.ndarray
    index: np.ndarray
    counts: np.ndarray
    squares: np.ndarray

    @classmethod
    def of(cls, sets: np.ndarray, values: np.ndarray) -> Replicates:
        """Group runs (m, n) by their sets (m, c)."""
        own, index, counts = np.unique(sets, axis=0, return_inverse=True, return_counts=True)
        means = np.array([values[index == i].mean(axis=0) for i in range(len(counts))])
        apart = (values - means[index]) ** 2
        squares = np.array([apart[index == i].sum(axis=0) for i in range(len(counts))])
        return cls(own, index, counts, squares)

    @property
    def degrees(self) -> int:
        """Degrees of freedom of the scatter within sets."""
        return int(self.counts.sum() - len(self.counts))

    @property
    def variance(self) -> np.ndarray:
        """Pooled variance (n,) within sets; nan without replicates."""
        total = self.squares.sum(axis=0)
        return np.asarray(total / self.degrees if self.degrees else np.full_like(total, np.nan))


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Sets of runs, each as the surfaces without it see it.

    Attributes
    ----------
    units, amplitudes : (s, d) and (s, k) of the sets.
    residual : (s, n) means of their runs less what the surfaces without them say.
    counts : (s,) runs of each.
    leverage : (s,) variances of these surfaces at the sets, over that of one run.
    """

    units: np.ndarray
    amplitudes: np.ndarray
    residual: np.ndarray
    counts: np.ndarray
    leverage: np.ndarray

    @classmethod
    def of(
        cls, left: np.ndarray, replicates: Replicates, rows: np.ndarray, inverse: np.ndarray, d: int
    ) -> LeftOut:
        """From residuals (m, n) of runs, the regressors (s, p) of their sets and (X'X + ridge)^-1.

        A set is taken out of a fit in closed form (Cook and Weisberg, Residuals and Influence in
        Regression, 1982, section 2.2). One that alone determines a term is no set
        here: without it there are no surfaces.
        """
        index, counts = replicates.index, replicates.counts
        means = np.array([left[index == i].mean(axis=0) for i in range(len(counts))])
        share = np.einsum("ij,jk,ik->i", rows, inverse, rows)
        free = 1 - counts * share
        good = free > LEAST_FREE
        sets = replicates.sets[good]
        return cls(
            sets[:, :d],
            sets[:, d:],
            means[good] / free[good, None],
            counts[good],
            share[good] / free[good],
        )


def noise_and_misfit(
    left: np.ndarray, spare: int, replicates: Replicates
) -> tuple[np.ndarray, np.ndarray]:
    """Covariance (n, n) of one run about the truth, and variance (n,) of lack of fit.

    left : residuals (m, n) with `spare` degrees of freedom. What is lack of fit is not counted as
    noise once more: where residuals are larger than the scatter of replicates, that is the noise.
    The correlations are those of the residuals. Without replicates all is noise.
    """
    noise, lacking = left.T @ left / spare, spare - replicates.degrees
    if not replicates.degrees or lacking <= 0:
        return noise, np.zeros(left.shape[1])
    within, count = replicates.variance, float(replicates.counts.mean())
    between = np.maximum((left**2).sum(axis=0) - replicates.squares.sum(axis=0), 0.0) / lacking
    with np.errstate(invalid="ignore", divide="ignore"):
        smaller = np.sqrt(np.fmin(within / np.diag(noise), 1.0))
        quotients = np.where(within > 0, between / within, np.inf)
        ratios = _ratios(quotients, lacking, replicates.degrees, count)
        misfit = np.where(np.isfinite(ratios), ratios * within, (between - within) / count)
    return noise * np.outer(smaller, smaller), misfit


def _ratios(quotients: np.ndarray, lacking: int, within: int, count: float) -> np.ndarray:
    """Variances (n,) of lack of fit over those of the noise, of n observables, as expected.

    quotients (n,) : mean squares between and within sets, F-distributed with `lacking` and `within`
    degrees of freedom but for a factor 1 + count * ratio. The ratios are taken to be exponential
    about a mean that makes all quotients most likely (empirical Bayes): cut off at zero one by one,
    as they otherwise would have to be, they add up to a lack of fit where there is none. inf where
    the quotient is beyond all of RATIOS.
    """
    spread = 1 + count * RATIOS
    beyond = ~(quotients < spread[-1])
    own = np.where(beyond, 1.0, quotients)[:, None]
    likelihood = stats.f.pdf(own / spread, lacking, within) / spread
    prior = np.exp(-RATIOS / MEANS[:, None]) * np.gradient(RATIOS)
    prior /= prior.sum(axis=1, keepdims=True)
    evidence = likelihood @ prior.T
    best = prior[np.argmax(np.log(evidence[~beyond]).sum(axis=0))]
    return np.where(beyond, np.inf, (likelihood * best) @ RATIOS / (likelihood @ best))


@dataclass(frozen=True, eq=False)
class Growth:
    """How the variance of runs depends on the parameters: log-linear.

    slopes (d, n) : of the log variance, per half range; level (n,) : its value at the centre, less
    that of the pooled variance.
    """

    slopes: np.ndarray
    level: np.ndarray

    @classmethod
    def none(cls, parameters: int, observables: int) -> Growth:
        """The same variance everywhere."""
        return cls(np.zeros((parameters, observables)), np.zeros(observables))

    @classmethod
    def of(cls, units: np.ndarray, replicates: Replicates) -> Growth:
        """Gamma regression of the variances within sets, whose places are units (s, d).

        McCullagh and Nelder, Generalized Linear Models, 2nd ed., section 10.5. The slopes are taken
        to be normal with a spread of STEEPNESS, as a few dozen of pairs tell little.
        """
        degrees, x = replicates.counts - 1, 2 * units - 1
        if not replicates.degrees:
            return cls.none(x.shape[1], replicates.squares.shape[1])
        columns = [_log_slopes(x, s, degrees) for s in replicates.squares.T]
        slopes = np.array(columns).reshape(-1, x.shape[1]).T
        share = degrees / degrees.sum()
        return cls(slopes, -np.log(share @ np.exp(x @ slopes)))

    def __call__(self, unit: np.ndarray) -> np.ndarray:
        """Variances (n,) at parameters (d,) over the pooled ones; beyond the box as at its edge."""
        x = np.clip(2 * np.asarray(unit) - 1, -1, 1)
        return np.asarray(np.exp(self.level + x @ self.slopes))


def _log_slopes(x: np.ndarray, squares: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Slopes (d,) of the log variance of one observable, at places (s, d) from -1 to 1."""
    pooled = squares.sum() / degrees.sum()
    if pooled <= 0:
        return np.zeros(x.shape[1])
    design, own = np.column_stack([np.ones(len(x)), x]), squares / pooled

    def cost(at: np.ndarray) -> tuple[float, np.ndarray]:
        log = design @ at
        scaled = own * np.exp(-log)
        value = float((degrees * log + scaled).sum() / 2 + (at[1:] ** 2).sum() / 2 / STEEPNESS**2)
        slope = design.T @ (degrees - scaled) / 2
        slope[1:] += at[1:] / STEEPNESS**2
        return value, slope

    found = optimize.minimize(cost, np.zeros(design.shape[1]), jac=True, method="BFGS")
    return np.asarray(found.x[1:])
