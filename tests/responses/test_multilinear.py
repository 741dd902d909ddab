"""The multilinear interpolant against functions that it reproduces."""

import numpy as np
import pytest

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.errors import CalibratorError
from calibrator.responses.fit import fit_responses
from calibrator.responses.multilinear import Multilinear
from tests.responses.known_functions import (
    HIGH,
    LOW,
    NOISE,
    bilinear,
    grid,
    inside,
    multilinear,
    smooth,
)


def test_multilinear_reproduces_a_multilinear_function_exactly():
    model, points = multilinear(grid(3, 4), bilinear(grid(3, 4))), inside(200)
    np.testing.assert_allclose(model.predict(points), bilinear(points), rtol=1e-12)
    assert model.responses == ["a", "b"]


def test_multilinear_does_not_depend_on_the_order_of_the_runs():
    points = grid(3, 4)
    shuffled = points[np.random.default_rng(3).permutation(len(points))]
    np.testing.assert_array_equal(
        multilinear(points, smooth(points)).predict(inside(20)),
        multilinear(shuffled, smooth(shuffled)).predict(inside(20)),
    )


def test_multilinear_passes_through_the_mean_of_replicates():
    points = np.repeat(grid(2, 2), 2, axis=0)
    values = np.column_stack([np.arange(8.0), np.arange(8.0) ** 2])
    np.testing.assert_allclose(
        multilinear(points, values).predict(grid(2, 2)), values.reshape(4, 2, 2).mean(axis=1)
    )


def test_multilinear_names_the_missing_grid_point():
    points = np.delete(grid(3, 3), 4, axis=0)
    with pytest.raises(
        CalibratorError, match=r"1 of 9 points .*rolling_friction = 0.3, young_modulus = 2.525e\+08"
    ):
        multilinear(points, smooth(points))


def test_multilinear_refuses_a_scattered_design_without_listing_its_whole_grid():
    points = np.random.default_rng(0).random((40, 8))
    with pytest.raises(CalibratorError, match="not a full grid"):
        Multilinear.fit(points, points[:, :1], ["a"])


def test_multilinear_names_an_unmeasured_response():
    values = smooth(grid(2, 2))
    values[2, 1] = np.nan
    with pytest.raises(
        CalibratorError,
        match=r"b was not measured .*rolling_friction = 0.5, young_modulus = 5e\+06",
    ):
        multilinear(grid(2, 2), values)


def test_multilinear_refuses_an_axis_with_one_value():
    points = grid(3, 2)[::2]
    with pytest.raises(CalibratorError, match="young_modulus has the single value"):
        multilinear(points, smooth(points))


def test_multilinear_error_is_seed_noise_averaged_over_the_surrounding_runs():
    points = np.repeat(grid(2, 2), 4, axis=0)
    model = multilinear(points, bilinear(points), noise=NOISE)
    corner, edge, centre = model.predict_with_error(np.array([LOW, [0.3, 5e6], (LOW + HIGH) / 2]))[
        1
    ]
    np.testing.assert_allclose(corner, NOISE / 2)
    np.testing.assert_allclose(edge, NOISE / 2 / np.sqrt(2))
    np.testing.assert_allclose(centre, NOISE / 2 / 2)


def test_multilinear_without_replicates_says_that_it_knows_no_noise():
    model = multilinear(grid(2, 2), bilinear(grid(2, 2)))
    assert model.noise_source == "none"
    assert np.isnan(model.noise).all() and not model.predict_with_error(inside(3))[1].any()


def test_dropped_lines_show_the_curvature_of_each_axis():
    points = grid(5, 4)
    u, v = ((points - LOW) / (HIGH - LOW)).T
    model = Multilinear.fit(points, np.column_stack([u**2, u + v + u * v]), ["curved", "bilinear"])
    error = model.leave_one_out()[0] - model.values
    inner, corner = (u > 0) & (u < 1), np.isin(u, (0, 1)) & np.isin(v, (0, 1))
    # spacing squared: half the second derivative times it
    np.testing.assert_allclose(error[inner, 0], 0.25**2)
    np.testing.assert_allclose(error[~corner, 1], 0, atol=1e-12)
    assert np.isnan(error[corner]).all() and corner.sum() == 4


def test_dropped_lines_of_an_uneven_grid_are_bridged_in_proportion():
    points = np.array([[0.0], [1.0], [4.0], [5.0]])
    model = Multilinear.fit(
        points, np.hstack([2 * points, points**2]), ["straight", "curved"], noise=np.zeros(2)
    )
    predictions = model.leave_one_out()[0]
    # chords 0-4 and 1-5 of the square at 1 and 4
    np.testing.assert_allclose(predictions[1:3], [[2, 4], [8, 19]])


def test_dropped_line_scatter_contains_own_and_neighbours_noise():
    model = Multilinear.fit(
        np.array([[0.0], [1.0], [2.0]]), np.zeros((3, 1)), ["a"], noise=np.array([2.0])
    )
    np.testing.assert_allclose(model.leave_one_out()[1][1], 2 * np.sqrt(1 + 0.25 + 0.25))


@pytest.mark.parametrize("values", [np.zeros((9, 3)), np.full((9, 2), np.inf)])
def test_values_of_the_wrong_shape_or_infinite_are_refused(values):
    with pytest.raises(CalibratorError):
        multilinear(grid(3, 3), values)


def test_a_grid_of_which_no_run_went_well_beyond_a_value_says_so():
    """It is a whole grid, only of a smaller box: the search would leave it."""
    problem = Problem(
        (Parameter("rolling_friction", 0.1, 0.5), Parameter("sliding_friction", 0.2, 0.7)),
        (Target("hourglass", "bulk_density", 1600.0),),
    )
    points = np.array([[r, s] for r in (0.1, 0.3) for s in (0.2, 0.7)])  # 0.5 clogged everywhere
    with pytest.raises(CalibratorError, match=r"only from 0\.1 to 0\.3: narrow its bounds"):
        fit_responses(problem, points, points[:, :1], ["hourglass.bulk_density"], "multilinear")
