"""Seed noise, its growth over the box and lack of fit, on data whose scatter is known."""

import numpy as np
import pytest

from calibrator.diagnosis.observed import pooled_scatter
from calibrator.diagnosis.scatter import Growth, Replicates, noise_and_misfit
from calibrator.diagnosis.surfaces import Surface

SETS, OBSERVABLES = 32, 6
NONE = np.zeros((2 * SETS, 1))


def database(rng, bend=0.0, growth=0.0):
    """Two runs of each set, observables of unit noise at the centre of the box."""
    units = np.repeat(rng.random((SETS, 2)), 2, axis=0)
    noise = rng.normal(size=(2 * SETS, OBSERVABLES)) * np.exp(growth * (units[:, :1] - 0.5))
    return units, noise + bend * np.sin(9 * units[:, :1])


def test_where_surfaces_fit_hardly_anything_counts_as_lack_of_fit():
    rng = np.random.default_rng(1)
    found = [Surface.fit(u, NONE, v).misfit.mean() for u, v in (database(rng) for _ in range(60))]
    # cut off at zero one by one, the estimates have a mean of 0.08
    assert np.mean(found) < 0.05


def test_what_surfaces_miss_is_lack_of_fit_and_not_noise():
    rng = np.random.default_rng(2)
    fits = [Surface.fit(u, NONE, v) for u, v in (database(rng, bend=2.0) for _ in range(20))]
    assert np.mean([np.diag(one.noise).mean() for one in fits]) == pytest.approx(1.0, rel=0.1)
    assert 0.8 < np.mean([one.misfit.mean() for one in fits]) < 2.0  # 2 is the sine's own variance


def test_an_observable_without_any_scatter_keeps_what_the_surfaces_miss():
    values = np.repeat(np.sin(9 * np.linspace(0, 1, SETS)), 2)[:, None]
    own = Replicates.of(np.repeat(np.arange(SETS)[:, None], 2, axis=0), values)
    noise, misfit = noise_and_misfit(values, 60, own)
    assert noise.item() == 0.0 and misfit.item() == pytest.approx((values**2).sum() / 28 / 2)


def test_noise_that_grows_over_the_box_is_known_where_a_measurement_lies():
    rng = np.random.default_rng(3)
    ratios = []
    for _ in range(40):
        units, values = database(rng, growth=2.0)
        own = Replicates.of(units, values)
        growth = Growth.of(own.sets, own)
        ratios.append(growth(np.array([0.9, 0.5])) / growth(np.array([0.1, 0.5])))
    # variances differ by exp(2 * 2 * 0.8) = 25; the prior keeps them nearer to each other
    assert 6 < np.exp(np.mean(np.log(ratios))) < 26


def test_noise_that_does_not_grow_seems_to_grow_little_and_has_its_pooled_size_on_average():
    rng = np.random.default_rng(4)
    units, values = database(rng)
    own = Replicates.of(units, values)
    growth = Growth.of(own.sets, own)
    factors = np.array([growth(unit) for unit in own.sets])
    np.testing.assert_allclose(factors.mean(axis=0), 1.0)
    assert factors.max() < 3.5 and factors.min() > 1 / 3.5


def test_without_replicates_noise_is_the_same_everywhere():
    rng = np.random.default_rng(5)
    surface = Surface.fit(rng.random((40, 2)), np.zeros((40, 1)), rng.normal(size=(40, 3)))
    np.testing.assert_array_equal(surface.growth(np.array([0.1, 0.9])), 1.0)
    assert not surface.misfit.any()


def test_the_scatter_of_replicates_is_not_padded_and_not_believed_to_be_the_models_either():
    rng = np.random.default_rng(6)
    drawn = rng.normal(size=(4000, 5)).std(axis=1, ddof=1)
    pooled = pooled_scatter(drawn, np.full(4000, 5), np.ones(4000))
    assert np.mean(pooled**2) == pytest.approx(1.0, abs=0.12)  # 1.36 where the larger one is taken
    assert pooled_scatter(np.array([3.0]), np.array([5]), np.ones(1)).item() == 3.0
