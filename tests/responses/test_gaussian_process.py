"""Interpolants against functions whose values, noise and errors can be written down."""

import itertools

import numpy as np
import pytest
from scipy.stats import qmc
from sklearn.gaussian_process import GaussianProcessRegressor

from calibrator.errors import CalibratorError
from calibrator.responses.box import box_sample
from calibrator.responses.gaussian_process import FEWEST_DEGREES, JITTER, GaussianProcess
from calibrator.responses.interpolant import average_replicates, seed_noise
from calibrator.responses.multilinear import Multilinear

LOW, HIGH = np.array([0.1, 5e6]), np.array([0.5, 5e8])
BOUNDS = np.array([LOW, HIGH])
PARAMETERS = ["rolling_friction", "young_modulus"]
NOISE = np.array([0.3, 2.0])


def smooth(points):
    u, v = ((points - LOW) / (HIGH - LOW)).T
    return np.column_stack(
        [25 + 12 * np.tanh(2 * u) + 3 * u * v, 1500 - 80 * u + 30 * np.sin(2 * v)]
    )


def bilinear(points):
    u, v = ((points - LOW) / (HIGH - LOW)).T
    return np.column_stack([1 + 2 * u - 3 * v + 4 * u * v, 7 - u + u * v])


def grid(*samples):
    axes = [
        np.linspace(low, high, count) for low, high, count in zip(LOW, HIGH, samples, strict=True)
    ]
    return np.array(list(itertools.product(*axes)))


def inside(count, seed=5):
    return LOW + (HIGH - LOW) * np.random.default_rng(seed).random((count, 2))


def design(count):
    return LOW + (HIGH - LOW) * qmc.Sobol(2, scramble=False).random(2**10)[1 : count + 1]


def noisy_runs(count, replicates, seed=1):
    points = np.repeat(design(count), replicates, axis=0)
    return points, smooth(points) + NOISE * np.random.default_rng(seed).normal(
        size=(len(points), 2)
    )


def process(points, values, **options):
    return GaussianProcess.fit(points, values, ["a", "b"], BOUNDS, parameters=PARAMETERS, **options)


def multilinear(points, values, **options):
    return Multilinear.fit(points, values, ["a", "b"], parameters=PARAMETERS, **options)


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
    assert not model.noise.any() and not model.predict_with_error(inside(3))[1].any()


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


def test_process_recovers_a_smooth_function_to_less_than_the_seed_noise():
    model, points = process(*noisy_runs(25, 2)), inside(500)
    mean, std = model.predict_with_error(points)
    miss = np.abs(mean - smooth(points))
    assert (np.sqrt((miss**2).mean(axis=0)) < NOISE).all()
    assert ((miss < 3 * std).mean(axis=0) > 0.9).all() and (std.mean(axis=0) < NOISE).all()
    np.testing.assert_array_equal(mean, model.predict(points))


def test_process_follows_a_linear_response_between_few_runs():
    points = design(6)
    values = 3 + (points - LOW) / (HIGH - LOW) @ [[2.0], [-5.0]]
    model = GaussianProcess.fit(points, values, ["a"], BOUNDS, noise=np.array([1e-4]))
    expected = 3 + (inside(50) - LOW) / (HIGH - LOW) @ [[2.0], [-5.0]]
    np.testing.assert_allclose(model.predict(inside(50)), expected, atol=0.02)


def test_process_error_of_the_mean_leaves_the_noise_of_a_new_run_out():
    points = np.repeat(design(12), 50, axis=0)
    values = smooth(points) + NOISE * np.random.default_rng(2).normal(size=(len(points), 2))
    std = process(points, values).predict_with_error(design(12))[1]
    assert (std < 1.2 * NOISE / np.sqrt(50)).all()


