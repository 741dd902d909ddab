"""Full runs that lean on cheap ones are predicted as the joint normal of all runs says."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from calibrator.errors import CalibratorError
from calibrator.responses.cautious import Cautious
from calibrator.responses.cokriging import CheapRuns, CoKriged
from calibrator.responses.dear_process import UNKNOWN_MEAN
from calibrator.responses.gaussian_process import GaussianProcess
from calibrator.responses.interpolant import Learnt

BOX = np.array([[0.0, 0.0], [1.0, 1.0]])
KEYS = ["hourglass.mass_flow_rate"]
NOISE = 0.05


def surface(points):
    """A smooth response of two parameters."""
    return 3 + np.sin(3 * points[:, 0]) + points[:, 1] ** 2 * points[:, 0]


def cheaper(points):
    """What a cheap run gives: another level, another slope, a bend of its own."""
    return 0.7 * surface(points) - 1 + 0.1 * points[:, 1]


def runs_of(function, points, rng, noise=NOISE):
    """Single runs (n, 1)."""
    return (function(points) + noise * rng.normal(size=len(points)))[:, None]


def made(seed, dear=6, cheap=20, below=cheaper, **options):
    """A fit, and the points that it had in full."""
    rng = np.random.default_rng(seed)
    full, more = rng.random((dear, 2)), rng.random((cheap, 2))
    runs = CheapRuns(more, runs_of(below, more, rng))
    values = runs_of(surface, full, rng)
    return CoKriged.fit(full, values, KEYS, BOX, runs, np.array([NOISE]), **options), full, values


def covariances(model, points, is_dear):
    """Prior covariance (n, n) and mean of all runs in the cheap process' units, from scratch."""
    process, link = model.cheap.processes[0], model.links[0]
    amplitude, *lengths = np.exp(process.regressor.kernel_.theta)

    def matern(scales):
        r = np.sqrt(5) * cdist(points / scales, points / scales)
        return (1 + r + r**2 / 3) * np.exp(-r)

    slopes = np.where(is_dear, link.rho, 1.0)
    trend = points @ points.T
    first = amplitude * matern(np.array(lengths)) + trend + 1
    second = UNKNOWN_MEAN**2 + link.size**2 * (trend + matern(np.maximum(lengths, 1.0)))
    return np.outer(slopes, slopes) * first + np.outer(is_dear, is_dear) * second


def test_predictions_are_those_of_the_joint_normal_of_all_runs():
    model, _, _ = made(1)
    process = model.cheap.processes[0]
    cheap = process.regressor.X_train_
    full = 2 * model.points - 1
    new = np.random.default_rng(9).random((5, 2))
    points = np.vstack([cheap, full, 2 * new - 1])
    is_dear = np.arange(len(points)) >= len(cheap)
    n = len(cheap) + len(full)
    whole = covariances(model, points, is_dear)
    variances = np.where(is_dear[:n], NOISE / process.scale, process.noise / process.scale) ** 2
    seen = whole[:n, :n] + np.diag(variances)
    centre = model.values.mean()
    values = np.concatenate(
        [process.regressor.y_train_, (model.values[:, 0] - centre) / process.scale]
    )
    weights = np.linalg.solve(seen, whole[:n, n:])
    mean, error = model.predict_with_error(new)
    assert mean[:, 0] == pytest.approx(centre + process.scale * weights.T @ values, abs=1e-4)
    variance = np.diag(whole[n:, n:] - weights.T @ whole[:n, n:])
    assert error[:, 0] == pytest.approx(process.scale * np.sqrt(variance), rel=1e-3)


