"""Which runs belong to a case."""

import numpy as np

from calibrator.case.toml import read_case
from calibrator.plan.requests import belongs, make_request, plan_requests
from calibrator.runs import cost


def test_only_runs_with_the_case_s_fixed_values_and_inside_its_box_belong(write_case):
    case = read_case(write_case())
    point = np.array([0.2, 0.5, 1e6])
    good = make_request(case, "hourglass", point, 7)
    assert belongs(case, good)
    for other in ({"restitution": 0.8}, {"rolling_friction": 0.04}, {"fill_mass": 0.02}):
        assert not belongs(case, type(good).of("hourglass", **{**good.parameters, **other}))
    assert not belongs(case, make_request(case, "ledge", point, 7))


def test_a_plan_is_the_same_on_every_machine(write_case, monkeypatch):
    """Which sets get replicates went by what runs cost, and shipped runs were not found."""
    radius = "\n[parameters.particle_radius]\nlow = 0.5e-3\nhigh = 0.9e-3\n"
    text = (
        ("[plan]", f"{radius}[plan]"),
        ('design = "sobol"', 'design = "sobol"\nreplicated_sets = 6'),
    )
    there = plan_requests(read_case(write_case(*text)))
    monkeypatch.setattr(cost, "FALL", 5.0)
    slow = *text, ("jobs = 1", "jobs = 1\nparticle_steps_per_second = 1e4")
    assert plan_requests(read_case(write_case(*slow))) == there
