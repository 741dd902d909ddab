"""The algebra of a gap: projections, likelihood ratios and probabilities of known distribution."""

import numpy as np
import pytest
from scipy import stats

from calibrator.diagnosis.gap import (
    Gap,
    absorbed_shares,
    detect,
    fingerprints,
    ghost_probability,
    localise,
    projection,
    repeated,
    smallest_detectable,
    smallest_nameable,
)
from calibrator.errors import CalibratorError

N, D = 14, 3
NAMES = ("adhesion", "drag", "tilt")
SIGNS = ("+", "+-", "+-")


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.fixture
def world(rng):
    """Covariance, Jacobian and the changes by three effects."""
    root = rng.normal(size=(N, N))
    return root @ root.T + np.eye(N), rng.normal(size=(N, D)), 5 * rng.normal(size=(N, 3))


def draws(covariance, count, rng):
    return rng.normal(size=(count, len(covariance))) @ np.linalg.cholesky(covariance).T


def test_the_projection_removes_whatever_the_parameters_can_do(world, rng):
    covariance, jacobian, changes = world
    project = projection(covariance, jacobian)
    np.testing.assert_allclose(project(jacobian @ rng.normal(size=D)), 0, atol=1e-10)
    moved = changes[:, 0] + jacobian @ rng.normal(size=D)
    np.testing.assert_allclose(project(moved), project(changes[:, 0]), atol=1e-10)
    assert project.degrees == N - D


def test_a_projected_residual_is_made_of_independent_standard_normals(world, rng):
    covariance, jacobian, _ = world
    project = projection(covariance, jacobian)
    np.testing.assert_allclose(
        project.matrix @ covariance @ project.matrix.T, np.eye(N - D), atol=1e-8
    )


def test_the_likelihood_ratio_of_a_pure_fingerprint_returns_its_amplitude(world):
    covariance, jacobian, changes = world
    project = projection(covariance, jacobian)
    prints = fingerprints(NAMES, SIGNS, changes, project)
    residual = project(-0.7 * changes[:, 1] + jacobian @ np.ones(D))
    assert prints.amplitudes(residual)[1] == pytest.approx(-0.7)
    assert prints.likelihood_ratios(residual)[1] == pytest.approx(residual @ residual)
    assert prints.likelihood_ratios(residual).argmax() == 1


def test_an_effect_of_one_sign_explains_nothing_in_the_other_direction(world):
    covariance, jacobian, changes = world
    project = projection(covariance, jacobian)
    prints = fingerprints(NAMES, SIGNS, changes, project)
    assert prints.likelihood_ratios(project(-changes[:, 0]))[0] == 0
    assert prints.likelihood_ratios(project(changes[:, 0]))[0] > 1


def test_a_duplicated_observable_changes_nothing(world, rng):
    covariance, jacobian, changes = world
    twice = np.r_[np.arange(N), 4]
    residual = draws(covariance, 1, rng)[0] + changes[:, 0]
    found = []
    for kept in (np.arange(N), twice):
        project = projection(covariance[np.ix_(kept, kept)], jacobian[kept])
        prints = fingerprints(NAMES, SIGNS, changes[kept], project)
        r = project(residual[kept])
        found.append([project.degrees, r @ r, *prints.likelihood_ratios(r), *prints.lengths])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6)


def test_observables_that_repeat_others_are_found(rng):
    samples = rng.normal(size=(200, 3))
    correlation = np.corrcoef(
        np.column_stack([samples, 3 - 2 * samples[:, 0], samples[:, 1] + samples[:, 2]]).T
    )
    assert repeated(correlation) == [(3, 0)]


