"""During a run nothing listens where another machine could reach it.

Where that cannot be had one line says so.
"""

import logging
import shutil
import threading
import time
from pathlib import Path

import pytest

from calibrator.runs import local
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.programs import Build
from calibrator.runs.request import Request
from tests.conftest import processes_in

LISTEN = "0A"  # state of a socket in /proc/net/tcp
LOOPBACK = ("0100007F", "0" * 24 + "01000000", "0" * 16 + "FFFF0000" + "0100007F")


def listening(process="self"):
    """{(local address, inode)} of every listening socket in the network namespace of a process."""
    found = set()
    for table in ("tcp", "tcp6"):
        try:
            lines = Path(f"/proc/{process}/net/{table}").read_text().splitlines()[1:]
        except OSError:
            continue  # it ended meanwhile
        found |= {
            (cells[1].split(":")[0], cells[9])
            for cells in map(str.split, lines)
            if cells[3] == LISTEN
        }
    return found


def sockets_of(processes):
    """Inodes of the sockets that these processes hold."""
    found = set()
    for process in processes:
        for link in Path(f"/proc/{process}/fd").glob("*"):
            try:
                target = str(link.readlink())
            except OSError:
                continue
            if target.startswith("socket:["):
                found.add(target[8:-1])
    return found


@pytest.mark.yade
def test_during_a_run_no_server_of_yade_can_be_reached_from_another_machine(tmp_path):
    """yade-batch listens on every address: both are in a namespace that has no way out."""
    folder = RunFolder(tmp_path / "runs")
    box = dict(box_length=16e-3, box_width=8e-3, fill_height=10e-3, young_modulus=1e6, seed=3)
    thread = threading.Thread(
        target=lambda: run(folder, [Request.of("ledge", **box)], jobs=1, attempts=1)
    )
    thread.start()
    open_to_others, inside, seen = set(), set(), 0
    while thread.is_alive():
        processes = processes_in(folder.path)
        own = sockets_of(processes)
        open_to_others |= {a for a, inode in listening() if inode in own and a not in LOOPBACK}
        inside |= {a for p in processes for a, inode in listening(p) if inode in own}
        seen += bool(processes)
        time.sleep(0.05)
    thread.join()
    assert seen, "no process of the run was seen"
    assert inside, "no server was seen at all, so that this test would pass whatever happens"
    assert not open_to_others


def test_without_unshare_the_driver_says_in_one_line_what_can_be_reached(
    tmp_path, monkeypatch, caplog
):
    for program in ("yade", "yade-batch", "setpriv"):
        (tmp_path / program).symlink_to(shutil.which("true"))
    monkeypatch.setenv("PATH", str(tmp_path))
    with caplog.at_level(logging.WARNING):
        assert local.yade_batch_command(Build()) == ["setpriv", "--pdeathsig", "KILL", "yade-batch"]
    (record,) = caplog.records
    assert "status page" in record.getMessage() and "\n" not in record.getMessage()


def test_with_a_namespace_the_batch_is_started_inside_it_and_nothing_is_said(
    tmp_path, monkeypatch, caplog
):
    for program in ("yade", "yade-batch", "setpriv", "unshare"):
        (tmp_path / program).symlink_to(shutil.which("true"))
    monkeypatch.setenv("PATH", str(tmp_path))
    with caplog.at_level(logging.WARNING):
        assert local.yade_batch_command(Build())[:3] == ["unshare", "--map-root-user", "--net"]
    assert not caplog.records
