"""Targets against responses: columns, errors, and what counts as met."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import log_ndtr

from calibrator.case.problem import Problem, Target
from calibrator.errors import CalibratorError

Responses = Mapping[str, np.ndarray]


def target_columns(problem: Problem, responses: Sequence[str]) -> list[int]:
    """Column of each target among the interpolated responses, t indices.

    Raises CalibratorError that names one that is missing.
    """
    responses = list(responses)
    missing = [target.key for target in problem.targets if target.key not in responses]
    if missing:
        raise CalibratorError(
            f"the response of target {missing[0]} is not interpolated: add runs of its set-up that"
            " measure it"
        )
    return [responses.index(target.key) for target in problem.targets]


def target_errors(problem: Problem) -> tuple[np.ndarray, tuple[str, ...]]:
    """Standard error of each target (t,), and the keys for which it had to be assumed.

    A target without scatter is taken to be known to half its tolerance, so that its tolerance is
    two standard errors. Raises CalibratorError for a target with neither.
    """
    assumed = tuple(target.key for target in problem.targets if target.standard_error == 0)
    errors = np.array([t.standard_error or t.tolerance * t.scale / 2 for t in problem.targets])
    if not errors.all():
        key = problem.targets[int(np.argmin(errors))].key
        raise CalibratorError(
            f"target {key} has neither scatter nor tolerance: give at least one of them"
        )
    return errors, assumed


def relative_errors(problem: Problem, responses: Responses) -> np.ndarray:
    """Terms |y_i - t_i| over the target's scale, (n, t), of the paper's Eq. (3)."""
    return np.column_stack([np.abs(responses[t.key] - t.value) / t.scale for t in problem.targets])


def bands(targets: Sequence[Target], noise: np.ndarray, runs: int | np.ndarray) -> np.ndarray:
    """Half width (t,) around each target within which a mean response counts as meeting it.

    The tolerance of the target's scale, but no less than two standard errors of the difference
    between a measured mean and the mean of so many runs: max(tolerance x scale, 2 hypot(standard
    error measured, noise / sqrt(runs))). This is the one definition of "met"; plan, search,
    verification, validation and report all ask here.

    Parameters
    ----------
    noise : (t,) seed noise of a single run in the response's unit; zero, or any number of runs
        without end, for a response that is known without seed noise
    runs : number of runs behind the mean, one for all or (t,)

    Examples
    --------
    >>> flow = Target("hourglass", "mass_flow_rate", 0.5, tolerance=0.02)
    >>> bands([flow], np.array([0.0]), 1).tolist()
    [0.01]
    >>> bands([flow], np.array([0.04]), 16).tolist()
    [0.02]
    """
    tolerated = np.array([t.tolerance * t.scale for t in targets])
    measured = np.array([t.standard_error for t in targets])
    return np.asarray(np.maximum(tolerated, 2 * np.hypot(measured, noise / np.sqrt(runs))))


def met(
    targets: Sequence[Target], means: np.ndarray, noise: np.ndarray, runs: int | np.ndarray
) -> np.ndarray:
    """Whether mean responses (..., t) lie within the bands of their targets; NaN is missed.

    >>> flow = Target("hourglass", "mass_flow_rate", 0.5, tolerance=0.02)
    >>> met([flow], np.array([[0.495], [0.52], [np.nan]]), np.array([0.0]), 1).tolist()
    [[True], [False], [False]]
    """
    values = np.array([t.value for t in targets])
    return np.asarray(np.abs(means - values) <= bands(targets, noise, runs))


def chances(
    targets: Sequence[Target], mean: np.ndarray, error: np.ndarray, noise: np.ndarray, runs: int
) -> np.ndarray:
    """Logarithm (k,) of the probability that the mean of so many runs meets every target.

    mean, error : (k, t) prediction and its standard deviation; noise : (t,) of one run. The
    responses are taken as independent and normal.
    """
    spread = np.hypot(error, noise / math.sqrt(runs))
    return log_within(targets, mean, spread, bands(targets, noise, runs))


def log_within(
    targets: Sequence[Target], mean: np.ndarray, spread: np.ndarray, band: np.ndarray
) -> np.ndarray:
    """Logarithm (k,) of the probability that normal values lie within all the bands (t,).

    mean, spread : (k, t) of the values.
    """
    offset = np.abs(mean - np.array([t.value for t in targets]))
    spread = np.maximum(spread, 1e-300)
    # log(Phi(b) - Phi(a)) on the lower tail, where neither term rounds to one
    ends = log_ndtr(np.array([band - offset, -band - offset]) / spread)
    upper, lower = np.maximum(ends, -1e300)  # far outside both are -inf, and have no difference
    with np.errstate(divide="ignore"):  # the logarithm of zero is what it says
        rest = np.log1p(-np.exp(np.minimum(lower - upper, -1e-300)))
    return np.asarray((upper + rest).sum(axis=1))
