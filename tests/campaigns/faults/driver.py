"""YADE, fake and real, and drivers that can be killed.

A driver is a process of its own, in a session of its own. With the fake YADE it is forked from this
process, which has imported the calibrator already: importing costs more than all the rest. With the
real YADE it is `python -m calibrator.cli`.
"""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import os
import re
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from calibrator.cli import main

REPO = Path(__file__).resolve().parents[3]
# What a run needs beside YADE: on a PATH of these alone YADE can be missing although it is here.
TOOLS = ("sh", "sed", "mkdir", "flock", "timeout", "setpriv", "unshare", "true")
# seconds for what takes a few, on a machine that may be busy with simulations: a fault that hangs
PATIENCE = 1800.0
FORK = multiprocessing.get_context("fork")


def install(folder: Path, real: bool) -> str:
    """Put a yade and a yade-batch into folder/bin; returns a PATH with them.

    Both note the runs they start in calls.txt.
    """
    programs, tools = folder / "bin", folder / "tools"
    programs.mkdir(parents=True)
    if real:
        note = 'sed -n "${YADE_BATCH##*:}s/ .*//p" "${YADE_BATCH%:*}" >> calls.txt'
        clock = f"[ ! -d '{folder}/clock' ] || export PYTHONPATH='{folder}/clock'"
        _program(
            programs / "yade", f'#!/bin/sh\n{note}\n{clock}\nexec {shutil.which("yade")} "$@"\n'
        )
        return f"{programs}{os.pathsep}{os.environ['PATH']}"
    for name, function in (("yade", "run_line"), ("yade-batch", "run_batch")):
        code = (
            f"import sys\nsys.path.insert(0, {str(REPO / 'tests')!r})\nimport"
            f" fake_yade\nfake_yade.{function}()\n"
        )
        _program(programs / name, f"#!{sys.executable}\n{code}")
    tools.mkdir()
    for tool in TOOLS:
        (tools / tool).symlink_to(str(shutil.which(tool)))
    return f"{programs}{os.pathsep}{tools}"


def _program(path: Path, text: str) -> None:
    path.write_text(text)
    path.chmod(0o755)


@dataclass(frozen=True)
class Ended:
    """How a driver ended: its status and what it said on stderr."""

    status: int
    said: str  # on stderr
    told: str = ""  # on stdout

    @property
    def refused(self) -> bool:
        """Whether it ends with an error and its remedy, after warnings and progress only.

        That is one line, or several mistakes with a line each.
        """
        lines = self.said.splitlines()
        first = next((i for i, x in enumerate(lines) if x.startswith("calibrator: ")), len(lines))
        before, said = lines[:first], [x.removeprefix("calibrator: ") for x in lines[first:]]
        plain = all(re.match(r"WARNING: |[a-z ]+: \[[#.]+\] ", line) for line in before)
        mistakes = said[1:] if len(said) > 1 and said[0].endswith("mistakes:") else said
        told = len(said) == 1 or mistakes is not said
        return self.status == 2 and plain and told and all(": " in x or "; " in x for x in mistakes)


@dataclass(frozen=True)
class Driver:
    """A driver under way."""

    process: Any
    errors: Path

    def wait(self) -> Ended:
        """Wait for its end."""
        self.process.join(PATIENCE)
        if self.process.exitcode is None:
            raise TimeoutError(f"a driver did not end in {PATIENCE:g} s: {self.errors.read_text()}")
        return Ended(
            self.process.exitcode,
            self.errors.read_text(),
            self.errors.with_suffix(".out").read_text(),
        )

    @property
    def running(self) -> bool:
        """Whether it is still there."""
        return self.process.is_alive()

    def kill(self) -> None:
        """Kill -9, of the driver alone."""
        self.process.kill()
        self.process.join()


CLOCK = """import time
_now, _start = time.time, {start}
time.time = lambda: _now() + ({jump} if _now() > _start else 0.0)
"""


def drive(arguments: list[str], path: str, errors: Path, real: bool, clock: Path) -> None:
    """What a driver's process does; a folder `clock` holds the clock of another time."""
    os.setsid()
    os.environ["PATH"] = path
    with open(errors.with_suffix(".out"), "wb") as out, open(errors, "wb") as err:
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
    if real:
        os.environ["PYTHONPATH"] = f"{clock}{os.pathsep}{REPO}"
        os.execv(sys.executable, [sys.executable, "-m", "calibrator.cli", *arguments])
    # they stay open until the process ends
    sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", closefd=False)  # noqa: SIM115
    logging.getLogger().handlers.clear()
    if clock.exists():
        exec((clock / "sitecustomize.py").read_text(), {})
    sys.exit(main(arguments))


def descendants(pid: int) -> list[int]:
    """Process ids of the children of a process, of their children, and so on."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it ended meanwhile
            parent = int(stat.read_text().rpartition(")")[2].split()[1])
            children.setdefault(parent, []).append(int(stat.parent.name))
    found, left = [], [pid]
    while left:
        left += (own := children.get(left.pop(), []))
        found += own
    return found


def role(pid: int) -> str:
    """What a driver's descendant is: yade-batch, yade, or the wrapper with shell and time limit."""
    try:
        line = Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return "ended"
    words = [Path(word).name for word in line.split("\0")]
    if words[0].startswith("python") and words[1] in ("yade", "yade-batch"):
        return words[1]
    return (
        "wrapper"
        if ("run_yade.sh" in line and words[0] == "sh") or words[0] in ("timeout", "flock")
        else "other"
    )
