"""Which runs belong to a case."""

import numpy as np

from calibrator.case.toml import read_case
from calibrator.plan.requests import belongs, make_request


def test_only_runs_with_the_case_s_fixed_values_and_inside_its_box_belong(write_case):
    case = read_case(write_case())
    point = np.array([0.2, 0.5, 1e6])
    good = make_request(case, "hourglass", point, 7)
    assert belongs(case, good)
    for other in ({"restitution": 0.8}, {"rolling_friction": 0.04}, {"fill_mass": 0.02}):
        assert not belongs(case, type(good).of("hourglass", **{**good.parameters, **other}))
    assert not belongs(case, make_request(case, "ledge", point, 7))
