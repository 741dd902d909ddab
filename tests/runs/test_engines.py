"""What every engine promises, on a fake YADE that crashes, hangs, lies and writes half a file."""

import dataclasses
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from calibrator.errors import CalibratorError
from calibrator.runs import cost, engine, local, slurm
from calibrator.runs.engines import ENGINES
from calibrator.runs.folder import FOLDERS, RunFolder
from calibrator.runs.local import Local
from calibrator.runs.request import Request
from calibrator.runs.slurm import Slurm
from tests.conftest import processes_in
from tests.slurm_cluster import NEEDS_SLURM, options_for

REPO = Path(__file__).resolve().parents[2]


@pytest.fixture(params=["local", pytest.param("slurm", marks=NEEDS_SLURM)])
def make(request, tmp_path, fake_yade, monkeypatch):
    """Makes an engine, as a driver that is called again would."""
    if request.param == "local":
        return lambda: Local(1)
    request.getfixturevalue("slurm")
    monkeypatch.setattr(slurm, "POLL", 0.5)
    return lambda: Slurm(options_for(tmp_path / "bin"))


def requests(count):
    return [Request.of("hourglass", seed=s) for s in range(count)]


def folder_with(tmp_path, **behaviour):
    folder = RunFolder(tmp_path / "runs")
    folder.path.mkdir()
    (folder.path / "misbehave.json").write_text(json.dumps(behaviour))
    return folder


def calls(folder):
    """Run ids in the order in which they were started."""
    return [line.split()[0] for line in (folder.path / "calls.txt").read_text().splitlines()]


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def test_the_table_of_engines_holds_those_that_are_tested_here():
    assert set(ENGINES) == {"local", "slurm"}


def test_every_request_gets_a_record_in_its_place_and_a_second_call_runs_nothing(tmp_path, make):
    folder, asked = folder_with(tmp_path), requests(4)[::-1]
    records = engine.run(make(), folder, asked)
    assert [r.request for r in records] == asked and [r.status for r in records] == ["ok"] * 4
    assert engine.run(make(), folder, asked) == records and len(calls(folder)) == 4


def test_a_call_that_has_nothing_to_do_needs_no_programs(tmp_path, make, monkeypatch):
    folder = folder_with(tmp_path)
    records = engine.run(make(), folder, requests(1))
    monkeypatch.setenv("PATH", str(tmp_path / "nowhere"))
    assert engine.run(make(), folder, requests(1)) == records


def test_a_missing_program_is_said_in_one_line_with_the_remedy(tmp_path, make, monkeypatch):
    folder, place = folder_with(tmp_path), make()
    monkeypatch.setenv("PATH", str(tmp_path / "nowhere"))
    with pytest.raises(CalibratorError, match=r"is not installed.*: (call|apt-get) ") as error:
        engine.run(place, folder, requests(1))
    assert "\n" not in str(error.value) and folder.failures() == {}


def test_a_crash_is_tried_once_more_and_kept_with_its_reason(tmp_path, make):
    folder, asked = folder_with(tmp_path, **{"2": "crash"}), requests(4)
    records = engine.run(make(), folder, asked)
    assert [r.status for r in records] == ["ok", "ok", "crash", "ok"]
    assert "fake crash" in records[2].error and records[2].responses == {}
    assert calls(folder).count(asked[2].run_id) == 2
    engine.run(make(), folder, asked)
    assert calls(folder).count(asked[2].run_id) == 2  # and not for ever


def test_a_run_without_a_believable_record_is_lost_not_trusted(tmp_path, make):
    folder, asked = folder_with(tmp_path, **{"1": "lie", "2": "half", "3": "nothing"}), requests(4)
    records = engine.run(make(), folder, asked)
    assert [r.status for r in records] == ["ok", "lost", "lost", "lost"]
    assert all(r.responses == {} for r in records[1:])
    assert [calls(folder).count(r.run_id) for r in asked] == [1, 2, 2, 2]


