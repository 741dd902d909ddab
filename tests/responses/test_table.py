"""Records as arrays."""

import numpy as np

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.responses.table import response_table
from tests.runs.test_database import some_records


def test_failed_and_clogged_runs_never_reach_the_interpolation():
    problem = Problem(
        (Parameter("sliding_friction", 0.1, 0.9),), (Target("hourglass", "discharge_time", 1.0),)
    )
    points, values = response_table(
        problem, some_records(), ["hourglass.discharge_time", "ledge.bulk_density"]
    )
    assert len(points) == 10 and np.isfinite(values).sum(axis=1).tolist() == [1] * 10
