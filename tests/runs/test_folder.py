"""The folder of the runs: nothing in it leads out of it, and one driver at a time works there."""

import errno
import os
import threading
from pathlib import Path

import pytest

from calibrator.case.vocabulary import SCRIPTS
from calibrator.errors import CalibratorError
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.request import Request
from tests.runs.toy_runs import requests, wait_for


@pytest.mark.parametrize("name", ["records", "logs", "batches", "locks"])
def test_no_run_writes_through_a_link(tmp_path, fake_yade, name):
    (tmp_path / "runs").mkdir()
    (tmp_path / "outside").mkdir()
    (tmp_path / "runs" / name).symlink_to(tmp_path / "outside")
    with pytest.raises(CalibratorError, match="symbolic link"):
        run(RunFolder(tmp_path / "runs"), [Request.of("ledge")], jobs=1)
    assert not list((tmp_path / "outside").iterdir())


def test_links_in_place_of_files_that_a_run_writes_are_replaced(tmp_path, fake_yade):
    folder, request = RunFolder(tmp_path / "runs"), Request.of("ledge")
    folder.prepare()
    for name in ("records/{}.json", "logs/{}.log", "locks/{}", "logs/yade-batch.log"):
        victim = tmp_path / name.format("victim").replace("/", "_")
        victim.write_text("mine")
        (folder.path / name.format(request.run_id)).symlink_to(victim)
    assert [r.status for r in run(folder, [request], jobs=1)] == ["ok"]
    assert [p.read_text() for p in tmp_path.glob("*_victim*")] == ["mine"] * 3
    assert (tmp_path / "logs_yade-batch.log").read_text() == "mine"


@pytest.mark.parametrize(
    "state",
    [
        "[]",
        '{"a": 1}',
        '{"a": {"kind": "ok", "message": "", "attempts": 1}}',
        '{"a": {"kind": 1}}',
        "[" * 9999,
    ],
)
def test_a_damaged_list_of_failures_is_one_line(tmp_path, state):
    (tmp_path / "failures.json").write_text(state)
    with pytest.raises(CalibratorError, match=r"failures.json is damaged .*: delete it"):
        RunFolder(tmp_path).failures()


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


def test_gathering_unknown_requests_finds_nothing(tmp_path):
    assert gather(RunFolder(tmp_path), requests(2)) == []


@pytest.mark.parametrize("answer", [errno.EPERM, errno.ENOTSUP, errno.ENOSYS])
def test_a_drive_without_symbolic_links_gets_a_copy_of_the_scripts(
    tmp_path, fake_yade, monkeypatch, answer
):
    def refuse(path, *_, **__):
        raise OSError(answer, "Operation not permitted", str(path))

    monkeypatch.setattr(Path, "symlink_to", refuse)
    folder, request = RunFolder(tmp_path / "runs"), Request.of("ledge")
    assert [r.status for r in run(folder, [request], jobs=1)] == ["ok"]
    copy = folder.path / "scripts"
    assert not copy.is_symlink() and os.access(copy / "run_yade.sh", os.X_OK)
    (copy / "ledge.py").write_text("# of an older version\n")
    folder.prepare()
    assert (copy / "ledge.py").read_bytes() == (SCRIPTS / "ledge.py").read_bytes()


def test_a_folder_of_something_else_where_the_scripts_go_is_refused(tmp_path):
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "mine.txt").write_text("mine")
    with pytest.raises(CalibratorError, match="YADE's scripts go there: remove it"):
        RunFolder(tmp_path).prepare()
    assert (tmp_path / "scripts" / "mine.txt").read_text() == "mine"


def test_another_error_of_the_drive_is_not_taken_for_that(tmp_path, monkeypatch):
    def full(path, *_, **__):
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(Path, "symlink_to", full)
    with pytest.raises(OSError, match="No space left"):
        RunFolder(tmp_path).prepare()