def test_what_a_run_tells_is_what_the_variance_loses_by_it():
    model, full, values = made(2)
    process, one = model.cheap.processes[0], np.array([[0.3, 0.6]])
    cheap, dear = model.told(one)
    before = model.predict_with_error(one)[1][0, 0] ** 2

    def after(points, own, runs):
        kept = CoKriged.fit(points, own, KEYS, BOX, runs, learnt=model.learnt)
        return kept.predict_with_error(one)[1][0, 0] ** 2

    raw = CheapRuns(
        (process.regressor.X_train_ + 1) / 2,
        (process.regressor.y_train_ * process.scale + process.centre)[:, None],
    )
    more = np.vstack([full, one]), np.vstack([values, [[4.0]]])
    assert before - after(*more, raw) == pytest.approx(dear[0, 0], rel=0.02)
    # one more cheap value moves the standardised units a little, with the kernel kept
    new = np.vstack([raw.values, [[process.centre]]])
    grown = CheapRuns(np.vstack([raw.points, one]), new)
    assert before - after(full, values, grown) == pytest.approx(cheap[0, 0], rel=0.15)
    assert 0 < cheap[0, 0] < dear[0, 0]


def test_a_set_is_left_out_as_if_it_had_not_been_run():
    model, full, values = made(3)
    mean, error = model.leave_one_out()
    runs = CheapRuns(
        (model.cheap.processes[0].regressor.X_train_ + 1) / 2,
        model.cheap.values,
    )
    for i, point in enumerate(model.points):
        others = (full != point).any(axis=1)
        kept = CoKriged.fit(full[others], values[others], KEYS, BOX, runs, learnt=model.learnt)
        alone, own = kept.predict_with_error(point[None])
        # the unknown mean is a normal of finite width about the mean of the runs that are left
        assert alone[0, 0] == pytest.approx(mean[i, 0], abs=0.01)
        assert np.hypot(own[0, 0], NOISE) == pytest.approx(error[i, 0], rel=0.01)


def test_few_full_runs_are_enough_where_cheap_ones_are_many():
    new = np.random.default_rng(0).random((200, 2))
    together, alone, scaled = [], [], []
    for seed in range(20):
        model, full, values = made(seed)
        plain = GaussianProcess.fit(full, values, KEYS, BOX, np.array([NOISE]))
        mean, error = Cautious.of(model).predict_with_error(new)
        off = mean[:, 0] - surface(new)
        scaled += list(off / error[:, 0])
        together.append(off)
        alone.append(plain.predict(new)[:, 0] - surface(new))
    assert np.std(together) < 0.4 * np.std(alone)
    assert np.mean(np.abs(scaled) < 1.96) > 0.93


def test_cheap_runs_that_mislead_are_not_leant_on():
    new = np.random.default_rng(0).random((200, 2))

    def unlike(points):
        return np.cos(9 * points[:, 1]) - 2 * points[:, 0]

    together, alone = [], []
    for seed in range(12):
        model, full, values = made(seed, dear=14, below=unlike)
        plain = GaussianProcess.fit(full, values, KEYS, BOX, np.array([NOISE]))
        together.append(model.predict(new)[:, 0] - surface(new))
        alone.append(plain.predict(new)[:, 0] - surface(new))
        assert abs(model.links[0].rho) < 0.35
    assert np.std(together) < 1.5 * np.std(alone)


def test_the_same_is_fitted_again_from_what_was_learnt():
    model, full, values = made(4)
    process = model.cheap.processes[0]
    runs = CheapRuns((process.regressor.X_train_ + 1) / 2, model.cheap.values)
    again = CoKriged.fit(
        full, values, KEYS, BOX, runs, learnt=Learnt(model.learnt.kernels, model.learnt.noise)
    )
    new = np.random.default_rng(0).random((9, 2))
    for one, other in zip(
        model.predict_with_error(new), again.predict_with_error(new), strict=True
    ):
        assert one == pytest.approx(other, rel=1e-9)


def test_the_noise_of_full_runs_is_found_where_nobody_gives_it():
    rng = np.random.default_rng(5)
    found = []
    for _ in range(8):
        full, more = rng.random((16, 2)), rng.random((40, 2))
        runs = CheapRuns(more, runs_of(cheaper, more, rng, 0.02))
        values = runs_of(surface, full, rng, 0.2)
        model = CoKriged.fit(full, values, KEYS, BOX, runs)
        assert model.noise_sources == ("estimated",)
        found.append(model.noise[0])
    assert np.median(found) == pytest.approx(0.2, rel=0.3)


def test_two_full_sets_are_too_few():
    with pytest.raises(CalibratorError, match=r"2 sets by full runs, and takes 3.*dear_sets"):
        made(1, dear=2)
