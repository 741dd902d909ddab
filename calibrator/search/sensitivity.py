"""What each parameter does to each response over the whole box: Sobol indices.

They are those of the interpolated responses, with intervals. Sobol, Global sensitivity indices for
nonlinear mathematical models and their Monte Carlo estimates, Math. Comput. Simul. 55 (2001)
271-280; the estimators are scipy's (Saltelli et al., Comput. Phys. Commun. 181 (2010) 259-270).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.stats import sobol_indices, uniform

from calibrator.case.problem import Problem
from calibrator.responses.interpolant import Interpolant
from calibrator.search.parts import Sensitivity

SAMPLES = 2**9  # per matrix of Saltelli's scheme: (d + 2) times as many predictions

# Of the scheme, each with a Sobol sequence scrambled anew: their scatter is the sampling error.
REPEATS = 8
TWO_SIDED_95 = 1.96


def sensitivity(
    problem: Problem, interpolant: Interpolant, without: Sequence[Interpolant] = (), seed: int = 1
) -> Sensitivity:
    """Sobol indices of an interpolant.

    Parameters
    ----------
    without : interpolants that each lack one of as many equal parts of the parameter sets. Their
        scatter says, as a jackknife, how much the indices owe to the sets that happened to be run;
        without them an interval holds the sampling error only.
    seed : of the sequences' scrambling
    """
    indices, sampling = _indices(problem, interpolant, seed)
    parts = [_indices(problem, one, seed)[0] for one in without]
    spread = _jackknife(np.array(parts)) if len(parts) > 1 else np.zeros_like(indices)
    first_error, total_error = TWO_SIDED_95 * np.hypot(sampling, spread)
    return Sensitivity(
        tuple(interpolant.responses),
        tuple(problem.names),
        indices[0],
        indices[1],
        first_error,
        total_error,
    )


def _indices(
    problem: Problem, interpolant: Interpolant, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices (2, m, d), and their standard errors from the finite sample."""
    dimensions, count = len(problem.parameters), len(interpolant.responses)

    def responses(shares: np.ndarray) -> np.ndarray:
        # each twice: of a single response to a single parameter scipy makes a number, and fails
        return np.tile(interpolant.predict(problem.values_at(shares.T)).T, (2, 1))

    repeats = []
    for rng in np.random.default_rng(seed).spawn(REPEATS):
        found = sobol_indices(func=responses, n=SAMPLES, dists=[uniform()] * dimensions, rng=rng)
        both = np.reshape([found.first_order, found.total_order], (2, -1, dimensions))
        repeats.append(both[:, :count])
    return np.mean(repeats, axis=0), np.std(repeats, axis=0, ddof=1) / math.sqrt(REPEATS)


def _jackknife(parts: np.ndarray) -> np.ndarray:
    """Standard error of an estimate from its values (k, ...) with each of k parts left out.

    Tukey's delete-a-group jackknife.
    """
    k = len(parts)
    squares = ((parts - parts.mean(axis=0)) ** 2).sum(axis=0)
    return np.asarray(math.sqrt((k - 1) / k) * np.sqrt(squares))
