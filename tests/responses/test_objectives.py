"""Objectives against the reference paper's tables and formulas."""

import itertools

import numpy as np
import pytest

from calibrator.case.physics import rayleigh_time
from calibrator.case.problem import Problem, Target
from calibrator.errors import CalibratorError
from calibrator.responses.objectives import OBJECTIVES, evaluation, objective
from calibrator.responses.targets import relative_errors
from tests.reference_paper import (
    FRICTIONS,
    INDIVIDUALS,
    O2,
    PAPER,
    PARAMETERS,
    TARGETS,
    VERIFIED,
    Constant,
    value,
)


def test_time_cost_is_that_of_table_6_within_its_rounding():
    np.testing.assert_allclose(value("time_cost", PAPER, INDIVIDUALS), O2, atol=0.004)


def test_time_cost_of_the_encoded_individuals_is_that_of_table_6_to_every_digit():
    # the 8-bit codes behind the rounded densities and moduli of Table 6
    points = INDIVIDUALS.copy()
    points[:, 3] = 2600 + 200 * np.array([143, 180, 217, 255]) / 255
    points[:, 4] = 5e6 + 495e6 * np.array([23, 15, 7, 0]) / 255
    np.testing.assert_allclose(value("time_cost", PAPER, points), O2, atol=5e-5)


def test_time_cost_spans_zero_to_three_over_the_corners():
    corners = np.array(list(itertools.product(*zip(PAPER.low, PAPER.high, strict=True))))
    cost = value("time_cost", PAPER, corners)
    np.testing.assert_allclose(corners[cost.argmin(), 2:], [0.4e-3, 2800, 5e6])
    np.testing.assert_allclose(corners[cost.argmax(), 2:], [0.3e-3, 2600, 500e6])
    assert cost.min() == pytest.approx(0, abs=1e-12) and cost.max() == pytest.approx(3)


def test_time_cost_counts_only_calibrated_parameters():
    soft = Problem((PARAMETERS[0], PARAMETERS[4]), TARGETS)
    np.testing.assert_allclose(
        value("time_cost", soft, np.array([[0.1, 5e6], [0.1, 500e6], [0.5, 252.5e6]])), [0, 1, 0.5]
    )
    np.testing.assert_array_equal(
        value("time_cost", FRICTIONS, np.array([[0.1, 0.2], [0.5, 0.7]])), [0, 0]
    )


def test_error_of_the_verified_individuals_is_that_of_table_7():
    np.testing.assert_allclose(
        value("error", PAPER, INDIVIDUALS, VERIFIED), [0.0045, 0.0270, 0.0510, 0.0605], atol=1.5e-4
    )


def test_weights_multiply_the_terms_of_the_error():
    weighted = Problem(
        PARAMETERS,
        tuple(
            Target(t.setup, t.response, t.value, weight=w)
            for t, w in zip(TARGETS, (2, 0, 1), strict=True)
        ),
    )
    errors = relative_errors(PAPER, VERIFIED)
    np.testing.assert_allclose(
        value("error", weighted, INDIVIDUALS, VERIFIED), 2 * errors[:, 0] + errors[:, 2]
    )


def test_negative_target_gives_a_positive_error():
    curved = Problem(PARAMETERS[:2], (Target("hourglass", "drained_curvature", -10.0),))
    assert value(
        "error", curved, np.array([[0.1, 0.2]]), {"hourglass.drained_curvature": np.array([-12.0])}
    ) == pytest.approx(0.2)


def test_rayleigh_cost_is_one_at_the_cheapest_corner_and_the_ratio_of_times_elsewhere():
    points = np.vstack([INDIVIDUALS, [0.1, 0.2, 0.3e-3, 2600.0, 500e6]])
    cost, times = value("rayleigh_cost", PAPER, points), rayleigh_time(PAPER.columns(points))
    assert cost[3] == pytest.approx(1) and (cost >= 1 - 1e-12).all()
    np.testing.assert_allclose(cost, times[3] / times)


def test_rayleigh_cost_is_one_where_only_frictions_are_calibrated():
    cost = value("rayleigh_cost", FRICTIONS, np.array([[0.1, 0.2], [0.5, 0.7]]))
    assert cost.shape == (2,)
    np.testing.assert_allclose(cost, 1)


def test_evaluation_maps_points_to_the_named_objectives():
    evaluate = evaluation(PAPER, Constant(), ("time_cost", "error", "rayleigh_cost"))
    found = evaluate(INDIVIDUALS)
    np.testing.assert_allclose(found[:, 0], value("time_cost", PAPER, INDIVIDUALS))
    np.testing.assert_array_equal(found[:, 1], 0)
    assert found.shape == (4, 3)


def test_unknown_objective_is_answered_with_the_nearest_name():
    with pytest.raises(CalibratorError, match="did you mean time_cost"):
        evaluation(PAPER, Constant(), ("error", "time_costs"))


def test_registered_objective_serves_by_its_name_and_names_are_unique():
    @objective("softness", symbol="S", about="for this test")
    def softness(problem, columns, responses):
        return columns["young_modulus"]

    try:
        np.testing.assert_array_equal(
            evaluation(PAPER, Constant(), ["softness"])(INDIVIDUALS)[:, 0], INDIVIDUALS[:, 4]
        )
        with pytest.raises(CalibratorError, match="called softness exists"):
            objective("softness", symbol="S", about="again")(softness)
    finally:
        del OBJECTIVES["softness"]
