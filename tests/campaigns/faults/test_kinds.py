"""What is kept when something dies, fills up, or lies: each kind of fault once, on the fake YADE.

The campaign, `python -m tests.campaigns.faults`, injects each of them many times at random moments,
and some into the real YADE.
"""

import json
import random
import re
import subprocess
import sys
from pathlib import Path

import pytest

from calibrator.cli import main
from tests.campaigns.faults.campaign import counted
from tests.campaigns.faults.judge import COUNTS, judge
from tests.campaigns.faults.kinds import KINDS
from tests.campaigns.faults.records import SPOILED
from tests.campaigns.faults.stage import Stage, undisturbed

REPO = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """What each kind of fault did. A process of its own, as mounts have to be private."""
    path = tmp_path_factory.mktemp("faults") / "found.json"
    done = subprocess.run(
        [sys.executable, "-m", "tests.campaigns.faults", "--quick", "--to", path],
        cwd=REPO,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(path.read_text())


def costs_nothing(found, *names):
    """Nothing lost, nothing repeated without need, the same database, the end that was expected."""
    for name in names:
        (kind,) = [k.name for k in KINDS if re.match(rf"{re.escape(name)}\b(?!-)", k.name)]
        if kind in found["not_possible_here"]:
            pytest.skip("a file system of its own cannot be mounted here")
        (fault,) = [f for f in found["faults"] if f["kind"] == kind]
        assert fault["happened"] == "as expected" and not any(fault[key] for key in COUNTS), fault


def test_kill_9_of_the_driver_costs_no_finished_run(found):
    costs_nothing(found, "kill -9 of the driver", "kill -9 of three drivers in a row")


def test_kill_9_of_yade_batch_yade_or_wrapper_costs_the_run_in_flight_and_the_driver_goes_on(found):
    costs_nothing(found, "kill -9 of yade-batch", "kill -9 of yade", "kill -9 of the wrapper")


def test_a_yade_batch_that_dies_again_and_again_is_one_line_and_fails_no_run(found):
    costs_nothing(found, "two yade-batches in a row killed", "yade-batch that cannot start")


@pytest.mark.parametrize("how", SPOILED)
def test_a_spoiled_record_is_reported_and_its_run_done_again(found, how):
    costs_nothing(found, f"record {how}")


def test_a_record_spoiled_in_mid_run_is_reported_and_its_run_done_again(found):
    costs_nothing(found, "spoiled in mid-run")


def test_a_run_that_crashes_or_lies_once_is_done_again(found):
    costs_nothing(found, "YADE crashes, lies")


def test_a_full_disk_is_one_line_and_costs_no_finished_run(found):
    costs_nothing(found, "disk full", "no room for another file")


def test_a_folder_that_cannot_be_written_is_one_line_and_costs_no_finished_run(found):
    costs_nothing(found, "results folder")


def test_a_clock_that_jumps_changes_nothing(found):
    costs_nothing(found, "clock that jumps")


def test_two_drivers_on_one_case_do_no_run_twice(found):
    costs_nothing(found, "two drivers")


def test_an_edited_table_or_case_never_changes_an_answer(found):
    costs_nothing(found, "table of the batch edited", "case file emptied")


def test_damaged_state_is_one_line_and_costs_no_finished_run(found):
    costs_nothing(found, "list of failures or summary")


def test_a_missing_yade_is_one_line_and_fails_no_run(found):
    costs_nothing(found, "yade or yade-batch missing", "yade removed in mid-run")


def test_versions_of_yade_are_never_mixed_unseen(found):
    costs_nothing(found, "another version")


def test_a_run_that_cannot_succeed_is_kept_with_its_reason_and_not_tried_for_ever(found):
    costs_nothing(found, "seed that clogs for ever", "run that crashes", "run that never ends")


def test_every_kind_of_fault_was_injected(found):
    assert {f["kind"] for f in found["faults"]} | set(found["not_possible_here"]) == {
        k.name for k in KINDS
    }
    assert sum(k.fake + k.real for k in KINDS) >= 200


def test_every_promise_of_the_document_names_a_test_that_is_here():
    rows = [
        line
        for line in (REPO / "docs" / "promises.md").read_text().splitlines()
        if re.match(r"  \| .*`test_\w+` \|$", line)
    ]
    assert len(rows) >= 14
    for row in rows:
        assert callable(globals()[re.search(r"`(test_\w+)` \|$", row)[1]])


# The judge can find something


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return undisturbed(tmp_path_factory.mktemp("whole") / "plan", False, 2, 1)


@pytest.fixture
def stage(tmp_path, whole):
    stage = Stage(tmp_path / "stage", whole, random.Random(1))
    stage.finish()
    return stage


def test_the_judge_finds_nothing_where_nothing_happened(stage):
    verdict = judge(stage)
    assert verdict.happened == "as expected" and not any(getattr(verdict, key) for key in COUNTS)


def test_the_judge_notices_a_lost_record(stage):
    stage.record(min(stage.finished)).unlink()
    verdict = judge(stage)
    assert (verdict.lost_finished_runs, verdict.repeated_without_need, verdict.wrong_answers) == (
        1,
        1,
        0,
    )


def test_the_judge_notices_a_wrong_number_that_nobody_reported(stage):
    run_id = min(stage.finished)
    record = json.loads(stage.record(run_id).read_text())
    del record["seal"]  # as records were before they had one
    record["responses"]["bulk_density"] += 1.0
    stage.record(run_id).write_text(json.dumps(record))
    stage.damaged = {run_id}
    verdict = judge(stage)
    assert (verdict.undetected_corruptions, verdict.wrong_answers) == (1, 1)


def test_the_judge_notices_a_traceback_and_a_driver_that_fails(stage):
    (stage.path / "bin" / "yade-batch").unlink()
    stage.record(min(stage.finished)).unlink()
    stage.ends.append(type(stage.run())(1, "Traceback (most recent call last):"))
    verdict = judge(stage)
    assert verdict.tracebacks == 1 and "status 2" in verdict.happened and verdict.wrong_answers == 1
    assert (
        counted([{"happened": verdict.happened, "yade": "fake", **dict.fromkeys(COUNTS, 1)}])[
            "unexpected"
        ]
        == 1
    )


# What the user is told


def test_failed_runs_come_with_the_way_to_try_them_again(write_case, tmp_path, fake_yade, capsys):
    path, folder = write_case(("sets = 14", "sets = 2")), tmp_path / "results" / "toy"
    folder.mkdir(parents=True)
    (folder / "misbehave.json").write_text('{"all": "crash"}')
    assert main(["run", str(path), "--results", str(tmp_path / "results")]) == 1
    assert "4 crash" in (said := capsys.readouterr().out) and "delete failures.json" in said
    (folder / "misbehave.json").unlink()
    (folder / "failures.json").unlink()
    assert main(["run", str(path), "--results", str(tmp_path / "results")]) == 0
    assert "4 ok" in (said := capsys.readouterr().out) and "failures.json" not in said
