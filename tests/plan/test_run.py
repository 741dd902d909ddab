"""Carrying out a plan or an adaptive design: substitutes, budgets, and the log of proposals."""

import json
import os

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.plan.requests import make_request, plan_requests
from calibrator.plan.run import collect, database_records, note_proposal, proposed, run_plan
from calibrator.plan.seeds import SUBSTITUTE_SEED
from calibrator.runs import workspace
from calibrator.runs.database import Database
from tests.conftest import LAB, space_for
from tests.stand_in import World, put_in_place


def test_a_log_of_proposals_is_whole_after_every_write(write_case, tmp_path, monkeypatch):
    from calibrator.plan.adaptive import Proposal

    space = workspace.Workspace(read_case(write_case()), tmp_path / "toy")
    proposal = Proposal("explore", np.zeros((1, 3)), np.zeros(3), 0.1, "a run")
    first, second = plan_requests(space.case)[:2]
    for request in (first, second):
        note_proposal(space, proposal, [request])
    assert proposed(space) == [first, second]
    monkeypatch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        note_proposal(space, proposal, plan_requests(space.case)[2:3])
    assert proposed(space) == [first, second]


def test_a_clogged_run_gets_a_substitute_and_stays_counted(write_case, tmp_path, fake_yade):
    space = space_for(write_case(("sets = 14", "sets = 4")), tmp_path)
    clogged = plan_requests(space.case)[3]
    space.path.mkdir(parents=True)
    (space.path / "misbehave.json").write_text(
        json.dumps({str(clogged.parameters["seed"]): "clog"})
    )
    outcome = run_plan(space)
    assert outcome.statuses == {"clogged": 1, "ok": 8}
    collect(space)
    seeds = {
        r.request.parameters["seed"]
        for r in Database.read(space.path / "database.csv").records.values()
    }
    assert clogged.parameters["seed"] + SUBSTITUTE_SEED in seeds


def test_a_plan_beyond_its_budget_does_not_start(write_case, tmp_path, fake_yade):
    space = space_for(write_case(("jobs = 1", "jobs = 1\nbudget_core_hours = 0.01")), tmp_path)
    with pytest.raises(CalibratorError, match="budget_core_hours"):
        run_plan(space)


TIGHT = "".join(
    f'[targets."hourglass.{k}"]\ntolerance = 0.006\n'
    for k in ("bulk_density", "drained_equivalent_angle_deg", "mass_flow_rate")
)
ADAPTIVE = (
    'design = "sobol"\nsets = 14\nreplicates = 2',
    'design = "adaptive"\nsets = 9\nreplicates = 3\nmost_runs = 60\n' + TIGHT,
)


def test_the_workflow_runs_an_adaptive_design_and_never_repeats_a_run(
    write_case, tmp_path, fake_yade
):
    path = write_case(ADAPTIVE)
    assert main(["all", str(path), "--results", str(tmp_path / "results")]) == 0
    folder = tmp_path / "results" / "toy"
    outcome = json.loads((folder / "summary.json").read_text())["run"]
    assert outcome["ended"] == "confirmed" and outcome["runs"] <= 60
    calls = (folder / "calls.txt").read_text().split()
    assert len(calls) == len(set(calls))
    assert main(["run", str(path), "--results", str(tmp_path / "results")]) == 0
    assert (folder / "calls.txt").read_text().split() == calls
    lines = [json.loads(line) for line in (folder / "proposals.jsonl").read_text().splitlines()]
    assert all(line["sentence"] and line["requests"] for line in lines)


def test_an_adaptive_design_starts_from_the_shipped_database(write_case, tmp_path, fake_yade):
    first = write_case()
    assert main(["run", str(first), "--results", str(tmp_path / "old")]) == 0
    assert main(["collect", str(first), "--results", str(tmp_path / "old")]) == 0
    shipped = "old/toy/database.csv"
    path = write_case(ADAPTIVE, ("jobs = 1", f'jobs = 1\nshipped = "{shipped}"'))
    assert main(["run", str(path), "--results", str(tmp_path / "new")]) == 0
    outcome = json.loads((tmp_path / "new" / "toy" / "summary.json").read_text())["run"]
    assert outcome["from_shipped_database"] == 28
    made = (tmp_path / "new" / "toy" / "calls.txt").read_text().split()
    assert outcome["runs"] == 28 + len(made) and len(made) < 27