def test_a_hanging_run_ends_at_its_time_limit_and_then_at_twice_that(tmp_path, make, monkeypatch):
    folder, asked, limits = folder_with(tmp_path, **{"0": "hang"}), requests(2), []

    def limited(cost, patience):
        if asked[0].run_id in cost:
            limits.append(patience)
        return 3 * patience

    for module in (local, slurm):
        monkeypatch.setattr(module, "time_limit", limited)
    records = engine.run(make(), folder, asked)
    assert [(r.status, r.error) for r in records] == [
        ("timeout", "the wall-clock limit passed"),
        ("ok", ""),
    ]
    assert limits == [1.0, 2.0]


def test_a_clogged_run_keeps_its_density_and_is_not_retried(tmp_path, make):
    folder = folder_with(tmp_path, **{"0": "clog"})
    (record,) = engine.run(make(), folder, requests(1))
    assert record.status == "clogged" and set(record.responses) == {"bulk_density"}
    assert len(calls(folder)) == 1


def test_a_record_damaged_later_is_run_again(tmp_path, make):
    folder, asked = folder_with(tmp_path), requests(2)
    engine.run(make(), folder, asked)
    folder.record(asked[0]).write_text("{")
    assert [r.status for r in engine.run(make(), folder, asked)] == ["ok", "ok"]
    assert [calls(folder).count(r.run_id) for r in asked] == [2, 1]


def test_a_record_that_arrives_while_the_batch_is_put_together_is_kept(tmp_path, make, monkeypatch):
    """From a run that outlived its driver, and was not there when the driver looked for it."""
    folder, (late, other) = folder_with(tmp_path), requests(2)
    engine.run(make(), folder, [late])
    record, predict = folder.record(late).read_bytes(), cost.core_seconds
    folder.record(late).unlink()

    def arriving(*given):
        folder.record(late).write_bytes(record)
        return predict(*given)

    monkeypatch.setattr(engine, "core_seconds", arriving)
    assert [r.status for r in engine.run(make(), folder, [late, other])] == ["ok", "ok"]
    assert folder.record(late).read_bytes() == record and calls(folder).count(late.run_id) == 1


def test_the_progress_counts_every_run_that_is_to_be_made(tmp_path, make):
    folder, seen = folder_with(tmp_path, **{"1": "clog"}), []
    engine.run(make(), folder, requests(1))
    engine.run(make(), folder, requests(4), report=seen.append)
    assert {p.total for p in seen} == {3}  # what was done before is none of this call's
    assert [p.done for p in seen] == sorted(p.done for p in seen)
    assert (seen[-1].done, seen[-1].failed, seen[-1].left) == (3, 1, 0)
    assert all(p.left >= 0 and p.elapsed >= 0 for p in seen)


def test_that_yade_could_not_be_started_is_no_failure_of_the_runs(tmp_path, make, fake_yade):
    """However often it happens: once it is mended, every run has both its attempts."""
    folder, broken = folder_with(tmp_path, **{"1": "crash"}), fake_yade / "timeout"
    broken.write_text("#!/bin/sh\nexit 127\n")
    broken.chmod(0o755)
    for _ in range(2):
        with pytest.raises(CalibratorError, match=r"^2 runs are still to be done: .* again$"):
            engine.run(make(), folder, requests(2))
        assert folder.failures() == {}
    broken.unlink()
    assert [r.status for r in engine.run(make(), folder, requests(2))] == ["ok", "crash"]
    assert len(calls(folder)) == 3


def test_a_plan_whose_first_runs_all_fail_alike_starts_no_other_unless_it_is_to_go_on(
    tmp_path, make
):
    folder, asked, seen = folder_with(tmp_path, all="unstable", duration=1), requests(12), []
    place = make()
    # an array of three tasks at most, or all would have been started at once
    place.options = dataclasses.replace(place.options, most_tasks=1) if place.cores is None else 0
    with pytest.raises(
        CalibratorError, match=r"^the first \d+ of 12 runs all failed alike, unstable: .*--go-on"
    ) as error:
        engine.run(place, folder, asked, report=seen.append)
    assert "lower rayleigh_fraction or time_step" in str(error.value)
    made = len(calls(folder))
    assert 8 <= made < 12 and max(p.done for p in seen) >= 8 and folder.failures() == {}
    with pytest.raises(CalibratorError, match="failed alike"):  # nor by another call
        engine.run(make(), folder, asked)
    assert len(calls(folder)) == made
    (folder.path / "misbehave.json").write_text("{}")
    ended = [r.status for r in engine.run(make(), folder, asked, go_on=True)]
    assert ended.count("ok") >= 1 and ended.count("unstable") >= 8 and len(ended) == 12


