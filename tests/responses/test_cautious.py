"""An interpolant claims what left-out points bear out, and nothing that is impossible."""

import numpy as np
import pytest

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.errors import CalibratorError
from calibrator.plan.design import full_grid, sobol
from calibrator.responses.coordinates import Coordinates
from calibrator.responses.fit import fit_responses
from calibrator.responses.interpolant import alike_seeds, known_noise

NAMES = (
    "rolling_friction",
    "sliding_friction",
    "size_spread",
    "wall_friction_ratio",
    "bond_number",
)
KEY = "hourglass.onset_delay"


def problem(count, samples=5, key=KEY):
    bounds = (0.0, 0.4)
    parameters = tuple(Parameter(n, *bounds, samples=samples) for n in NAMES[:count])
    return Problem(parameters, (Target(*key.split("."), 1.0),))


def curved(points):
    return 10 + np.sin(6 * points.sum(axis=1, keepdims=True)) + 9 * points[:, :1] ** 2


def held(model, points, truth):
    mean, error = model.predict_with_error(points)
    return float((np.abs(mean - truth) <= 1.96 * error).mean())


def inside(count, parameters):
    return 0.4 * np.random.default_rng(3).random((count, parameters))


@pytest.mark.parametrize("parameters", [1, 3, 5])
def test_a_process_through_few_runs_claims_an_error_that_holds(parameters):
    own, rng = problem(parameters), np.random.default_rng(1)
    points, asked = np.repeat(sobol(own, 20), 2, axis=0), inside(300, parameters)
    shares = []
    for _ in range(6):
        slopes = rng.normal(size=parameters) * 3
        values = 10 + np.tanh((points - 0.2) @ slopes)[:, None]
        values = values + 0.02 * rng.normal(size=values.shape)
        truth = 10 + np.tanh((asked - 0.2) @ slopes)[:, None]
        shares.append(held(fit_responses(own, points, values, [KEY]), asked, truth))
    assert np.mean(shares) >= 0.88


@pytest.mark.parametrize("samples", [2, 3, 5])
def test_lines_on_a_grid_claim_an_error_that_holds_without_replicates_too(samples):
    own, rng = problem(2, samples), np.random.default_rng(1)
    points, asked = full_grid(own), inside(300, 2)
    noisy = curved(points) + 0.1 * rng.normal(size=(len(points), 1))
    model = fit_responses(own, points, noisy, [KEY], "multilinear")
    assert np.isnan(known_noise(model)).all() and np.isnan(model.noise).all()
    assert held(model, asked, curved(asked)) >= (0.9 if samples > 2 else 0.5)
    assert (model.predict_with_error(asked)[1] > 0.1).all()


def test_predictions_stay_physically_possible():
    own = problem(1, key="hourglass.mass_flow_rate")
    points = sobol(own, 12)
    model = fit_responses(own, points, np.maximum(0.3 - points, 0) ** 2, own_keys(own))
    asked = np.linspace(0, 0.4, 101)[:, None]
    assert (model.predict(asked) >= 0).all() and (model.predict_with_error(asked)[0] >= 0).all()


def own_keys(own):
    return [t.key for t in own.targets]


def test_a_response_that_never_changes_is_predicted_as_it_is():
    own = problem(2)
    points = np.repeat(sobol(own, 8), 2, axis=0)
    model = fit_responses(own, points, np.full((16, 1), 7.0), [KEY])
    mean, error = model.predict_with_error(inside(20, 2))
    assert mean == pytest.approx(7.0) and np.isfinite(error).all()


def test_seeds_that_move_two_responses_alike_are_noticed_and_chance_is_not():
    rng = np.random.default_rng(2)
    points = np.repeat(np.arange(30.0), 2)[:, None]
    first, second = rng.normal(size=(2, 60, 1))
    shared = alike_seeds(points, np.hstack([first, -3 * first, second]))
    assert shared[0, 1] == pytest.approx(1) and shared[0, 2] < 0.15
    single = alike_seeds(np.arange(5.0)[:, None], rng.normal(size=(5, 2)))
    np.testing.assert_array_equal(single, np.eye(2))


@pytest.mark.parametrize("name", ["bed_viscosity", "bond_number", "time_step"])
def test_similarity_is_refused_beside_what_has_a_scale_of_its_own(name):
    sand = (Parameter("particle_density", 2000, 3000), Parameter("young_modulus", 1e6, 1e7))
    targets = (Target("hourglass", "bulk_density", 1500.0),)
    Coordinates(Problem(sand, targets), collapsed=True)
    with pytest.raises(CalibratorError, match=rf"similarity does not hold beside {name}"):
        Coordinates(Problem(sand, targets, fixed={name: 1e-4}), collapsed=True)