def test_an_interrupted_design_first_makes_the_runs_it_had_proposed(
    write_case, tmp_path, fake_yade
):
    case = read_case(write_case(ADAPTIVE))
    space = workspace.Workspace(case, tmp_path / "toy")
    space.path.mkdir(parents=True)
    left = make_request(case, "hourglass", np.array([0.2, 0.5, 1e6]), 99)
    made = [{"setup": left.setup, "parameters": left.parameters}]
    (space.path / "proposals.jsonl").write_text(
        json.dumps({"sentence": "", "requests": made}) + "\n"
    )
    run_plan(space)
    assert left.run_id in (space.path / "calls.txt").read_text()


def test_runs_that_an_adaptive_design_proposed_before_the_geometry_changed_are_none_of_its(
    write_case, tmp_path, monkeypatch
):
    """Nor are those of another case that has the same name."""
    put_in_place(monkeypatch, World())
    adaptive = [
        ('"sobol"\nsets = 14\nreplicates = 2', '"adaptive"\nsets = 8\nreplicates = 3'),
        ("[run]", "[setups.hourglass]\nneck_diameter = 0.014\n[run]"),
    ]
    first = run_plan(space_for(write_case(*adaptive), tmp_path))
    assert first.ended == "confirmed"
    wider = write_case(*adaptive, ("0.014", "0.0145"))
    space = space_for(wider, tmp_path)
    run_plan(space)
    assert {r.request.parameters["neck_diameter"] for r in database_records(space)} == {0.0145}


WITH_LEDGE = LAB.replace("37.44,0.2,8,deg,held_out", "37.44,0.2,8,deg,calibrate")
CEILING = (
    'design = "sobol"\nsets = 14\nreplicates = 2',
    'design = "adaptive"\nsets = 8\nreplicates = 3\nmost_runs = 21',
)


@pytest.mark.parametrize("status", ["clogged", "not_settled", "crash"])
def test_an_adaptive_design_never_makes_more_runs_than_it_may(
    write_case, tmp_path, monkeypatch, status
):
    fails = World(status_of=lambda s, p, seed: status if seed >= 10_000_000 else "ok")
    put_in_place(monkeypatch, fails)
    with pytest.raises(CalibratorError, match=r"starts with 24 runs, more than .* = 21"):
        space_for(write_case(CEILING, lab=WITH_LEDGE), tmp_path)
    space = space_for(write_case(CEILING), tmp_path)
    outcome = run_plan(space)
    assert outcome.runs == 21 == sum(outcome.statuses.values())
    assert outcome.statuses["ok"] == 12 and outcome.ended == "budget"
    assert "budget of 21 runs is used, and no set is confirmed" in outcome.lines()[-1]
    assert run_plan(space).runs == 21  # nor when it is called again


@pytest.mark.parametrize("design", [CEILING, ("sets = 14", "sets = 6")])
def test_a_plan_of_which_every_run_clogs_ends_in_one_sentence(
    write_case, tmp_path, monkeypatch, capsys, design
):
    put_in_place(monkeypatch, World(status_of=lambda s, p, seed: "clogged"))
    path = write_case(design)
    assert main(["all", str(path), "--results", str(tmp_path / "results")]) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert "hourglass runs clogged: widen the neck" in said


def test_a_design_with_too_few_good_runs_makes_more_far_from_them_all(
    write_case, tmp_path, monkeypatch
):
    def one_in_three(setup, p, seed):
        return "ok" if p["sliding_friction"] < 0.35 else "clogged"

    made = put_in_place(monkeypatch, World(status_of=one_in_three))
    few = (
        'design = "sobol"\nsets = 14\nreplicates = 2',
        'design = "adaptive"\nsets = 4\nmost_runs = 30',
    )
    outcome = run_plan(space_for(write_case(few), tmp_path))
    assert outcome.statuses["ok"] > 5 and len(made.made) <= 30 and outcome.ended
    nothing = few[0], few[1].replace("30", "7")
    space = space_for(write_case(nothing), tmp_path / "again")
    with pytest.raises(CalibratorError, match=r"used its budget, and hourglass.*was measured at"):
        run_plan(space)
