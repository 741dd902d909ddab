"""The folder of a case's results, and the summary in it: whole and unedited, or not believed."""

import dataclasses

import pytest

from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.plan.forecast import forecast
from calibrator.plan.outcome import Forecast
from calibrator.runs import local, workspace
from calibrator.runs.request import Request
from tests.conftest import space_for


@pytest.mark.parametrize("name", ["", "plan"])
def test_a_link_in_place_of_a_results_folder_is_refused(write_case, tmp_path, name, capsys):
    outside = tmp_path / "outside"
    outside.mkdir()
    link = tmp_path / "out" / "toy" / name
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(outside)
    assert main(["plan", str(write_case()), "--results", str(tmp_path / "out")]) == 2
    assert "symbolic link" in capsys.readouterr().err and not list(outside.iterdir())


@pytest.mark.parametrize(
    "state",
    [
        "{}",
        "[]",
        "null",
        '{"calibrate": {}}',
        '{"calibrate": {"candidates": {"compromise": 1}}}',
        "[" * 9999,
        '{"seal": "0"}',
        "",
    ],
)
@pytest.mark.parametrize("verb", ["verify", "validate", "report", "plan"])
def test_a_damaged_summary_is_one_line_for_every_verb(write_case, tmp_path, capsys, state, verb):
    (tmp_path / "out" / "toy").mkdir(parents=True)
    (tmp_path / "out" / "toy" / "summary.json").write_text(state)
    assert (
        main([verb, str(write_case(("sets = 14", "sets = 2"))), "--results", str(tmp_path / "out")])
        == 2
    )
    error = capsys.readouterr().err
    assert "summary.json is damaged" in error and error.count("\n") == 1


def test_a_summary_edited_by_hand_is_not_believed(write_case, tmp_path):
    space = workspace.Workspace(read_case(write_case(("sets = 14", "sets = 2"))), tmp_path / "toy")
    forecast(space)
    assert space.outcome("plan", Forecast).runs == 4
    path = space.path / "summary.json"
    path.write_text(path.read_text().replace('"runs": 4', '"runs": 5', 1))
    with pytest.raises(CalibratorError, match="edited"):
        space.summary()


def test_the_budget_is_asked_before_every_batch_and_knows_what_was_spent(
    write_case, tmp_path, fake_yade
):
    space = space_for(write_case(("jobs = 1", "jobs = 1\nbudget_core_hours = 100")), tmp_path)
    few = [Request.of("ledge", seed=s) for s in range(2)]
    hours = workspace.work_left(space, few)[1]
    budget = workspace.Budget("run.budget_core_hours", 1.001 * hours)
    workspace.carry_out(space, few, workspace.silent, budget)
    assert 0 < sum(space.spent) < hours
    workspace.carry_out(space, few, workspace.silent, budget)  # they are there: nothing to spend
    more = [Request.of("ledge", seed=s) for s in range(2, 4)]
    with pytest.raises(
        CalibratorError,
        match=r"^2 runs would take .* beyond the .* more than run\.budget_core_hours = .* kept",
    ):
        workspace.carry_out(space, more, workspace.silent, dataclasses.replace(budget, hours=hours))
    assert len(space.finished(few)) == 2 and space.finished(more) == []


def test_the_rate_of_the_case_is_what_hours_and_limits_of_runs_start_from(
    write_case, tmp_path, fake_yade, monkeypatch
):
    """Limits that rest on a fast machine's rate end sound runs on a slow one."""
    limits = []
    monkeypatch.setattr(
        local, "cpu_limit", lambda cost, patience: limits.append(max(cost.values())) or 999.0
    )
    asked, hours = [Request.of("ledge", seed=1)], []
    for rate in ("2e6", "1e6"):
        case = write_case(("jobs = 1", f"jobs = 1\nparticle_steps_per_second = {rate}"))
        space = space_for(case, tmp_path / rate)
        hours.append(workspace.work_left(space, asked)[1])
        workspace.carry_out(space, asked, workspace.silent)
    assert limits == pytest.approx([3600 * h for h in hours]) and hours[1] > 1.5 * hours[0]


def test_a_verification_asks_the_budget_too(write_case, tmp_path, fake_yade, capsys):
    results = ["--results", str(tmp_path / "results")]
    path = str(write_case())
    for verb in ("run", "collect", "calibrate"):
        assert main([verb, path, *results]) == 0
    path = str(write_case(("jobs = 1", "jobs = 1\nbudget_core_hours = 1e-6")))
    capsys.readouterr()
    assert main(["verify", path, *results]) == 2
    assert "run.budget_core_hours" in capsys.readouterr().err
