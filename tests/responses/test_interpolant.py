"""What the two interpolants have in common: seed noise, and the box that they stay in."""

import numpy as np
import pytest

from calibrator.errors import CalibratorError
from calibrator.responses.interpolant import seed_noise
from tests.responses.known_functions import (
    HIGH,
    NOISE,
    grid,
    multilinear,
    noisy_runs,
    process,
    smooth,
)


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


@pytest.mark.parametrize("fit", [multilinear, process])
def test_counts_need_the_noise_that_they_hide(fit):
    with pytest.raises(CalibratorError, match="give noise together with counts"):
        fit(grid(3, 3), smooth(grid(3, 3)), counts=np.full(9, 2))
