"""Objectives against the reference paper's tables and formulas."""

import itertools

import numpy as np
import pytest

from calibrator.case.physics import rayleigh_time, time_step_warning
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.errors import CalibratorError
from calibrator.responses.objectives import OBJECTIVES, evaluation, objective
from calibrator.responses.targets import relative_errors, target_columns, target_errors

PARAMETERS = (
    Parameter("rolling_friction", 0.1, 0.5),
    Parameter("sliding_friction", 0.2, 0.7),
    Parameter("particle_radius", 0.3e-3, 0.4e-3),
    Parameter("particle_density", 2600.0, 2800.0),
    Parameter("young_modulus", 5e6, 500e6),
)
ANGLE, TIME, DENSITY = (
    "hourglass.drained_angle_of_repose_deg",
    "hourglass.discharge_time",
    "hourglass.bulk_density",
)
TARGETS = (
    Target("hourglass", "drained_angle_of_repose_deg", 41.57),
    Target("hourglass", "discharge_time", 6.56),
    Target("hourglass", "bulk_density", 1530.0),
)
PAPER = Problem(PARAMETERS, TARGETS)
FRICTIONS = Problem(PARAMETERS[:2], TARGETS)
INDIVIDUALS = np.array(
    [
        [0.429, 0.351, 0.4e-3, 2712.16, 4.96e7],
        [0.395, 0.377, 0.4e-3, 2741.0, 3.47e7],
        [0.361, 0.403, 0.4e-3, 2770.0, 1.98e7],
        [0.327, 0.429, 0.4e-3, 2800.0, 5e6],
    ]
)  # Table 6
O2 = [0.5294, 0.3529, 0.1765, 0.0]
VERIFIED = {
    ANGLE: np.array([41.60, 41.66, 41.66, 41.71]),
    TIME: np.array([6.54, 6.62, 6.64, 6.66]),
    DENSITY: np.array([1531.0, 1554.0, 1586.0, 1594.0]),
}  # Table 7


class Constant:
    """An interpolant that predicts the targets of Table 3 everywhere."""

    responses = [DENSITY, ANGLE, TIME]

    def predict(self, points):
        return np.tile([1530.0, 41.57, 6.56], (len(points), 1))


def value(name, problem, points, responses=None):
    return OBJECTIVES[name](problem, problem.columns(points), responses or {})


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


def test_relative_errors_are_the_terms_of_the_error_in_the_order_of_the_targets():
    errors = relative_errors(PAPER, VERIFIED)
    np.testing.assert_allclose(errors[1], [0.0022, 0.0091, 0.0157], atol=1e-4)
    np.testing.assert_allclose(errors.sum(axis=1), value("error", PAPER, INDIVIDUALS, VERIFIED))


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


def test_rayleigh_time_follows_its_formula():
    columns = {
        "particle_radius": 1e-3,
        "particle_density": 2500.0,
        "young_modulus": 2.6e7,
        "poisson_ratio": 0.3,
    }
    assert float(rayleigh_time(columns)) == pytest.approx(
        np.pi * 1e-3 * np.sqrt(2500 / 1e7) / 0.9255, rel=1e-9
    )


def test_rayleigh_cost_is_one_at_the_cheapest_corner_and_the_ratio_of_times_elsewhere():
    points = np.vstack([INDIVIDUALS, [0.1, 0.2, 0.3e-3, 2600.0, 500e6]])
    cost, times = value("rayleigh_cost", PAPER, points), rayleigh_time(PAPER.columns(points))
    assert cost[3] == pytest.approx(1) and (cost >= 1 - 1e-12).all()
    np.testing.assert_allclose(cost, times[3] / times)


def test_rayleigh_cost_is_one_where_only_frictions_are_calibrated():
    cost = value("rayleigh_cost", FRICTIONS, np.array([[0.1, 0.2], [0.5, 0.7]]))
    assert cost.shape == (2,)
    np.testing.assert_allclose(cost, 1)


def test_time_step_above_two_fifths_of_the_shortest_rayleigh_time_warns_with_share_and_remedy():
    columns = PAPER.columns(np.vstack([INDIVIDUALS, [0.1, 0.2, 0.3e-3, 2600.0, 500e6]]))
    limit = 0.4 * rayleigh_time(columns).min()
    assert time_step_warning(0.999 * limit, columns) is None
    assert "40%" in time_step_warning(1.001 * limit, columns)
    # the paper's step, in the stiffest corner of its own box
    warning = time_step_warning(2e-6, columns)
    assert "53%" in warning and "lower it to 1.5e-06 s" in warning


def test_evaluation_maps_points_to_the_named_objectives():
    evaluate = evaluation(PAPER, Constant(), ("time_cost", "error", "rayleigh_cost"))
    found = evaluate(INDIVIDUALS)
    np.testing.assert_allclose(found[:, 0], value("time_cost", PAPER, INDIVIDUALS))
    np.testing.assert_array_equal(found[:, 1], 0)
    assert found.shape == (4, 3)


def test_unknown_objective_is_answered_with_the_nearest_name():
    with pytest.raises(CalibratorError, match="did you mean time_cost"):
        evaluation(PAPER, Constant(), ("error", "time_costs"))


def test_target_without_interpolated_response_is_refused():
    with pytest.raises(CalibratorError, match="hourglass.emptying_time is not interpolated"):
        target_columns(
            Problem(PARAMETERS, (Target("hourglass", "emptying_time", 1.0),)), Constant.responses
        )
    assert target_columns(PAPER, Constant.responses) == [1, 2, 0]


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
