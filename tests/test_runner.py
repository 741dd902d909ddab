"""The driver, on a fake YADE that crashes, hangs, lies and writes half a file."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import processes_in

from calibrator import runner
from calibrator.errors import CalibratorError
from calibrator.runner import RunFolder, gather, run
from calibrator.table import Request

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


def test_every_request_gets_a_record_and_a_second_call_runs_nothing(tmp_path, fake_yade):
    folder = folder_with(tmp_path)
    records = run(folder, requests(), jobs=1)
    assert [r.status for r in records] == ["ok"] * 4 and len(calls(folder)) == 4
    assert run(folder, requests(), jobs=1) == records and len(calls(folder)) == 4


def test_a_crash_is_tried_once_more_and_kept_with_its_reason(tmp_path, fake_yade):
    folder = folder_with(tmp_path, **{"2": "crash"})
    records = run(folder, requests(), jobs=1)
    assert [r.status for r in records] == ["ok", "ok", "crash", "ok"]
    assert "fake crash" in records[2].error and records[2].responses == {}
    assert calls(folder).count(requests()[2].run_id) == 2
    run(folder, requests(), jobs=1)
    assert calls(folder).count(requests()[2].run_id) == 2  # and not for ever


def test_a_segfault_is_a_crash_however_it_was_reported(tmp_path, fake_yade):
    folder = folder_with(tmp_path, **{"1": "segfault"})
    records = run(folder, requests(2), jobs=1)
    assert [r.status for r in records] == ["ok", "crash"] and records[1].error.startswith("exit code 139")
    for status, code in (("11", 139), ("139", 139), (str(139 << 8), 139), ("9", 137), ("0", 0), (str(124 << 8), 124)):
        (tmp_path / "log").write_text(f"some output\nstatus  : {status} (some words)\n")
        assert runner.exit_code(tmp_path / "log") == code


@pytest.mark.parametrize("behaviour", ["lie", "half", "nothing"])
def test_a_run_without_a_believable_record_is_lost_not_trusted(tmp_path, fake_yade, behaviour):
    folder = folder_with(tmp_path, **{"1": behaviour})
    records = run(folder, requests(2), jobs=1)
    assert [r.status for r in records] == ["ok", "lost"] and records[1].responses == {}
    assert calls(folder).count(requests(2)[1].run_id) == 2


def test_a_hanging_run_ends_at_its_time_limit(tmp_path, fake_yade, monkeypatch):
    folder = folder_with(tmp_path, **{"0": "hang"})
    environment = runner.clean_environment
    monkeypatch.setattr(runner, "clean_environment", lambda limit: environment(1.0))
    records = run(folder, requests(2), jobs=1, attempts=1)
    assert [r.status for r in records] == ["timeout", "ok"]


def test_a_clogged_run_keeps_its_density_and_is_not_retried(tmp_path, fake_yade):
    folder = folder_with(tmp_path, **{"0": "clog"})
    (record,) = run(folder, requests(1), jobs=1)
    assert record.status == "clogged" and set(record.responses) == {"bulk_density"} and len(calls(folder)) == 1


def test_a_record_damaged_later_is_run_again(tmp_path, fake_yade):
    folder = folder_with(tmp_path)
    run(folder, requests(2), jobs=1)
    folder.record(requests(2)[0]).write_text("{")
    assert [r.status for r in run(folder, requests(2), jobs=1)] == ["ok", "ok"] and len(calls(folder)) == 3


def test_yade_inherits_nothing_but_what_it_needs(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "/nowhere")
    monkeypatch.setenv("OMP_NUM_THREADS", "64")
    environment = runner.clean_environment(60)
    assert "PYTHONPATH" not in environment and environment["OMP_NUM_THREADS"] == "1"


def test_a_missing_yade_is_said_with_the_remedy(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(CalibratorError, match="make yade"):
        run(folder_with(tmp_path), requests(1))


def start_driver(folder, count):
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"  # a shell's background job ignores it
        "from calibrator.runner import RunFolder, run; from calibrator.table import Request; from pathlib import Path;"
        f"run(RunFolder(Path({str(folder.path)!r})), [Request.of('hourglass', seed=s) for s in range({count})], jobs=1)"
    )
    return subprocess.Popen([sys.executable, "-c", code], cwd=REPO, start_new_session=True)


def wait_for(condition, seconds=30):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def test_after_kill_9_of_the_driver_the_same_call_finishes_and_repeats_no_finished_run(tmp_path, fake_yade):
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


def test_gathering_unknown_requests_finds_nothing(tmp_path):
    assert gather(RunFolder(tmp_path), requests(2)) == []
