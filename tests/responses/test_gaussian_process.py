"""Interpolants against functions whose values, noise and errors can be written down."""

import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor

from calibrator.errors import CalibratorError
from calibrator.responses.gaussian_process import FEWEST_DEGREES, JITTER, GaussianProcess
from calibrator.responses.interpolant import average_replicates, seed_noise
from tests.responses.known_functions import (
    BOUNDS,
    HIGH,
    LOW,
    NOISE,
    design,
    inside,
    noisy_runs,
    process,
    smooth,
)


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
    # of a range of 7; the prior does not believe in a straight line before there are more points
    np.testing.assert_allclose(model.predict(inside(50)), expected, atol=0.07)


def test_process_error_of_the_mean_leaves_the_noise_of_a_new_run_out():
    points = np.repeat(design(12), 50, axis=0)
    values = smooth(points) + NOISE * np.random.default_rng(2).normal(size=(len(points), 2))
    std = process(points, values).predict_with_error(design(12))[1]
    assert (std < 1.2 * NOISE / np.sqrt(50)).all()


def test_process_leave_one_out_equals_refitting_without_the_point():
    model = process(*noisy_runs(15, 2))
    predictions, std = model.leave_one_out()
    unit = (2 * model.points - LOW - HIGH) / (HIGH - LOW)
    for column, one in enumerate(model.processes):
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
    kernels = [m.processes[0].regressor.kernel_.theta for m in (model, exact)]
    assert not np.array_equal(*kernels)
    # the difference of the two stays small beside what all 60 points leave unknown
    mean, error = exact.predict_with_error(inside(200))
    assert np.sqrt(np.mean(((model.predict(inside(200)) - mean) / error) ** 2)) < 1
    conditioned = model.processes[0].regressor.X_train_
    assert conditioned.shape == (60, 2)


def test_a_process_through_too_many_points_says_what_to_do(monkeypatch):
    monkeypatch.setattr("calibrator.responses.gaussian_process.MOST_POINTS", 20)
    with pytest.raises(CalibratorError, match=r"at most 20.*multilinear"):
        process(*noisy_runs(21, 1), noise=NOISE)


def test_process_needs_two_more_points_than_parameters():
    points, values = noisy_runs(3, 2)
    with pytest.raises(
        CalibratorError, match="a was measured at 3 distinct points: give at least 4"
    ):
        process(points, values)


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


def test_process_refuses_runs_outside_its_bounds():
    points, values = noisy_runs(10, 1)
    points[3, 0] = 0.7
    with pytest.raises(CalibratorError, match=r"rolling_friction = 0.7 lies outside 0.1 to 0.5"):
        process(points, values)
