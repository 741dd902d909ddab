"""Designs over the box of the parameters."""

import numpy as np
import pytest

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.plan.design import full_grid, sobol

MODULUS = Parameter("young_modulus", 5e6, 50e6, scale="log")


def problem(*parameters):
    return Problem(parameters, (Target("hourglass", "bulk_density", 1.0),))


def test_a_log_scale_spaces_the_design_by_equal_factors():
    values = full_grid(problem(Parameter("young_modulus", 5e6, 500e6, samples=3, scale="log")))[
        :, 0
    ]
    assert values == pytest.approx([5e6, 50e6, 500e6])
    assert values[[0, -1]].tolist() == [5e6, 500e6]
    points = sobol(problem(MODULUS), 63)[:, 0]
    assert (points < np.sqrt(5e6 * 50e6)).sum() == 31
