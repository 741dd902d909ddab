"""Targets against responses: columns, errors, and what counts as met.

A target of weight 0 is reported and rules nothing: its error and its band are infinite here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import log_ndtr

from calibrator.case.problem import Problem, Target
from calibrator.case.vocabulary import QUANTITIES
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
    two standard errors. One of weight 0 has an infinite error: it says nothing. Raises
    CalibratorError for a target with neither.
    """
    rules = ruling(problem.targets)
    assumed = tuple(
        t.key for t, rule in zip(problem.targets, rules, strict=True) if rule and not t.scatter
    )
    errors = np.array([t.standard_error or t.tolerance * t.scale / 2 for t in problem.targets])
    errors[~rules] = np.inf
    if not errors.all():
        key = problem.targets[int(np.argmin(errors))].key
        raise CalibratorError(
            f"target {key} has neither scatter nor tolerance: give at least one of them"
        )
    return errors, assumed


def ruling(targets: Sequence[Target]) -> np.ndarray:
    """Which targets (t,) have a weight; the others are reported only."""
    return np.array([t.weight > 0 for t in targets], bool)


def repeats(targets: Sequence[Target]) -> np.ndarray:
    """Which targets (t, t) are one quantity by definition: ones there and on the diagonal, else 0.

    Of one run the residual mass, the residual fraction and the equivalent angle are functions of
    each other, so that three of them are one piece of evidence (`repeats` in the contract).
    """
    roots = [(t.experiment, QUANTITIES[t.response].repeats or t.response) for t in targets]
    return np.array([[float(a == b) for b in roots] for a in roots])


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
        without end, for a response that is known without seed noise. NaN where it is not known: the
        laboratory's own scatter then stands in, so that the band never grows with that of the runs
        that it judges
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
    one_run = standing_in(targets, noise)
    found = np.maximum(tolerated, 2 * np.hypot(measured, one_run / np.sqrt(runs)))
    return np.where(ruling(targets), found, np.inf)


def standing_in(targets: Sequence[Target], noise: np.ndarray) -> np.ndarray:
    """Seed noise (t,), and where it is NaN, not known, the scatter of one measurement instead."""
    return np.where(np.isnan(noise), [t.scatter for t in targets], noise)


def met(
    targets: Sequence[Target], means: np.ndarray, noise: np.ndarray, runs: int | np.ndarray
) -> np.ndarray:
    """Whether mean responses (..., t) lie within the bands of their targets; NaN is missed.

    A target of weight 0 is never missed, as it rules nothing.

    >>> flow = Target("hourglass", "mass_flow_rate", 0.5, tolerance=0.02)
    >>> met([flow], np.array([[0.495], [0.52], [np.nan]]), np.array([0.0]), 1).tolist()
    [[True], [False], [False]]
    """
    values = np.array([t.value for t in targets])
    near = np.abs(means - values) <= bands(targets, noise, runs)
    return np.asarray(near | ~ruling(targets))


def chances(
    targets: Sequence[Target], mean: np.ndarray, error: np.ndarray, noise: np.ndarray, runs: int
) -> np.ndarray:
    """Logarithm (k,) of the probability that the mean of so many runs meets every target.

    mean, error : (k, t) prediction and its standard deviation; noise : (t,) of one run, NaN where
    it is not known (see `bands`). The responses are taken as independent and normal.
    """
    spread = np.hypot(error, standing_in(targets, noise) / math.sqrt(runs))
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