@pytest.mark.parametrize("degrees", [np.inf, 12])
def test_probabilities_of_a_gap_are_uniform_where_there_is_none(world, degrees):
    covariance, jacobian, changes = world
    project = projection(covariance, jacobian)
    prints = fingerprints(NAMES, SIGNS, changes, project)
    rng, found = np.random.default_rng(11), []
    for _ in range(300):
        scale = 1 if degrees == np.inf else np.sqrt(rng.chisquare(degrees) / degrees)
        residual = project(draws(covariance, 1, rng)[0]) / scale
        one = detect(residual, prints, degrees, rng)
        found.append((one.p_chi2, one.p_effect, ghost_probability(residual, prints, rng)))
    for p in np.array(found).T:
        assert stats.kstest(p, "uniform").pvalue > 0.01


def test_ghosts_seldom_reach_what_a_true_effect_explains(world, rng):
    covariance, jacobian, changes = world
    project = projection(covariance, jacobian)
    prints = fingerprints(NAMES, SIGNS, changes, project)
    residual = project(draws(covariance, 1, rng)[0] + 4 * changes[:, 2])
    assert ghost_probability(residual, prints, rng) < 0.01


def test_the_absorbed_share_is_all_of_an_effect_that_imitates_a_parameter(world):
    covariance, jacobian, changes = world
    shares = absorbed_shares(np.column_stack([jacobian[:, 0], changes]), covariance, jacobian)
    assert shares[0] == pytest.approx(1)
    assert ((shares[1:] > 0) & (shares[1:] < 1)).all()


def test_an_effect_of_the_smallest_detectable_size_is_detected_four_times_in_five(world):
    covariance, jacobian, changes = world
    project = projection(covariance, jacobian)
    prints = fingerprints(NAMES, SIGNS, changes, project)
    rng, size = np.random.default_rng(3), smallest_detectable(prints)
    noise = project(draws(covariance, 300, rng).T).T
    found = [
        detect(r + size[1] * prints.columns[:, 1], prints, np.inf, rng).p_effect < 0.03
        for r in noise[:150]
    ]
    assert np.mean(found) > 0.8


def test_effects_that_look_the_same_cannot_be_named_at_any_size(world):
    covariance, jacobian, changes = world
    project = projection(covariance, jacobian)
    alike = np.column_stack([changes[:, 0], 2 * changes[:, 0] + jacobian[:, 0], changes[:, 1]])
    sizes = smallest_nameable(fingerprints(NAMES, SIGNS, alike, project))
    assert sizes[0] > 1e3 and sizes[1] > 1e3 and sizes[2] < 1e2


def test_the_experiment_that_disagrees_is_found(world, rng):
    covariance, jacobian, _ = world
    experiments = ["hourglass"] * 6 + ["ledge"] * 4 + ["conical_pile"] * 4
    residual = draws(covariance, 1, rng)[0]
    residual[6:10] += 5 * np.sqrt(np.diag(covariance))[6:10] * rng.choice([-1, 1], 4)
    worst, *others = localise(residual, covariance, jacobian, experiments)
    assert worst.experiment == "ledge" and worst.p_holm < 0.01
    assert [one.p_holm for one in others] == sorted(one.p_holm for one in others)


def test_the_probabilities_of_places_are_uniform_where_there_is_no_gap(world):
    covariance, jacobian, _ = world
    rng, experiments = np.random.default_rng(8), ["hourglass"] * 8 + ["ledge"] * 6
    residuals = draws(covariance, 400, rng) + rng.normal(size=(400, D)) @ jacobian.T
    found = [localise(r, covariance, jacobian, experiments) for r in residuals]
    p = [one.p for places in found for one in places if one.experiment == "ledge"]
    assert stats.kstest(p, "uniform").pvalue > 0.01


def test_a_covariance_that_is_none_is_refused(world):
    covariance, jacobian, _ = world
    for spoiled, says in (
        (np.full((N, N), np.nan), "finite"),
        (-covariance, "no error"),
        (covariance * 0, "no error"),
    ):
        with pytest.raises(CalibratorError, match=says):
            projection(spoiled, jacobian)


def test_the_closed_share_counts_from_the_noise_floor():
    assert Gap(3.0, 1.0, 1.0).closed == 1
    assert Gap(3.0, 3.0, 1.0).closed == 0
    assert np.isnan(Gap(0.8, 0.7, 1.0).closed)
