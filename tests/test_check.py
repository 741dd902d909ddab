"""What `calibrator check` finds before a run is made."""

import dataclasses
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
