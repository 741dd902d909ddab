"""The case files that come with the project."""

from pathlib import Path

import pytest

from calibrator.case.toml import read_case
from calibrator.check import check_case
from calibrator.cli import main
from calibrator.diagnosis.diagnose import diagnose
from calibrator.plan.requests import plan_requests
from calibrator.runs import workspace
from calibrator.runs.setups import particles

CASES = Path(__file__).resolve().parent.parent / "cases"


@pytest.mark.parametrize(
    "path",
    sorted(p for p in CASES.glob("*.toml") if "\n[plan]" in p.read_text()),
    ids=lambda p: p.stem,
)
def test_every_case_is_good(path, tmp_path, fake_yade):
    space = workspace.Workspace(read_case(path), tmp_path)
    assert check_case(space).runs == len(plan_requests(space.case))


def test_the_full_scale_case_is_the_papers_grid_of_810_runs_of_25_g(tmp_path, fake_yade):
    case = read_case(CASES / "quartz_sand_full.toml")
    counts = {
        r.parameters["particle_radius"]: particles(r)
        for r in plan_requests(case)
        if r.parameters["particle_density"] == 2800
    }
    assert len(plan_requests(case)) == 810
    assert counts[0.4e-3] == pytest.approx(33_300, rel=0.01) and counts[0.3e-3] == pytest.approx(
        78_900, rel=0.01
    )
    warnings = check_case(workspace.Workspace(case, tmp_path)).warnings
    assert any("Rayleigh time" in w for w in warnings)
    assert sum(p.bits for p in case.problem.parameters) == 40


def test_the_case_of_the_demo_does_not_contain_the_truth_behind_its_lab():
    case = read_case(CASES / "coarse_sand.toml")
    text = (CASES / "coarse_sand.toml").read_text()
    assert case.truth and all(f"{value:g}" not in text for value in case.truth.values())


def test_the_reduced_case_has_the_papers_parameters_and_enough_replicates():
    full, reduced = (read_case(CASES / f"quartz_sand_{size}.toml") for size in ("full", "reduced"))
    assert reduced.problem.names == full.problem.names
    ranges = {p.name: (p.low, p.high) for p in full.problem.parameters}
    for p in reduced.problem.parameters:
        assert (p.low, p.high) == (ranges[p.name] if p.name != "young_modulus" else (5e6, 50e6))
    grid = read_case(CASES / "quartz_sand_reduced_grid.toml")
    assert grid.problem.setups["hourglass"] == reduced.problem.setups["hourglass"]
    sets = reduced.plan.sets + len(plan_requests(grid))
    assert (
        sets >= 150 and reduced.plan.replicated_sets >= 0.2 * sets and reduced.plan.replicates >= 3
    )


def test_the_forecast_on_the_cluster_page_is_what_plan_prints(tmp_path, capsys):
    assert main(["plan", str(CASES / "quartz_sand_full.toml"), "--results", str(tmp_path)]) == 0
    printed = capsys.readouterr().out.splitlines()[:2]
    page = (CASES.parent / "docs" / "cluster.md").read_text()
    assert len(printed) == 2 and all(f"\n{line}\n" in page for line in printed)


def test_the_five_numbers_of_the_paper_cannot_tell_what_is_missing(tmp_path):
    space = workspace.Workspace(
        read_case(CASES / "quartz_sand_full.toml"), tmp_path / "quartz_sand_full"
    )
    found = diagnose(space)
    assert found.verdict == "cannot tell"
    assert (
        "3 observables against 5 parameters" in found.sentence
        and "measure at least 7 more" in found.sentence
    )
