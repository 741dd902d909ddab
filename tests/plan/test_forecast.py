"""`calibrator plan`: the table of every run, and what they will cost."""

import pytest

from calibrator.plan.forecast import forecast
from tests.conftest import space_for


def test_plan_writes_a_table_that_holds_every_run(write_case, tmp_path):
    space = space_for(write_case(('design = "sobol"', 'design = "grid"')), tmp_path)
    outcome = forecast(space)
    lines = (space.path / "plan" / "hourglass.table").read_text().splitlines()
    assert outcome.runs == 4 * 4 * 2 * 2 == len(lines) - 1
    assert outcome.core_hours == pytest.approx(sum(s.core_hours for s in outcome.setups.values()))
