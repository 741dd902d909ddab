"""Interpolation in other coordinates: log scales, and the density taken out by similarity."""

import numpy as np
import pytest

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.errors import CalibratorError
from calibrator.plan.design import sobol
from calibrator.responses.coordinates import Coordinates
from calibrator.responses.fit import fit_responses

KEYS = ("hourglass.bulk_density", "hourglass.drained_equivalent_angle_deg")
FRICTION = Parameter("sliding_friction", 0.2, 0.7)
DENSITY = Parameter("particle_density", 2000.0, 3000.0)
MODULUS = Parameter("young_modulus", 5e6, 50e6, scale="log")


def problem(*parameters):
    return Problem(parameters, tuple(Target(*key.split("."), 1.0) for key in KEYS))


def truth(points):
    """A response that obeys similarity: functions of friction and E/rho, the first times rho."""
    friction, density, modulus = points.T
    soft = np.log(modulus / density)
    return np.column_stack(
        [density * (0.6 - 0.1 * friction - 0.01 * soft), 20 + 30 * friction + soft]
    )


def test_a_process_on_the_log_scale_is_exact_where_the_response_is_linear_in_the_logarithm():
    own = problem(MODULUS)
    points = sobol(own, 8)
    values = np.column_stack([np.log(points[:, 0])] * 2)
    model = fit_responses(own, points, values, KEYS, noise=np.full(2, 1e-4))
    asked = np.array([[5e6], [20e6], [50e6]])
    assert model.predict(asked)[:, 0] == pytest.approx(np.log(asked[:, 0]), abs=1e-3)
    with pytest.raises(
        CalibratorError, match=r"young_modulus = 6e[+]07 lies outside 5e[+]06 to 5e[+]07"
    ):
        model.predict(np.array([[60e6]]))


def test_collapsed_runs_at_one_density_predict_every_density():
    own = problem(FRICTION, DENSITY, MODULUS)
    points = sobol(own, 24)
    points[:, 2] *= 2500.0 / points[:, 1]  # the same E/rho at the box's mean density
    points[:, 1] = 2500.0
    inside = (points[:, 2] >= 5e6) & (points[:, 2] <= 50e6)
    points = points[inside]
    model = fit_responses(
        own, points, truth(points), KEYS, similarity=True, noise=np.array([0.1, 1e-3])
    )
    asked = np.array([[0.3, 2100.0, 10e6], [0.6, 2900.0, 30e6]])
    mean, error = model.predict_with_error(asked)
    assert mean == pytest.approx(truth(asked), rel=2e-3)
    assert (error > 0).all() and model.inner.inner.points.shape[1] == 2
    assert mean == pytest.approx(model.predict(asked))
    # both E/rho = 5000
    ratio = model.predict(np.array([[0.3, 2100.0, 10.5e6], [0.3, 2900.0, 14.5e6]]))
    assert ratio[1, 0] / ratio[0, 0] == pytest.approx(2900 / 2100) and ratio[1, 1] == pytest.approx(
        ratio[0, 1]
    )


def test_the_collapsed_box_holds_every_corner():
    own = problem(FRICTION, DENSITY, MODULUS)
    change = Coordinates(own, True)
    corners = np.array(
        [[f, d, e] for f in (0.2, 0.7) for d in (2000.0, 3000.0) for e in (5e6, 50e6)]
    )
    inward = change.inward(corners)
    assert (inward >= change.bounds[0] - 1e-12).all() and (inward <= change.bounds[1] + 1e-12).all()
    assert inward.min(axis=0) == pytest.approx(change.bounds[0]) and inward.max(
        axis=0
    ) == pytest.approx(change.bounds[1])


def test_leaving_one_out_is_reported_per_parameter_set():
    own = problem(FRICTION, DENSITY, MODULUS)
    # the last two are one to similarity
    points = np.vstack([sobol(own, 16), [[0.5, 2200.0, 11e6], [0.5, 2600.0, 13e6]]])
    model = fit_responses(
        own, points, truth(points), KEYS, similarity=True, noise=np.array([1.0, 0.01])
    )
    left_out, scatter = model.leave_one_out()
    assert left_out.shape == scatter.shape == model.values.shape == (18, 2)
    assert len(model.inner.inner.points) == 17
    assert np.abs(left_out - model.values).max(axis=0) == pytest.approx([0, 0], abs=40)


def test_similarity_without_density_or_modulus_is_refused():
    with pytest.raises(CalibratorError, match="needs both particle_density and young_modulus"):
        Coordinates(problem(FRICTION, MODULUS), True)
