"""The covariance of a Gaussian process, and the likeliest of its kind for some runs.

Maximum likelihood alone fits some dozen numbers to hardly more runs where there are many
parameters, and then claims a fraction of its error. So length scales and amplitude have a prior:
the most probable values are sought (Rasmussen & Williams, Gaussian Processes for Machine Learning,
2006, Eq. 5.8, plus the logarithm of the prior). benchmarks/numerics/claims.py measures what is
claimed.
"""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, DotProduct, Matern, WhiteKernel

# Variance of the trend's slopes, of the standardised response per half range: broad, as a response
# that is all trend along one parameter has a slope of 1.7.
TREND_VARIANCE = 1.0

# In half ranges: 15-60 points cannot resolve less than a quarter of a range.
LENGTH_SCALES = (0.5, 20.0)

# Normal priors of logarithms: a length of 1.5 half ranges within a factor of 1.6, and e times the
# response's variance within a factor of e. The scale of both is the response's own, so that no unit
# enters; a few dozen points outweigh them.
LENGTH_PRIOR = (math.log(1.5), 0.5)
AMPLITUDE_PRIOR = (1.0, 1.0)

# Of the standardised variance: keeps the covariance invertible where the noise is measured as zero.
JITTER = 1e-8


class _Regressor(GaussianProcessRegressor):  # type: ignore[misc]
    """A regressor whose search adds the priors to the likelihood."""

    def log_marginal_likelihood(
        self, theta: Any = None, eval_gradient: bool = False, clone_kernel: bool = True
    ) -> Any:
        """Logarithm of likelihood times prior, with its gradient where that is asked for."""
        found = super().log_marginal_likelihood(theta, eval_gradient, clone_kernel)
        if theta is None:
            return found
        lengths = self.X_train_.shape[1]
        mean = np.array([AMPLITUDE_PRIOR[0], *[LENGTH_PRIOR[0]] * lengths])
        width = np.array([AMPLITUDE_PRIOR[1], *[LENGTH_PRIOR[1]] * lengths])
        off = (theta[: lengths + 1] - mean) / width
        prior = -0.5 * float(off @ off)
        if not eval_gradient:
            return found + prior
        slope = np.zeros(len(theta))
        slope[: lengths + 1] = -off / width
        return found[0] + prior, found[1] + slope


def kernel_of(dimensions: int) -> Any:
    """The kernel before its hyperparameters are sought."""
    smooth = ConstantKernel(1.0, (1e-3, 1e3)) * Matern(np.ones(dimensions), LENGTH_SCALES, nu=2.5)
    return smooth + ConstantKernel(TREND_VARIANCE, "fixed") * DotProduct(1.0, "fixed")


def matern(a: np.ndarray, b: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Matern 5/2 correlations (n, m) of points (n, d) and (m, d); lengths : (d,) scales."""
    return np.asarray(Matern(lengths, nu=2.5)(a, b))


def likeliest_with_noise(
    unit: np.ndarray, standard: np.ndarray, restarts: int, seed: int
) -> tuple[Any, float]:
    """Most probable kernel and seed noise together, from single runs.

    unit (n, d), standard (n,) : points in half ranges, standardised responses. Replicates, where
    there are some, speak through them.
    """
    kernel = kernel_of(unit.shape[1]) + WhiteKernel(0.01, (1e-6, 1.0))
    found = likeliest(kernel, unit, standard, JITTER, restarts, seed)
    return found.k1, math.sqrt(found.k2.noise_level)


def likeliest(
    kernel: Any, unit: np.ndarray, standard: np.ndarray, alpha: Any, restarts: int, seed: int
) -> Any:
    """The kernel with the most probable hyperparameters; alpha : variance of each value (n,)."""
    search = _Regressor(kernel, alpha=alpha, n_restarts_optimizer=restarts, random_state=seed)
    with warnings.catch_warnings():
        # a parameter without influence rightly drives its length scale to the bound
        warnings.simplefilter("ignore", ConvergenceWarning)
        return search.fit(unit, standard).kernel_
