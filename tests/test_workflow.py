"""The whole way on a fake YADE whose answer is known, and what happens when it is interrupted."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.plan.run import collect, database_records, run_plan
from calibrator.runs.database import Database
from calibrator.search.calibrate import calibrate
from calibrator.search.outcome import current_calibration
from calibrator.verification.verify import verification_requests, verify
from tests.conftest import LAB, space_for

REPO = Path(__file__).resolve().parent.parent


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


def test_shipped_runs_start_a_plan_but_never_a_verification(write_case, tmp_path, fake_yade):
    path = write_case()
    first = space_for(path, tmp_path / "first")
    for verb in (run_plan, collect, calibrate, verify):
        verb(first)
    calibration = current_calibration(first)
    everything = [
        *database_records(first),
        *(r for q in verification_requests(first, calibration).values() for r in first.finished(q)),
    ]
    Database(everything).write(tmp_path / "shipped.csv")
    shipping = write_case(("jobs = 1", 'jobs = 1\nshipped = "shipped.csv"'))
    second = space_for(shipping, tmp_path / "second")
    assert run_plan(second).from_shipped_database == 28
    assert not (second.path / "calls.txt").exists()
    requests = verification_requests(second, calibrate(second))
    verify(second)
    assert len((second.path / "calls.txt").read_text().split()) == sum(map(len, requests.values()))
    fresh = space_for(shipping, tmp_path / "third", fresh=True)
    assert run_plan(fresh).from_shipped_database == 0


def test_an_unreachable_target_is_said_before_and_after(write_case, tmp_path, fake_yade):
    space = space_for(write_case(lab=LAB.replace("1605.6", "1800")), tmp_path)
    for verb in (run_plan, collect, verify):
        if verb is verify:
            before = calibrate(space)
        after = verb(space)
    assert before.reachability.missed == ("hourglass.bulk_density",) and not before.reachability.all
    rows = {r.key: r.passed for r in after.candidates["compromise"].responses}
    assert not after.passed and not rows["hourglass.bulk_density"]


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
