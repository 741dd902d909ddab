"""The driver, on a fake YADE that crashes, hangs, lies and writes half a file."""

import json
import os
import shutil
import threading
import time
from pathlib import Path

import pytest

from calibrator.errors import CalibratorError
from calibrator.runs import batch, failures, local
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.request import Request

REPO = Path(__file__).resolve().parent.parent


def requests(count=4):
    return [Request.of("hourglass", seed=s) for s in range(count)]


def folder_with(tmp_path, **behaviour):
    folder = RunFolder(tmp_path / "runs")
    folder.path.mkdir()
    (folder.path / "misbehave.json").write_text(json.dumps(behaviour))
    return folder


def calls(folder):
    return (folder.path / "calls.txt").read_text().split()


def test_a_segfault_is_a_crash_however_it_was_reported(tmp_path, fake_yade):
    folder = folder_with(tmp_path, **{"1": "segfault"})
    records = run(folder, requests(2), jobs=1)
    assert [r.status for r in records] == ["ok", "crash"] and records[1].error.startswith(
        "exit code 139"
    )
    for status, code in (
        ("11", 139),
        ("139", 139),
        (str(139 << 8), 139),
        ("9", 137),
        ("0", 0),
        (str(124 << 8), 124),
    ):
        (tmp_path / "log").write_text(f"some output\nstatus  : {status} (some words)\n")
        assert failures.exit_code(tmp_path / "log") == code


def test_yade_inherits_nothing_but_what_it_needs(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "/nowhere")
    monkeypatch.setenv("OMP_NUM_THREADS", "64")
    environment = local.clean_environment(60)
    assert "PYTHONPATH" not in environment and environment["OMP_NUM_THREADS"] == "1"


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
            match="4 runs are still to be done: .*yade-batch.log.*run the same command again",
        ):
            run(folder, requests(), jobs=1)
        assert folder.failures() == {}
    (fake_yade / program).unlink()
    if kept:
        put(fake_yade / program, "")
        (fake_yade / program).write_text(kept)
    assert [r.status for r in run(folder, requests(), jobs=1)] == ["ok"] * 4


def test_a_second_driver_waits_for_the_first_and_says_so(tmp_path, caplog):
    folder, order = RunFolder(tmp_path / "runs"), []

    def second():
        with folder.alone():
            order.append("second")

    thread = threading.Thread(target=second)
    with folder.alone():
        thread.start()
        wait_for(lambda: any("waiting for it to end" in r.getMessage() for r in caplog.records))
        order.append("first")
    thread.join()
    assert order == ["first", "second"]


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


def wait_for(condition, seconds=30):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def test_gathering_unknown_requests_finds_nothing(tmp_path):
    assert gather(RunFolder(tmp_path), requests(2)) == []


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
