"""What `calibrator check` finds before a run is made."""

import dataclasses
import re
from pathlib import Path

import pytest

from calibrator.case.toml import read_case
from calibrator.check import check_case
from calibrator.cli import main
from calibrator.runs import workspace

CASES = Path(__file__).resolve().parent.parent / "cases"


def test_an_unknown_objective_is_found_by_check(write_case, tmp_path, capsys):
    path = write_case(("population = 60", 'population = 60\nobjectives = ["eror"]'))
    assert main(["check", str(path), "--results", str(tmp_path)]) == 2
    assert "did you mean error?" in capsys.readouterr().err


@pytest.mark.parametrize(("numerics", "warned"), [({}, True), ({"rayleigh_fraction": 0.2}, False)])
def test_inelastic_grains_at_the_default_step_are_warned_of(tmp_path, fake_yade, numerics, warned):
    case = read_case(CASES / "coarse_sand.toml")
    problem = dataclasses.replace(
        case.problem, fixed={**case.problem.fixed, "restitution": 0.5, **numerics}
    )
    case = dataclasses.replace(case, problem=problem)
    warnings = check_case(workspace.Workspace(case, tmp_path)).warnings
    assert (
        any("restitution below 0.6" in w and "rayleigh_fraction = 0.2" in w for w in warnings)
        is warned
    )


def warnings_of(tmp_path, **fixed):
    """What check says of the demo with other fixed values."""
    case = read_case(CASES / "coarse_sand.toml")
    problem = dataclasses.replace(case.problem, fixed={**case.problem.fixed, **fixed})
    case = dataclasses.replace(case, problem=problem)
    return check_case(workspace.Workspace(case, tmp_path)).warnings


def test_a_step_that_the_damping_does_not_bear_is_warned_of_with_one_that_it_does(
    tmp_path, fake_yade
):
    """A fifth of the Rayleigh time, which was the advice, made beds of restitution 0.4 explode."""
    for restitution in (0.3, 0.35, 0.4):
        told = warnings_of(tmp_path, restitution=restitution, time_step=4e-5)
        (said,) = [w for w in told if "time_step" in w or "Rayleigh" in w]
        assert "unstable for a restitution of" in said and "set rayleigh_fraction" not in said
        number = float(re.search(r"lower it to (\S+) s, or", said).group(1))
        assert 1e-6 < number < 4e-5
        told = warnings_of(tmp_path, restitution=restitution, time_step=number)
        assert not any("unstable" in w for w in told)
        share = [w for w in warnings_of(tmp_path, restitution=restitution) if "unstable" in w]
        assert len(share) == 1 and "at most" in share[0] and "of the Rayleigh time" in share[0]


def test_a_step_as_it_is_told_is_not_warned_of(tmp_path, fake_yade):
    told = [w for w in warnings_of(tmp_path, restitution=0.9, time_step=1e-3) if "lower it" in w]
    number = float(re.search(r"lower it to (\S+) s", told[0]).group(1))
    now = warnings_of(tmp_path, restitution=0.9, time_step=number)
    assert len(told) == 1 and not any("lower it" in w for w in now)


def test_elastic_grains_are_warned_of_no_damping(tmp_path, fake_yade):
    assert not any("unstable" in w for w in warnings_of(tmp_path, restitution=0.9))
    assert not any("unstable" in w for w in warnings_of(tmp_path, restitution=0.9, time_step=2e-5))


def test_a_step_under_a_set_up_or_a_condition_is_looked_at_as_well(tmp_path, write_case, fake_yade):
    """The problem's own values do not have it."""
    coarse = "[setups.ledge]\nrayleigh_fraction = 0.8\n"
    other = '[conditions.hasty]\nsetup = "hourglass"\ntime_step = 1e-3\n'
    path = write_case(("[plan]", coarse + other + "[plan]"))
    warnings = check_case(workspace.Workspace(read_case(path), tmp_path)).warnings
    assert any(w.startswith("ledge: rayleigh_fraction = 0.8") for w in warnings)
    assert any(w.startswith("hourglass@hasty: time_step = 0.001 s is unstable") for w in warnings)
