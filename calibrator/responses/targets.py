"""Targets against responses: columns, errors, and what counts as met."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calibrator.case.problem import Problem
from calibrator.errors import CalibratorError

Responses = Mapping[str, np.ndarray]


def target_columns(problem: Problem, responses: Sequence[str]) -> list[int]:
    """Column of each target among the interpolated responses, t indices;

    CalibratorError names one that is missing.
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
    errors = np.array(
        [
            target.standard_error or target.tolerance * abs(target.value) / 2
            for target in problem.targets
        ]
    )
    if not errors.all():
        key = problem.targets[int(np.argmin(errors))].key
        raise CalibratorError(
            f"target {key} has neither scatter nor tolerance: give at least one of them"
        )
    return errors, assumed


def relative_errors(problem: Problem, responses: Responses) -> np.ndarray:
    """|y_i - t_i| / |t_i| of each target, shape (n, t): the terms of the paper's Eq. (3)."""
    return np.column_stack(
        [np.abs(responses[t.key] - t.value) / abs(t.value) for t in problem.targets]
    )


def bands(problem: Problem, noise: Mapping[str, float]) -> np.ndarray:
    """Half width (t,) within which a prediction counts as met: the tolerance, but no less than two
    seed noises.
    """
    return np.array([max(t.tolerance * abs(t.value), 2 * noise[t.key]) for t in problem.targets])
