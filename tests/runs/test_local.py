"""The driver, on a fake YADE that crashes, hangs, lies and writes half a file."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from calibrator.errors import CalibratorError
from calibrator.runs import batch, cost, local
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from tests.conftest import processes_in
from tests.runs.toy_runs import calls, folder_with, requests, wait_for

REPO = Path(__file__).resolve().parents[2]


def test_every_request_gets_a_record_and_a_second_call_runs_nothing(tmp_path, fake_yade):
    folder = folder_with(tmp_path)
    records = run(folder, requests(), jobs=1)
    assert [r.status for r in records] == ["ok"] * 4 and len(calls(folder)) == 4
    assert run(folder, requests(), jobs=1) == records and len(calls(folder)) == 4


def test_a_clogged_run_keeps_its_density_and_is_not_retried(tmp_path, fake_yade):
    folder = folder_with(tmp_path, **{"0": "clog"})
    (record,) = run(folder, requests(1), jobs=1)
    assert (
        record.status == "clogged"
        and set(record.responses) == {"bulk_density"}
        and len(calls(folder)) == 1
    )


def test_a_record_damaged_later_is_run_again(tmp_path, fake_yade):
    folder = folder_with(tmp_path)
    run(folder, requests(2), jobs=1)
    folder.record(requests(2)[0]).write_text("{")
    assert [r.status for r in run(folder, requests(2), jobs=1)] == ["ok", "ok"] and len(
        calls(folder)
    ) == 3


def test_yade_inherits_nothing_but_what_it_needs(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "/nowhere")
    monkeypatch.setenv("OMP_NUM_THREADS", "64")
    environment = local.clean_environment(60)
    assert "PYTHONPATH" not in environment and environment["OMP_NUM_THREADS"] == "1"


def test_a_missing_yade_is_said_with_the_remedy(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(CalibratorError, match="make yade"):
        run(folder_with(tmp_path), requests(1))


def test_a_record_that_arrives_while_the_batch_is_put_together_is_kept(
    tmp_path, fake_yade, monkeypatch
):
    """From a run that outlived its driver, after the next one looked for what is to be done."""
    folder, (late, other) = folder_with(tmp_path), requests(2)
    run(folder, [late], jobs=1)
    record, predict = folder.record(late).read_bytes(), cost.core_seconds
    folder.record(late).unlink()

    def arriving(*given):
        folder.record(late).write_bytes(record)
        return predict(*given)

    monkeypatch.setattr(local, "core_seconds", arriving)
    assert [r.status for r in run(folder, [late, other], jobs=1)] == ["ok", "ok"]
    assert folder.record(late).read_bytes() == record and calls(folder).count(late.run_id) == 1


def put(program, text):
    program.write_text(f"#!/bin/sh\n{text}\n")
    program.chmod(0o755)


@pytest.mark.parametrize(
    ("program", "text"),
    [("yade-batch", "kill -9 $$"), ("timeout", "exit 127"), ("timeout", "exit 126")],
)
def test_that_yade_could_not_be_started_is_no_failure_of_the_runs(
    tmp_path, fake_yade, program, text
):
    """However often it happens: once it is mended, every run is made, and has both its attempts."""
    folder, kept = (
        folder_with(tmp_path),
        ((fake_yade / program).read_text() if (fake_yade / program).exists() else ""),
    )
    put(fake_yade / program, text)
    for _ in range(2):
        with pytest.raises(
            CalibratorError,
            match=r"4 runs are still to be done: .*yade-batch.log.*run the same command again",
        ):
            run(folder, requests(), jobs=1)
        assert folder.failures() == {}
    (fake_yade / program).unlink()
    if kept:
        put(fake_yade / program, "")
        (fake_yade / program).write_text(kept)
    assert [r.status for r in run(folder, requests(), jobs=1)] == ["ok"] * 4


def test_a_disk_that_fills_up_in_mid_run_is_not_blamed_on_the_runs(
    tmp_path, fake_yade, monkeypatch
):
    folder, asked = folder_with(tmp_path, all="nothing"), []
    monkeypatch.setattr(
        RunFolder, "check_room", lambda self: (asked.append(1), 1 / (2 - len(asked)))[0]
    )
    with pytest.raises(ZeroDivisionError):  # the second time: after the batch
        run(folder, requests(), jobs=1)
    assert len(calls(folder)) == 4 and folder.failures() == {}


def test_a_table_edited_after_its_line_was_locked_gives_yade_the_line_as_it_was(
    tmp_path, fake_yade
):
    put(
        fake_yade / "timeout",
        f'for t in batches/*.table; do : > "$t"; done\nexec {shutil.which("timeout")} "$@"',
    )
    folder = folder_with(tmp_path)
    assert [r.status for r in run(folder, requests(1), jobs=1, attempts=1)] == ["ok"]
    assert [p.read_text() for p in folder.path.glob("batches/*.table")] == [""]


def start_driver(folder, count):
    code = (
        # a shell's background job ignores it
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
        "from calibrator.runs.folder import RunFolder; from calibrator.runs.local import run;"
        "from calibrator.runs.request import Request; from pathlib import Path;"
        f"run(RunFolder(Path({str(folder.path)!r})),"
        f" [Request.of('hourglass', seed=s) for s in range({count})], jobs=1)"
    )
    return subprocess.Popen([sys.executable, "-c", code], cwd=REPO, start_new_session=True)


def test_after_kill_9_of_the_driver_the_same_call_finishes_and_repeats_no_finished_run(
    tmp_path, fake_yade
):
    folder = folder_with(tmp_path, duration=0.3)
    driver = start_driver(folder, 6)
    wait_for(lambda: len(list(folder.path.glob("records/*.json"))) >= 2)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    finished = {p.stem for p in folder.path.glob("records/*.json")}
    wait_for(lambda: not processes_in(folder.path))
    records = run(folder, requests(6), jobs=1)
    assert [r.status for r in records] == ["ok"] * 6
    assert all(calls(folder).count(run_id) == 1 for run_id in finished)


def test_an_interrupt_leaves_no_process_behind(tmp_path, fake_yade):
    folder = folder_with(tmp_path, **{"0": "hang"})
    driver = start_driver(folder, 2)
    wait_for(lambda: (folder.path / "calls.txt").exists())
    driver.send_signal(signal.SIGINT)
    driver.wait(20)
    wait_for(lambda: not processes_in(folder.path), 10)


def test_without_a_number_of_jobs_only_the_cores_that_are_allowed_are_used(
    tmp_path, fake_yade, monkeypatch
):
    asked, original = [], batch.batch_arguments
    monkeypatch.setattr(
        local, "batch_arguments", lambda *given: asked.append(given[2]) or original(*given)
    )
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0, 5, 7})
    run(folder_with(tmp_path), requests(1))
    assert asked == [3]
