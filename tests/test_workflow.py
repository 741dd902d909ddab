"""The whole way on a fake YADE whose answer is known, and what happens when it is interrupted."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.conftest import LAB

from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.plan import forecast
from calibrator.plan.requests import plan_requests
from calibrator.plan.run import collect, database_records, run_plan
from calibrator.plan.seeds import SUBSTITUTE_SEED
from calibrator.runs import workspace
from calibrator.runs.database import Database
from calibrator.search.calibrate import calibrate
from calibrator.verification.verify import verification_requests, verify

REPO = Path(__file__).resolve().parent.parent


def space_for(path, results, fresh=False):
    case = read_case(path)
    return workspace.Workspace(case, results / case.name, fresh)


def test_the_whole_way_recovers_the_frictions_and_passes_its_verification(
    write_case, tmp_path, fake_yade, capsys
):
    path = write_case()
    assert main(["all", str(path), "--results", str(tmp_path / "results")]) == 0
    summary = json.loads((tmp_path / "results" / "toy" / "summary.json").read_text())
    assert {"check", "plan", "run", "collect", "calibrate", "verify", "validate", "report"} <= set(
        summary
    )
    found = {p["name"]: p for p in summary["calibrate"]["identifiability"]["parameters"]}
    for name, true in (("rolling_friction", 0.25), ("sliding_friction", 0.5)):
        low, high = found[name]["interval_95"]
        assert low <= true <= high and found[name]["pinned"], name
    assert not found["young_modulus"]["pinned"]
    assert summary["verify"]["passed"] and summary["validate"]["passed"]
    assert "compromise: passed" in capsys.readouterr().out
    calls = (tmp_path / "results" / "toy" / "calls.txt").read_text().split()
    assert main(["all", str(path), "--results", str(tmp_path / "results")]) == 0
    assert (tmp_path / "results" / "toy" / "calls.txt").read_text().split() == calls, (
        "a second call ran something again"
    )


def test_after_kill_9_in_mid_run_the_database_is_the_same_to_the_byte(
    write_case, tmp_path, fake_yade
):
    path = write_case(("sets = 14", "sets = 4"))
    whole, broken = space_for(path, tmp_path / "whole"), space_for(path, tmp_path / "broken")
    run_plan(whole)
    collect(whole)
    broken.path.mkdir(parents=True)
    (broken.path / "misbehave.json").write_text('{"duration": 0.2}')
    command = [
        sys.executable,
        "-m",
        "calibrator.cli",
        "run",
        str(path),
        "--results",
        str(tmp_path / "broken"),
    ]
    driver = subprocess.Popen(command, start_new_session=True, stderr=subprocess.DEVNULL)
    end = time.monotonic() + 30
    while len(list(broken.path.glob("records/*.json"))) < 3:
        assert time.monotonic() < end
        time.sleep(0.05)
    os.kill(driver.pid, signal.SIGKILL)
    driver.wait()
    run_plan(broken)
    collect(broken)
    assert (broken.path / "database.csv").read_bytes() == (whole.path / "database.csv").read_bytes()


def test_a_clogged_run_gets_a_substitute_and_stays_counted(write_case, tmp_path, fake_yade):
    space = space_for(write_case(("sets = 14", "sets = 4")), tmp_path)
    clogged = plan_requests(space.case)[3]
    space.path.mkdir(parents=True)
    (space.path / "misbehave.json").write_text(
        json.dumps({str(clogged.parameters["seed"]): "clog"})
    )
    outcome = run_plan(space)
    assert outcome["statuses"] == {"clogged": 1, "ok": 8}
    collect(space)
    seeds = {
        r.request.parameters["seed"]
        for r in Database.read(space.path / "database.csv").records.values()
    }
    assert clogged.parameters["seed"] + SUBSTITUTE_SEED in seeds


def test_shipped_runs_start_a_plan_but_never_a_verification(write_case, tmp_path, fake_yade):
    path = write_case()
    first = space_for(path, tmp_path / "first")
    for verb in (run_plan, collect, calibrate, verify):
        verb(first)
    everything = [
        *database_records(first),
        *(r for q in verification_requests(first).values() for r in first.finished(q)),
    ]
    Database(everything).write(tmp_path / "shipped.csv")
    shipping = write_case(("jobs = 1", 'jobs = 1\nshipped = "shipped.csv"'))
    second = space_for(shipping, tmp_path / "second")
    assert run_plan(second)["from_shipped_database"] == 28
    assert not (second.path / "calls.txt").exists()
    calibrate(second)
    verify(second)
    assert len((second.path / "calls.txt").read_text().split()) == sum(
        map(len, verification_requests(second).values())
    )
    fresh = space_for(shipping, tmp_path / "third", fresh=True)
    assert run_plan(fresh)["from_shipped_database"] == 0


def test_an_unreachable_target_is_said_before_and_after(write_case, tmp_path, fake_yade):
    space = space_for(write_case(lab=LAB.replace("1605.6", "1800")), tmp_path)
    for verb in (run_plan, collect, verify):
        if verb is verify:
            before = calibrate(space)
        after = verb(space)
    assert (
        before["reachability"]["missed"] == ["hourglass.bulk_density"]
        and not before["reachability"]["all"]
    )
    rows = {r["key"]: r["passed"] for r in after["candidates"]["compromise"]["responses"]}
    assert not after["passed"] and not rows["hourglass.bulk_density"]


def test_a_plan_beyond_its_budget_does_not_start(write_case, tmp_path, fake_yade):
    space = space_for(write_case(("jobs = 1", "jobs = 1\nbudget_core_hours = 0.01")), tmp_path)
    with pytest.raises(CalibratorError, match="budget_core_hours"):
        run_plan(space)


def test_a_verb_out_of_order_names_the_one_to_run_first(write_case, tmp_path, fake_yade, capsys):
    path = write_case()
    assert main(["verify", str(path), "--results", str(tmp_path)]) == 2
    assert "calibrator calibrate" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (("population", "popolation"), "did you mean population"),
        (("low = 0.2", "low = 0.9"), "is not below high"),
        (("[parameters.sliding_friction]", "[parameters.sliding]"), "unknown parameter"),
    ],
)
def test_bad_input_is_one_line_on_stderr_and_a_non_zero_exit(
    write_case, tmp_path, capsys, change, why
):
    assert main(["check", str(write_case(change)), "--results", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert why in error and error.count("\n") == 1


def test_a_nan_target_is_one_line_on_stderr_and_a_non_zero_exit(write_case, tmp_path, capsys):
    assert (
        main(
            ["check", str(write_case(lab=LAB.replace("1605.6", "nan"))), "--results", str(tmp_path)]
        )
        == 2
    )
    assert "give a finite value" in capsys.readouterr().err


def test_a_missing_yade_is_one_line_on_stderr_and_a_non_zero_exit(
    write_case, tmp_path, capsys, monkeypatch
):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["run", str(write_case()), "--results", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "is not installed" in error and error.count("\n") == 1


def test_plan_writes_a_table_that_holds_every_run(write_case, tmp_path):
    space = space_for(write_case(('design = "sobol"', 'design = "grid"')), tmp_path)
    outcome = forecast.plan(space)
    lines = (space.path / "plan" / "hourglass.table").read_text().splitlines()
    assert outcome["runs"] == 4 * 4 * 2 * 2 == len(lines) - 1
    assert outcome["core_hours"] == pytest.approx(
        sum(s["core_hours"] for s in outcome["setups"].values())
    )


def test_a_published_verification_is_followed_without_simulating_and_only_by_its_own_runs(
    write_case, tmp_path, fake_yade, capsys
):
    path = write_case()
    assert main(["all", str(path), "--results", str(tmp_path / "first")]) == 0
    shipped = "first/toy"
    tables = f'[verify]\nshipped = "{shipped}/verification.csv"'
    again = write_case(
        ("[verify]", tables), ("jobs = 1", f'jobs = 1\nshipped = "{shipped}/database.csv"')
    )
    capsys.readouterr()
    assert main(["all", str(again), "--results", str(tmp_path / "second")]) == 0
    said = capsys.readouterr().out
    assert "compromise: passed" in said and "(4 of its runs come with the project)" in said
    validation = read_case(again).validate.replicates * 2
    calls = (tmp_path / "second" / "toy" / "calls.txt").read_text().split()
    assert len(calls) == validation, "only the validation, which is not shipped, had to run"
    verdicts = [
        json.loads((folder / "toy" / "summary.json").read_text())["verify"]
        for folder in (tmp_path / "first", tmp_path / "second")
    ]
    assert (
        verdicts[0]["candidates"]["compromise"]["responses"]
        == verdicts[1]["candidates"]["compromise"]["responses"]
    )


def test_every_candidate_is_validated_where_the_case_asks_for_it(
    write_case, tmp_path, fake_yade, capsys
):
    path = write_case(("[verify]", "[validate]\nreplicates = 2\nspread_replicates = 1\n[verify]"))
    assert main(["all", str(path), "--results", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "toy" / "summary.json").read_text())["validate"]
    assert found["statuses"]["ok"] == 4 and set(found["candidates"]) == {
        f"individual {c}" for c in "ABCD"
    }
    assert all(
        own["statuses"]["ok"] == 2 and len(own["responses"]) == 2
        for own in found["candidates"].values()
    )
    assert "individual C: " in capsys.readouterr().out.split("validate:")[1]
    page = (tmp_path / "toy" / "report.html").read_text()
    assert page.count("ledge equivalent angle") > 5
