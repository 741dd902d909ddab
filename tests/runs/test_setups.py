"""What a run costs, as its set-up foresees it."""

from calibrator.runs.request import Request
from calibrator.runs.setups import steps


def test_a_time_step_next_to_nothing_has_a_cost_too():
    assert steps(Request.of("ledge", time_step=5e-324)) >= 10**15
