"""Profiles against linear models, whose intervals and coverage follow from the covariance."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.search.identifiability import identify

PARAMETERS = (Parameter("rolling_friction", 0.0, 1.0), Parameter("sliding_friction", 0.0, 2.0))
KEYS = ["hourglass.bulk_density", "ledge.bulk_density", "conical_pile.bulk_density"]
SLOPES = np.array([[100.0, 20.0, 50.0], [30.0, -60.0, 40.0]])
ERROR = 5.0
TRUTH = np.array([0.5, 1.0])


class Linear:
    """Responses 1000 + points @ slopes with a constant standard error.

    Like a real interpolant it refuses to extrapolate.
    """

    responses = KEYS
    noise = np.zeros(3)

    def __init__(self, slopes=SLOPES, std=0.0):
        self.slopes, self.std = np.array(slopes, float), std

    def predict(self, points):
        return 1000 + points @ self.slopes

    def predict_with_error(self, points):
        high = np.array([1.0, 2.0, 0.5])[: points.shape[1]]
        assert ((points > -1e-9) & (points < high + 1e-9)).all()
        return self.predict(points), np.full((len(points), 3), self.std)


def problem(values, parameters=PARAMETERS, **options):
    options = options or {"scatter": ERROR}
    return Problem(
        parameters,
        tuple(
            Target(k.split(".")[0], "bulk_density", v, **options)
            for k, v in zip(KEYS, values, strict=True)
        ),
    )


def exact(model):
    return model.predict(TRUTH[None])[0]


def standard_errors(slopes, error):
    return error * np.sqrt(np.diag(np.linalg.inv(slopes @ slopes.T)))


def test_profile_intervals_of_a_linear_model_are_those_of_its_covariance():
    found = identify(problem(exact(Linear())), Linear(), samples=2**10)
    expected = standard_errors(SLOPES, ERROR)
    for i, profile in enumerate(found.parameters):
        np.testing.assert_allclose(
            profile.interval_68, TRUTH[i] + expected[i] * np.array([-1, 1]), rtol=2e-3
        )
        np.testing.assert_allclose(
            profile.interval_95, TRUTH[i] + expected[i] * 1.96 * np.array([-1, 1]), rtol=2e-3
        )
        assert profile.best == pytest.approx(TRUTH[i], rel=1e-4)
    assert found.chi2 == pytest.approx(0, abs=1e-6) and found.assumed == ()


def test_profile_curve_is_the_parabola_of_a_linear_model():
    found = identify(problem(exact(Linear())), Linear(), samples=2**8)
    profile, error = found.parameters[0], standard_errors(SLOPES, ERROR)[0]
    # further out the other parameter meets its bound
    middle = np.abs(profile.positions - 0.5) < 0.15
    np.testing.assert_allclose(
        profile.chi2[middle], ((profile.positions[middle] - 0.5) / error) ** 2, rtol=1e-3, atol=1e-6
    )
    assert middle.sum() > 10 and (np.diff(profile.positions) >= 0).all()
    assert profile.positions[0] == 0 and profile.positions[-1] == 1


def test_profile_adapts_the_other_parameters_rather_than_holding_them():
    found = identify(problem(exact(Linear())), Linear(), samples=2**8)
    held = ERROR / np.linalg.norm(SLOPES, axis=1)
    widths = [np.diff(profile.interval_68)[0] / 2 for profile in found.parameters]
    assert (widths > 1.05 * held).all()


def test_smallest_chi2_of_three_targets_for_two_parameters_is_the_least_squares_residual():
    values = exact(Linear()) + np.array([4.0, -3.0, 6.0])
    best, residual = np.linalg.lstsq(SLOPES.T, values - 1000, rcond=None)[:2]
    found = identify(problem(values), Linear(), samples=2**8)
    assert found.chi2 == pytest.approx(residual[0] / ERROR**2, rel=1e-6)
    np.testing.assert_allclose(found.best, best, rtol=1e-4)


def test_intervals_cover_the_truth_as_often_as_they_claim():
    rng, model = np.random.default_rng(11), Linear()
    covered = np.zeros(2)
    for _ in range(200):
        values = exact(model) + ERROR * rng.normal(size=3)
        profiles = identify(problem(values), model, samples=2**6, positions=11).parameters
        covered += [
            p.interval_95[0] <= t <= p.interval_95[1] for p, t in zip(profiles, TRUTH, strict=True)
        ]
    assert (covered / 200 > 0.9).all() and (covered / 200 < 0.99).all()


def test_parameter_without_influence_is_not_pinned_and_the_other_is():
    model = Linear([[100, 20, 50], [0, 0, 0]])
    first, second = identify(problem(exact(model)), model, samples=2**8).parameters
    assert first.pinned and "rolling_friction is pinned" in first.sentence
    assert second.interval_95 == (0, 2) and second.share == 1 and not second.pinned
    assert "not pinned down by these targets" in second.sentence


def test_ridge_of_equal_responses_shows_as_correlation_and_pins_nothing():
    model = Linear([[100, 100, 100], [50, 50, 50]])
    found = identify(problem(exact(model)), model, samples=2**12)
    assert not any(profile.pinned for profile in found.parameters)
    assert found.correlation[0, 1] < -0.95
    np.testing.assert_allclose(np.diag(found.correlation), 1)


def test_correlation_of_a_linear_model_is_that_of_its_covariance():
    covariance = np.linalg.inv(SLOPES @ SLOPES.T)
    expected = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    found = identify(problem(exact(Linear())), Linear(), samples=2**12)
    assert found.correlation[0, 1] == pytest.approx(expected, abs=0.05)


def test_error_of_the_interpolant_widens_the_intervals_in_quadrature():
    sharp, blurred = (
        identify(problem(exact(Linear())), Linear(std=s), samples=2**8).parameters[0]
        for s in (0.0, 2 * ERROR)
    )
    assert np.diff(blurred.interval_68) == pytest.approx(
        np.sqrt(5) * np.diff(sharp.interval_68), rel=0.01
    )


def test_target_without_scatter_is_used_with_half_its_tolerance_and_named():
    found = identify(problem(exact(Linear()), tolerance=0.01), Linear(), samples=2**8)
    assert found.assumed == tuple(KEYS)
    assert np.diff(found.parameters[0].interval_68)[0] / 2 == pytest.approx(
        standard_errors(SLOPES, 5.3)[0], rel=0.05
    )


def test_interval_ends_at_the_box_where_the_truth_does():
    model = Linear()
    values = model.predict(np.array([[0.0, 1.0]]))[0]
    interval = identify(problem(values), model, samples=2**8).parameters[0].interval_95
    assert interval[0] == 0 and 0.05 < interval[1] < 0.2


def test_curved_ridge_is_followed_by_the_profile():
    class Product(Linear):
        def predict(self, points):
            return np.repeat(1000 + 100 * points[:, :1] * points[:, 1:], 3, axis=1)

    found = identify(problem([1050.0] * 3, scatter=1.0), Product(), samples=2**12)
    low = found.parameters[0].interval_95[0]
    # where the product needs the other's bound
    assert low == pytest.approx((0.5 - 1.96 * 0.01 / np.sqrt(3)) / 2, rel=0.01)
    assert found.parameters[0].interval_95[1] == 1


def test_steep_curved_valley_is_followed_from_few_samples():
    class Valley(Linear):
        def predict(self, points):
            a, b = points.T
            return 1000 + np.column_stack([a, 1e3 * (b - a**2), 0 * a])

    found = identify(problem([1000.5, 1000.0, 1000.0], scatter=0.1), Valley(), samples=2**6)
    first, second = found.parameters
    ends = 0.5 + 0.196 * np.array([-1, 1])
    np.testing.assert_allclose(first.interval_95, ends, rtol=2e-3)
    np.testing.assert_allclose(second.interval_95, ends**2, rtol=2e-3)
    assert found.correlation[0, 1] > 0.95


def test_profile_at_the_walls_of_the_box_is_bounded_least_squares():
    slopes = np.array([[100.0, 20.0, 50.0], [40.0, 10.0, 30.0], [10.0, -30.0, 40.0]])
    # the unbounded solution lies outside the box
    model, values = Linear(slopes), [1230.0, 1010.0, 1100.0]
    parameters = (*PARAMETERS, Parameter("poisson_ratio", 0.0, 0.5))
    high = np.array([1.0, 2.0, 0.5])
    profiles = identify(problem(values, parameters), model, samples=2**6, positions=9).parameters
    for i, profile in enumerate(profiles):
        others = np.arange(3) != i
        for position, chi2 in zip(profile.positions, profile.chi2, strict=True):
            rest = (np.array(values) - 1000 - position * slopes[i]) / ERROR
            bounded = lsq_linear(slopes[others].T / ERROR, rest, (0, high[others]), tol=1e-12)
            assert chi2 == pytest.approx(2 * bounded.cost, rel=1e-4, abs=1e-6)


def test_interval_of_a_curved_response_ends_where_its_chi2_does():
    class Cube(Linear):
        def predict(self, points):
            return 1000 + 100 * points**3 * [1, 0, 0]

    one = (Parameter("rolling_friction", 0.0, 1.0),)
    found = identify(
        problem([1021.6, 1000.0, 1000.0], one, scatter=5.0), Cube(), samples=2**6, positions=7
    ).parameters[0]
    np.testing.assert_allclose(
        found.interval_95, np.cbrt((21.6 + 1.96 * 5 * np.array([-1, 1])) / 100), rtol=3e-3
    )
    assert found.best == pytest.approx(0.6, rel=1e-4)


def test_profile_finds_a_narrow_basin_at_every_position_of_an_idle_parameter():
    class Basin(Linear):
        def predict(self, points):
            depth = np.exp(-(((points[:, 1] - 1.6) / 0.006) ** 2))
            return 1000 - 100 * np.column_stack([depth, depth, depth])

    found = identify(problem([900.0] * 3, scatter=20.0), Basin(), samples=2**10)
    assert found.parameters[0].chi2.max() < 1e-3
    assert found.parameters[1].best == pytest.approx(1.6, rel=1e-3) and found.parameters[1].pinned


def test_interval_far_narrower_than_the_spacing_of_positions_is_resolved():
    slopes = SLOPES * 1e3
    found = identify(problem(exact(Linear(slopes))), Linear(slopes), samples=2**8)
    for profile, expected, true in zip(
        found.parameters, standard_errors(slopes, ERROR), TRUTH, strict=True
    ):
        np.testing.assert_allclose(
            np.array(profile.interval_95) - true, 1.96 * expected * np.array([-1, 1]), rtol=0.01
        )


def test_accepted_sets_are_distributed_as_the_likelihood():
    found = identify(problem(exact(Linear())), Linear(), samples=2**8)
    np.testing.assert_allclose(found.accepted.mean(axis=0), TRUTH, atol=0.01)
    np.testing.assert_allclose(found.accepted.std(axis=0), standard_errors(SLOPES, ERROR), rtol=0.1)


def test_accepted_sets_stay_in_the_box_and_reach_its_walls():
    model = Linear([[100, 20, 50], [0, 0, 0]])
    accepted = identify(problem(exact(model)), model, samples=2**8).accepted[:, 1]
    assert accepted.min() >= 0 and accepted.max() <= 2
    np.testing.assert_allclose(
        np.histogram(accepted, 4, (0, 2))[0] / len(accepted), 0.25, atol=0.05
    )


def test_single_parameter_has_a_profile_too():
    one = (Parameter("rolling_friction", 0.0, 1.0),)
    model = Linear([[100, 20, 50]])
    found = identify(problem(model.predict(np.array([[0.5]]))[0], one), model, samples=2**6)
    assert np.diff(found.parameters[0].interval_68)[0] / 2 == pytest.approx(
        ERROR / np.linalg.norm([100, 20, 50]), rel=1e-3
    )
    np.testing.assert_allclose(found.correlation, [[1]])


def test_copies_of_one_measurement_are_one_measurement():
    """By definition, or because the same seeds move them."""

    mass, share, onset = (
        f"hourglass.{r}" for r in ("residual_mass", "residual_fraction", "onset_delay")
    )

    class Copies(Linear):
        responses = (mass, share, onset)

        def predict(self, points):
            return 1000 + 100 * points[:, :1] * [1, 1, 0]

    def width(keys, alike=None):
        targets = tuple(Target(*k.split("."), 1050.0, scatter=ERROR) for k in keys)
        one = Problem((PARAMETERS[0],), targets)
        found = identify(one, Copies(), samples=2**6, positions=11, alike=alike)
        return np.diff(found.parameters[0].interval_95)[0]

    assert width([mass, share]) == pytest.approx(width([mass]), rel=1e-3)
    alike = np.array([[1.0, 0, 1], [0, 1, 0], [1, 0, 1]])
    Copies.predict = lambda self, points: 1000 + 100 * points[:, :1] * [1, 0, 1]
    assert width([mass, onset], alike) == pytest.approx(width([mass]), rel=1e-3)
    assert width([mass, onset]) == pytest.approx(width([mass]) / np.sqrt(2), rel=1e-2)


def test_a_target_of_weight_zero_narrows_no_interval():
    targets = problem(exact(Linear())).targets
    idle = (*targets[:2], dataclasses.replace(targets[2], value=1e6, weight=0.0))
    both, two = (
        identify(Problem(PARAMETERS, chosen), Linear(), samples=2**8).parameters
        for chosen in (idle, targets[:2])
    )
    for a, b in zip(both, two, strict=True):
        np.testing.assert_allclose(a.interval_95, b.interval_95, rtol=1e-3)


def test_targets_that_no_set_agrees_with_pin_nothing_down():
    found = identify(problem([1050.0, 900.0, 2000.0]), Linear(), samples=2**8)
    assert found.refused and np.isfinite(found.correlation).all()
    for profile in found.parameters:
        assert not profile.pinned and profile.range == "no interval"
        assert "no parameter set agrees" in profile.sentence


def test_an_interval_that_ends_at_a_bound_is_one_sided_and_pins_nothing_down():
    values = Linear().predict(np.array([[0.0, 1.0]]))[0]
    profile = identify(problem(values), Linear(), samples=2**8).parameters[0]
    assert not profile.pinned and profile.walled == (True, False)
    assert f"at most {profile.interval_95[1]:.4g}" in profile.sentence
