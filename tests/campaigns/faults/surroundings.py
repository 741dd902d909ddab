"""Disk, folders and the clock."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tests.campaigns.faults.kind import REFUSED, SAME, Kind, registry
from tests.campaigns.faults.stage import NotInjected, Stage

KINDS: list[Kind] = []
fault = registry(KINDS)


def _fill(path: Path, leave: int) -> None:
    """Write until the disk is full, but for so many bytes."""
    with contextlib.suppress(OSError), open(path, "wb", buffering=0) as stream:
        while stream.write(bytes(4096)):
            pass
    with open(path, "r+b") as stream:
        stream.truncate(max(0, path.stat().st_size - leave))


def _crowd(folder: Path, leave: int) -> None:
    """Make files until there is no room for another, but for so many."""
    folder.mkdir()
    with contextlib.suppress(OSError):
        for i in range(10**6):
            (folder / str(i)).touch()
    for path in list(folder.iterdir())[:leave]:
        path.unlink()


def _short_of(stage: Stage, use_up: Callable[[Path], None]) -> None:
    with stage.file_system() as folder:
        driver = stage.start()
        stage.moment(driver)
        stage.take_stock()
        use_up(folder / "ballast")
        ended = stage.end(driver)
        if ended.status == 0:  # what was left was enough
            raise NotInjected
        stage.refused(ended)
        stage.expect(
            not [p for p in folder.rglob("*.tmp") if p.parent.name != "records"],
            "half a file is left on the full disk",
        )
        # else only notes about the runs were missing
        if len(stage.believed()) < len(stage.whole.requests):
            stage.refused(stage.run())
        subprocess.run(["rm", "-r", folder / "ballast"], check=True)


@fault(REFUSED, fake=14, real=2, needs_mounts=True)
def disk_full(stage: Stage) -> None:
    """disk full in mid-run, to the last byte or nearly so"""
    leave = stage.rng.choice([0, 1, 2, 3, 5, 8]) * (16384 if stage.whole.real else 4096)
    _short_of(stage, partial(_fill, leave=leave))


@fault(REFUSED, fake=6, needs_mounts=True)
def no_inodes(stage: Stage) -> None:
    """no room for another file in mid-run"""
    _short_of(stage, partial(_crowd, leave=stage.rng.randrange(6)))


@fault(
    REFUSED,
    fake=10,
    real=1,
    needs_mounts=True,
    name="results folder, or a folder in it, that cannot be written, with a part of the plan"
    " finished",
)
def read_only(stage: Stage) -> None:
    """A folder in which nobody can write."""
    stage.finish(stage.rng.randrange(len(stage.whole.requests)))
    folder = stage.results / stage.rng.choice(["", "records", "logs", "locks", "batches"])
    folder.mkdir(exist_ok=True)
    with stage.read_only(folder):
        stage.refused(stage.run())


@fault(
    SAME,
    fake=10,
    real=1,
    name="clock that jumps by hours or years in mid-run, and files dated in the past and in the"
    " future",
)
def clock_jumps(stage: Stage) -> None:
    """A clock that jumps, and files of another time."""
    jump = stage.rng.choice([-1, 1]) * 10 ** stage.rng.uniform(4, 9)
    stage.move_clock(jump)
    driver = stage.start()
    stage.moment(driver)
    stage.take_stock()
    for path in stage.results.glob("*/*"):
        if path.is_file():
            os.utime(path, times=(max(0.0, time.time() + jump),) * 2)
    stage.expect(stage.end(driver).status == 0, "the driver did not finish the plan")
    about = [json.loads(data)["provenance"] for data in stage.believed().values()]
    stage.expect(
        any(abs(p["started"] - time.time()) > 5e3 or abs(p["wall_time"]) > 5e3 for p in about),
        "no clock has jumped",
    )