def test_process_leave_one_out_equals_refitting_without_the_point():
    model = process(*noisy_runs(15, 2))
    predictions, std = model.leave_one_out()
    unit = (2 * model.points - LOW - HIGH) / (HIGH - LOW)
    for column, one in enumerate(model._processes):
        standard = (model.values[:, column] - one.centre) / one.scale
        alpha = (model.noise[column] / one.scale) ** 2 / model.counts[:, column] + JITTER
        for i in (0, 7, 14):
            keep = np.arange(15) != i
            refit = GaussianProcessRegressor(
                one.regressor.kernel_, alpha=alpha[keep], optimizer=None
            ).fit(unit[keep], standard[keep])
            mean, latent = refit.predict(unit[[i]], return_std=True)
            assert predictions[i, column] == pytest.approx(
                one.centre + one.scale * mean[0], rel=1e-7
            )
            assert std[i, column] == pytest.approx(
                one.scale * np.sqrt(latent[0] ** 2 + alpha[i]), rel=1e-6
            )


def test_process_leave_one_out_scatter_is_predicted():
    model = process(*noisy_runs(40, 2))
    predictions, std = model.leave_one_out()
    assert 0.6 < np.sqrt(np.mean(((model.values - predictions) / std) ** 2)) < 1.5


def test_process_keeps_a_run_for_the_responses_that_it_measured():
    points, values = noisy_runs(20, 2)
    whole = process(points, values)
    values[:6, 1] = np.nan
    partial = process(points, values)
    np.testing.assert_array_equal(
        partial.predict(inside(20))[:, 0], whole.predict(inside(20))[:, 0]
    )
    assert np.isnan(partial.leave_one_out()[0][:, 1]).sum() == 3
    without = GaussianProcess.fit(points[6:], values[6:, 1:], ["b"], BOUNDS)
    np.testing.assert_allclose(
        partial.predict(inside(20))[:, 1], without.predict(inside(20))[:, 0], rtol=1e-9
    )


def test_process_of_averages_with_counts_equals_the_process_of_single_runs():
    points, values = noisy_runs(15, 3)
    averaged, means, counts = average_replicates(points, values)
    single = process(points, values, noise=NOISE)
    np.testing.assert_allclose(
        process(averaged, means, noise=NOISE, counts=counts[:, 0]).predict(inside(9)),
        single.predict(inside(9)),
        rtol=1e-9,
    )
    assert single.noise_source == "given"


