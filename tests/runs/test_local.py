"""The driver, on a fake YADE that crashes, hangs, lies and writes half a file."""

import os
import shutil
from pathlib import Path

import pytest

from calibrator.errors import CalibratorError
from calibrator.runs import batch, local
from calibrator.runs.local import run
from tests.runs.toy_runs import folder_with, requests

REPO = Path(__file__).resolve().parents[2]


def test_yade_inherits_nothing_but_what_it_needs(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "/nowhere")
    monkeypatch.setenv("OMP_NUM_THREADS", "64")
    environment = local.clean_environment(600, 60)
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
            match=r"4 runs are still to be done: .*yade-batch.log.*run the same command again",
        ):
            run(folder, requests(), jobs=1)
        assert folder.failures() == {}
    (fake_yade / program).unlink()
    if kept:
        put(fake_yade / program, "")
        (fake_yade / program).write_text(kept)
    assert [r.status for r in run(folder, requests(), jobs=1)] == ["ok"] * 4


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


def test_a_run_may_wait_for_a_busy_machine_but_not_compute_for_ever(
    tmp_path, fake_yade, monkeypatch
):
    """The limit is one of CPU time; that by the clock, ten times as long, is for what hangs."""
    monkeypatch.setattr(local, "cpu_limit", lambda cost, patience: 2 * patience)
    folder = folder_with(tmp_path, **{"0": "busy"}, duration=3)
    ended = [(r.status, r.error) for r in run(folder, requests(2), jobs=1, attempts=1)]
    assert ended == [("timeout", "its limit of CPU time passed"), ("ok", "")]
    assert batch.time_limit({"a": 30.0}, 2.0) == 10 * batch.cpu_limit({"a": 30.0}, 2.0) == 6000.0


def test_a_killed_run_hints_at_memory(tmp_path, fake_yade):
    (record,) = run(folder_with(tmp_path, **{"0": "killed"}), requests(1), jobs=1, attempts=1)
    assert record.status == "lost" and "runs out of memory" in record.error
    assert "run.jobs" in record.error
