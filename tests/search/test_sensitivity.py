"""Sobol indices against functions whose indices can be written down."""

import numpy as np
import pytest

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.search.sensitivity import sensitivity

PARAMETERS = (Parameter("rolling_friction", 0.0, 1.0), Parameter("sliding_friction", 0.0, 1.0))
KEYS = ["hourglass.bulk_density", "hourglass.discharge_time"]


class Formula:
    """An interpolant that is a formula."""

    responses = KEYS

    def __init__(self, function):
        self.function = function

    def predict(self, points):
        return self.function(*points.T)


def problem(parameters=PARAMETERS):
    return Problem(parameters, tuple(Target(*key.split("."), 1.0) for key in KEYS))


def test_indices_of_a_sum_and_of_a_product_are_those_of_their_variances():
    found = sensitivity(
        problem(), Formula(lambda x, y: np.column_stack([3 * x + y, (x - 0.5) * (y - 0.5)]))
    )
    assert found.first[0] == pytest.approx([0.9, 0.1], abs=0.01) and found.total[
        0
    ] == pytest.approx([0.9, 0.1], abs=0.01)
    assert found.first[1] == pytest.approx([0, 0], abs=0.03) and found.total[1] == pytest.approx(
        [1, 1], abs=0.05
    )


def test_intervals_hold_the_truth():
    found = sensitivity(problem(), Formula(lambda x, y: np.column_stack([3 * x + y, x + y])))
    for values, errors in ((found.first, found.first_error), (found.total, found.total_error)):
        assert (np.abs(values - [[0.9, 0.1], [0.5, 0.5]]) <= 2 * errors + 1e-3).all() and (
            errors < 0.1
        ).all()


def test_a_parameter_on_a_log_scale_is_uniform_in_its_logarithm():
    modulus = Parameter("young_modulus", 1e6, 1e8, scale="log")
    found = sensitivity(
        problem((PARAMETERS[0], modulus)),
        Formula(lambda x, e: np.column_stack([x + np.log(e / 1e6) / np.log(100), e])),
    )
    assert found.first[0] == pytest.approx([0.5, 0.5], abs=0.02)


def test_scatter_among_interpolants_that_lack_a_part_widens_the_intervals_as_a_jackknife_does():
    def sloped(slope):
        return Formula(lambda x, y: np.column_stack([slope * x + y, x]))

    alone = sensitivity(problem(), sloped(3.0))
    parts = [2.8, 2.9, 3.0, 3.1, 3.2]
    jackknifed = sensitivity(problem(), sloped(3.0), [sloped(s) for s in parts])
    shares = np.array([s**2 / (s**2 + 1) for s in parts])
    expected = 1.96 * np.sqrt(4 / 5 * ((shares - shares.mean()) ** 2).sum())
    assert np.sqrt(
        jackknifed.first_error[0, 0] ** 2 - alone.first_error[0, 0] ** 2
    ) == pytest.approx(expected, rel=0.05)
    assert jackknifed.first_error[1, 0] == pytest.approx(alone.first_error[1, 0])
