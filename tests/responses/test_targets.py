"""Errors of targets, and what counts as met."""

import numpy as np
import pytest

from calibrator.case.problem import Problem, Target
from calibrator.errors import CalibratorError
from calibrator.responses.targets import bands, relative_errors, target_columns, target_errors
from tests.reference_paper import INDIVIDUALS, PAPER, PARAMETERS, VERIFIED, Constant, value
from tests.toy_problem import KEYS
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


def test_band_is_the_tolerance_but_never_less_than_two_seed_noises():
    np.testing.assert_allclose(
        bands(toy_problem(tolerance=0.03), dict(zip(KEYS, (1.0, 5.0), strict=True))), [3, 10]
    )
