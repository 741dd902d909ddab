"""Response surfaces against functions that they represent exactly, and the errors they promise."""

import numpy as np
import pytest
from scipy.stats import qmc

from calibrator.diagnosis.surfaces import Surface, fit_surfaces, terms
from calibrator.errors import CalibratorError

RNG = np.random.default_rng(2)
POINTS = qmc.Sobol(2, seed=1).random(16)
NONE = np.zeros((16, 1))
WIDER = np.array([[-0.5, -0.5], [1.5, 1.5]])


def smooth(units, amplitudes, bend=0.0):
    x = 2 * units - 1
    a = amplitudes[:, 0]
    flat = (
        3 + x[:, 0] - 2 * x[:, 1] + 0.5 * x[:, 0] * x[:, 1] + a * (1 + 0.3 * x[:, 0]) - 0.2 * a**2
    )
    return np.column_stack([flat, 2 * flat + x[:, 1] ** 2]) + bend * np.sin(6 * units[:, :1])


def test_surfaces_return_a_quadratic_function_with_an_effect_but_for_the_ridge():
    units, sizes = (
        np.vstack([POINTS, POINTS]),
        np.vstack([NONE, np.resize([0.5, 1.0, 1.5], (16, 1))]),
    )
    surface = Surface.fit(units, sizes, smooth(units, sizes))
    at, a = np.array([[0.3, 0.8]]), np.array([[1.2]])
    np.testing.assert_allclose(terms(at, a) @ surface.coefficients, smooth(at, a), rtol=2e-3)


def test_an_effect_without_a_run_has_no_term_and_changes_nothing():
    surface = Surface.fit(POINTS, NONE, smooth(POINTS, NONE))
    at = np.array([[0.3, 0.8]])
    np.testing.assert_allclose(
        terms(at, np.array([[2.0]])) @ surface.coefficients,
        smooth(at, np.zeros((1, 1))),
        rtol=1e-10,
    )


def test_promised_errors_are_those_of_repeated_fits():
    root = np.array([[0.3, 0.0], [0.2, 0.1]])
    units, sizes = np.repeat(POINTS, 2, axis=0), np.zeros((32, 1))
    means, promised = [], []
    for _ in range(300):
        values = smooth(units, sizes) + RNG.normal(size=(32, 2)) @ root.T
        surface = Surface.fit(units, sizes, values)
        row = terms(np.array([[0.9, 0.2]]), np.zeros((1, 1)))[0]
        means.append(row @ surface.coefficients)
        promised.append((row @ surface.inverse @ row) * surface.noise)
    np.testing.assert_allclose(np.mean(promised, axis=0), np.cov(np.array(means).T), rtol=0.25)


def test_what_a_quadratic_cannot_follow_counts_as_error():
    units, sizes = np.repeat(POINTS, 3, axis=0), np.zeros((48, 1))
    noise = 0.05 * RNG.normal(size=(48, 2))
    straight = Surface.fit(units, sizes, smooth(units, sizes) + noise)
    bent = Surface.fit(units, sizes, smooth(units, sizes, bend=0.5) + noise)
    assert straight.misfit.max() < 0.05**2
    assert bent.misfit.min() > 0.1**2


def test_an_effect_with_which_runs_scatter_more_does_not_raise_the_noise_of_those_without():
    units = np.repeat(POINTS, 8, axis=0)
    sizes = np.resize([0.5, 1.0, 1.5, 0.75], (128, 1))
    plain = RNG.normal(size=(128, 2)) @ np.array([[1.0, 0.6], [0.0, 0.8]])
    changed = 3 * RNG.normal(size=(128, 2)) @ np.array([[1.0, 0.6], [0.0, 0.8]])
    surfaces = fit_surfaces([(units, plain)], [(units, sizes, changed)], ["ledge"], {1}, {2}, WIDER)
    # pooled it would be some five times as large
    np.testing.assert_allclose(surfaces.noise, [[1.0, 0.6], [0.6, 1.0]], rtol=0.4)


def test_the_extra_scatter_of_runs_with_one_effect_is_its_own_and_grows_with_it():
    units, sizes = np.vstack([POINTS] * 5), np.zeros((80, 2))
    sizes[16:48, 0] = sizes[48:, 1] = np.resize([0.5, 1.0, 1.5, 0.75], 32)
    plain, values = (
        RNG.normal(size=(80, 2)),
        3 + sizes @ np.array([[1.0, 2.0], [3.0, 1.0]]) + RNG.normal(size=(80, 2)),
    )
    # the heap stands, or it does not
    values[48:, 0] += np.where(RNG.random(32) < 0.5, 6.0, -6.0) * sizes[48:, 1]
    surfaces = fit_surfaces([(units, plain)], [(units, sizes, values)], ["ledge"], {1}, {2}, WIDER)
    ((first, second),) = surfaces.effect_scatters
    assert first.max() < 1 and second[1] < 1 and 18 < second[0] < 54  # 0, 0 and 36, but for chance
    small, large = (surfaces.extra_scatter(np.array([0.0, a])) for a in (0.5, 1.5))
    np.testing.assert_allclose(large, 9 * small)


def test_too_few_runs_are_refused_with_the_number_that_is_missing():
    with pytest.raises(CalibratorError, match="ledge has 10 finished runs, 4 too few"):
        Surface.fit(POINTS[:10], NONE[:10], smooth(POINTS[:10], NONE[:10]), "ledge")


def test_a_seed_that_serves_residual_and_fingerprints_is_refused():
    plain, change = (POINTS, smooth(POINTS, NONE)), (POINTS, NONE, smooth(POINTS, NONE))
    with pytest.raises(CalibratorError, match="seed 7 serves both"):
        fit_surfaces([plain], [change], ["ledge"], {5, 7}, {7, 9}, WIDER)
    fit_surfaces([plain], [change], ["ledge"], {5, 7}, {8, 9}, WIDER)


def test_the_jacobian_is_the_derivative_by_range_and_by_scale():
    units, sizes = (
        np.vstack([POINTS, POINTS]),
        np.vstack([NONE, np.resize([0.5, 1.0, 1.5], (16, 1))]),
    )
    surfaces = fit_surfaces(
        [(POINTS, smooth(POINTS, NONE))],
        [(units, sizes, smooth(units, sizes))],
        ["ledge"],
        {1},
        {2},
        WIDER,
    )
    slopes = surfaces.jacobian(np.array([0.5, 0.5]), np.zeros(1))
    np.testing.assert_allclose(slopes, [[2, -4, 1], [4, -8, 2]], rtol=0.02)