def test_a_plan_of_few_runs_is_carried_out_however_they_fail(tmp_path, make):
    folder = folder_with(tmp_path, all="unstable")
    assert [r.status for r in engine.run(make(), folder, requests(8))] == ["unstable"] * 8
    assert len(calls(folder)) == 8  # and none is tried again


def test_a_run_that_is_tried_again_is_counted_as_that_and_not_as_done(tmp_path, make):
    folder, seen = folder_with(tmp_path, duration=1, **{"0": "segfault"}, once=True), []
    engine.run(make(), folder, requests(2), report=seen.append)
    assert max(p.retried for p in seen) == 1 and all(p.failed == 0 for p in seen)
    last = seen[-1]
    assert (last.done, last.total, last.retried, last.left) == (2, 2, 0, 0)


@pytest.mark.parametrize("name", FOLDERS)
def test_a_folder_without_room_is_found_before_a_run_is_made_in_vain(tmp_path, make, name):
    folder = folder_with(tmp_path)
    # where root writes whatever the permissions are
    (folder.path / name / "room").mkdir(parents=True)
    with pytest.raises(OSError, match="room"):
        engine.run(make(), folder, requests(2))
    assert not (folder.path / "calls.txt").exists()


def test_a_disk_that_fills_up_in_mid_run_is_not_blamed_on_the_runs(tmp_path, make, monkeypatch):
    folder, asked = folder_with(tmp_path, all="nothing"), []

    def room(self):
        asked.append(1)
        if len(asked) == 2:  # after the batch
            raise OSError("no room")

    monkeypatch.setattr(RunFolder, "check_room", room)
    with pytest.raises(OSError, match="no room"):
        engine.run(make(), folder, requests(2))
    assert len(calls(folder)) == 2 and folder.failures() == {}


def start_driver(folder, place, count):
    """A driver in a process of its own, that a signal of the terminal reaches as well."""
    made = f"Slurm({place.options!r})" if isinstance(place, Slurm) else "Local(1)"
    code = f"""
import signal
from pathlib import Path
from calibrator.case.settings import Cluster
from calibrator.runs import engine, slurm
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import Local
from calibrator.runs.request import Request
from calibrator.runs.slurm import Slurm
signal.signal(signal.SIGINT, signal.default_int_handler)
slurm.POLL = 0.5
asked = [Request.of("hourglass", seed=s) for s in range({count})]
engine.run({made}, RunFolder(Path({str(folder.path)!r})), asked)
"""
    return subprocess.Popen([sys.executable, "-c", code], cwd=REPO, start_new_session=True)


def test_after_kill_9_of_the_driver_the_same_call_finishes_and_repeats_no_finished_run(
    tmp_path, make
):
    folder, asked = folder_with(tmp_path, duration=0.3), requests(6)
    driver = start_driver(folder, make(), len(asked))
    wait_for(lambda: len(list(folder.path.glob("records/*.json"))) >= 2)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    finished = {p.stem for p in folder.path.glob("records/*.json")}
    records = engine.run(make(), folder, asked)
    assert [r.status for r in records] == ["ok"] * len(asked)
    assert all(calls(folder).count(run_id) == 1 for run_id in finished)


def test_an_interrupt_leaves_nothing_behind_on_this_machine(tmp_path, fake_yade):
    """Jobs of a cluster go on, and the next driver waits for them."""
    folder = folder_with(tmp_path, **{"0": "hang"})
    driver = start_driver(folder, Local(1), 2)
    wait_for(lambda: (folder.path / "calls.txt").exists())
    driver.send_signal(signal.SIGINT)
    driver.wait(20)
    wait_for(lambda: not processes_in(folder.path), 10)
