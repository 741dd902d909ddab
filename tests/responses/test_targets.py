"""Errors of targets, and what counts as met."""

import numpy as np
import pytest

from calibrator.case.problem import Problem, Target
from calibrator.errors import CalibratorError
from calibrator.responses.targets import (
    bands,
    met,
    relative_errors,
    target_columns,
    target_errors,
)
from tests.reference_paper import INDIVIDUALS, PAPER, PARAMETERS, VERIFIED, Constant, value
from tests.toy_problem import problem as toy_problem


def test_relative_errors_are_the_terms_of_the_error_in_the_order_of_the_targets():
    errors = relative_errors(PAPER, VERIFIED)
    np.testing.assert_allclose(errors[1], [0.0022, 0.0091, 0.0157], atol=1e-4)
    np.testing.assert_allclose(errors.sum(axis=1), value("error", PAPER, INDIVIDUALS, VERIFIED))


def test_target_without_interpolated_response_is_refused():
    with pytest.raises(CalibratorError, match=r"hourglass.emptying_time is not interpolated"):
        target_columns(
            Problem(PARAMETERS, (Target("hourglass", "emptying_time", 1.0),)), Constant.responses
        )
    assert target_columns(PAPER, Constant.responses) == [1, 2, 0]


def test_target_without_scatter_is_known_to_half_its_tolerance():
    targets = (
        Target("hourglass", "bulk_density", 1600.0, scatter=10, replicates=4),
        Target("ledge", "bulk_density", 1500.0, tolerance=0.02),
    )
    errors, assumed = target_errors(Problem(PARAMETERS, targets))
    np.testing.assert_allclose(errors, [5, 15])
    assert assumed == ("ledge.bulk_density",)


def test_target_with_neither_scatter_nor_tolerance_is_refused():
    with pytest.raises(CalibratorError, match="neither scatter nor tolerance"):
        target_errors(
            Problem(PARAMETERS, (Target("hourglass", "bulk_density", 1600.0, tolerance=0),))
        )


def test_band_is_the_tolerance_but_never_less_than_two_standard_errors_of_both_means():
    targets = toy_problem(tolerance=0.03).targets
    np.testing.assert_allclose(bands(targets, np.array([1.0, 5.0]), 1), [3, 10])
    np.testing.assert_allclose(bands(targets, np.array([1.0, 5.0]), 25), [3, 6])
    measured = toy_problem(tolerance=0.03, scatter=12.0, replicates=16).targets
    np.testing.assert_allclose(bands(measured, np.array([8.0, 8.0]), 4), [10, 10])


def test_the_band_of_a_target_near_zero_comes_from_the_measurement():
    near = Target("hourglass", "drained_asymmetry_deg", 0.05, scatter=1.0, replicates=16)
    assert near.scale == pytest.approx(2 * 0.25 / 0.03)
    zero = Target("hourglass", "drained_asymmetry_deg", 0.0, scatter=1.0, replicates=16)
    for target in (near, zero):
        np.testing.assert_allclose(bands([target], np.zeros(1), 1), [0.5])
    with pytest.raises(CalibratorError, match="give its scatter"):
        Target("hourglass", "drained_asymmetry_deg", 0.0)


def test_what_has_no_value_is_not_met():
    targets = toy_problem(tolerance=0.03).targets
    found = met(targets, np.array([[100.0, np.nan], [104.0, 205.0]]), np.zeros(2), 1)
    np.testing.assert_array_equal(found, [[True, False], [False, True]])