def test_same_seed_gives_the_same_process_bit_for_bit():
    first, second = (process(*noisy_runs(15, 2), seed=4).predict(inside(50)) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_kernel_from_a_part_of_the_points_serves_a_process_through_all(monkeypatch):
    points, values = noisy_runs(60, 1)
    exact = process(points, values, noise=NOISE)
    monkeypatch.setattr("calibrator.responses.gaussian_process.KERNEL_POINTS", 30)
    model = process(points, values, noise=NOISE)
    assert len(model.points) == 60
    kernels = [m._processes[0].regressor.kernel_.theta for m in (model, exact)]
    assert not np.array_equal(*kernels)
    # the difference of the two stays small beside what all 60 points leave unknown
    mean, error = exact.predict_with_error(inside(200))
    assert np.sqrt(np.mean(((model.predict(inside(200)) - mean) / error) ** 2)) < 1
    conditioned = model._processes[0].regressor.X_train_
    assert conditioned.shape == (60, 2)


def test_a_process_through_too_many_points_says_what_to_do(monkeypatch):
    monkeypatch.setattr("calibrator.responses.gaussian_process.MOST_POINTS", 20)
    with pytest.raises(CalibratorError, match="at most 20.*multilinear"):
        process(*noisy_runs(21, 1), noise=NOISE)


def test_process_needs_two_more_points_than_parameters():
    points, values = noisy_runs(3, 2)
    with pytest.raises(
        CalibratorError, match="a was measured at 3 distinct points: give at least 4"
    ):
        process(points, values)


def test_pooled_noise_of_two_points_is_the_textbook_value():
    points = np.array([[0.0], [0.0], [1.0], [1.0], [1.0], [2.0]])
    values = np.array(
        [[1.0, 1.0], [3.0, np.nan], [5.0, 2.0], [5.0, 4.0], [8.0, 6.0], [100.0, 100.0]]
    )
    std, degrees = seed_noise(points, values)
    np.testing.assert_allclose(std, [np.sqrt((2 + 6) / 3), np.sqrt(8 / 2)])
    np.testing.assert_array_equal(degrees, [3, 2])


def test_pooled_noise_recovers_known_noise_whatever_the_surface():
    points, values = noisy_runs(200, 3)
    std, degrees = seed_noise(points, values)
    # three standard errors, 1 / sqrt(2 * 400) each
    np.testing.assert_allclose(std, NOISE, rtol=0.11)
    np.testing.assert_array_equal(degrees, 400)


def test_no_replicates_leave_the_pooled_noise_unknown():
    std, degrees = seed_noise(*noisy_runs(5, 1))
    assert np.isnan(std).all() and not degrees.any()


def test_process_takes_the_noise_from_replicates_where_there_are_enough():
    points, values = noisy_runs(20, 2)
    model = process(points, values)
    np.testing.assert_allclose(model.noise, seed_noise(points, values)[0], rtol=1e-12)
    assert model.noise_source == "replicates"


def test_process_estimates_the_noise_where_replicates_are_too_few():
    points, values = noisy_runs(40, 1)
    few = np.r_[np.arange(40), np.arange(FEWEST_DEGREES - 1)]
    model = process(
        points[few], values[few] + np.random.default_rng(9).normal(size=(len(few), 2)) * 1e-3
    )
    assert model.noise_source == "estimated"
    assert (model.noise > NOISE / 2).all() and (model.noise < NOISE * 2).all()


def test_noise_source_is_mixed_where_responses_differ():
    points, values = noisy_runs(20, 2)
    values[1::2, 1] = np.nan
    model = process(points, values)
    assert model.noise_source == "mixed" and model.noise_sources == ("replicates", "estimated")


@pytest.mark.parametrize("fit", [multilinear, process])
def test_query_outside_the_box_is_refused_with_parameter_and_range(fit):
    model = fit(grid(3, 3), smooth(grid(3, 3)))
    for verb in (model.predict, model.predict_with_error):
        with pytest.raises(
            CalibratorError, match=r"young_modulus = 6e\+08 lies outside 5e\+06 to 5e\+08"
        ):
            verb(np.array([[0.2, 1e8], [0.2, 6e8]]))
        with pytest.raises(CalibratorError, match="rolling_friction = nan"):
            verb(np.array([[np.nan, 1e8]]))


@pytest.mark.parametrize("fit", [multilinear, process])
def test_rounding_at_the_bound_is_not_outside(fit):
    model = fit(grid(3, 3), smooth(grid(3, 3)))
    above = np.nextafter(HIGH, np.inf)
    np.testing.assert_allclose(model.predict(above[None]), model.predict(HIGH[None]))


def test_process_refuses_runs_outside_its_bounds():
    points, values = noisy_runs(10, 1)
    points[3, 0] = 0.7
    with pytest.raises(CalibratorError, match="rolling_friction = 0.7 lies outside 0.1 to 0.5"):
        process(points, values)


@pytest.mark.parametrize("fit", [multilinear, process])
def test_counts_need_the_noise_that_they_hide(fit):
    with pytest.raises(CalibratorError, match="give noise together with counts"):
        fit(grid(3, 3), smooth(grid(3, 3)), counts=np.full(9, 2))


@pytest.mark.parametrize("values", [np.zeros((9, 3)), np.full((9, 2), np.inf)])
def test_values_of_the_wrong_shape_or_infinite_are_refused(values):
    with pytest.raises(CalibratorError):
        multilinear(grid(3, 3), values)


def test_box_sample_fills_each_half_of_the_box_evenly():
    points = box_sample(LOW, HIGH, 60, np.random.default_rng(0))
    assert points.shape == (64, 2) and (points >= LOW).all() and (points <= HIGH).all()
    np.testing.assert_array_equal((points > (LOW + HIGH) / 2).sum(axis=0), 32)
