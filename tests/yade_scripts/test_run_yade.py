"""The wrapper around a run: its lock, and what happens where the lock cannot be had."""

import fcntl
import os
import subprocess

import pytest

from calibrator.case.vocabulary import SCRIPTS
from calibrator.runs.request import Request, write_table


@pytest.mark.parametrize("link", ["locks", "locks/{}"])
def test_the_wrapper_opens_no_lock_that_is_a_link(tmp_path, fake_yade, link):
    """The driver removes such a link before a batch; this one was put there after that."""
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "victim").write_text("mine")
    request, place = Request.of("ledge"), tmp_path / link.format(Request.of("ledge").run_id)
    place.parent.mkdir(exist_ok=True)
    place.symlink_to(tmp_path / "outside" / ("victim" if "/" in link else ""))
    write_table(tmp_path / "runs.table", [request])
    done = subprocess.run(
        ["sh", SCRIPTS / "run_yade.sh", "-x", "scripts/ledge.py"],
        cwd=tmp_path,
        env={**os.environ, "YADE_BATCH": "runs.table:2", "CALIBRATOR_TIME_LIMIT": "60"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and "is a symbolic link: remove it" in done.stderr
    assert not (tmp_path / "records").exists() and [
        p.name for p in (tmp_path / "outside").iterdir()
    ] == ["victim"]
    assert (tmp_path / "outside" / "victim").read_text() == "mine"


def test_a_lock_that_is_never_released_ends_in_a_timeout(tmp_path, fake_yade):
    """A YADE that hangs may have lost its driver and clock; who waits for it must not hang."""
    write_table(tmp_path / "runs.table", [Request.of("ledge")])
    (tmp_path / "locks").mkdir()
    limited = {**os.environ, "YADE_BATCH": "runs.table:2", "CALIBRATOR_TIME_LIMIT": "0.2"}
    with open(tmp_path / "locks" / Request.of("ledge").run_id, "w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        done = subprocess.run(
            ["sh", SCRIPTS / "run_yade.sh", "-x", "scripts/ledge.py"],
            cwd=tmp_path,
            env=limited,
            timeout=60,
        )
    assert done.returncode == 124 and not (tmp_path / "calls.txt").exists()
