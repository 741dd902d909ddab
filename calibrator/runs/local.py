"""Runs on this machine: yade-batch over native tables, and trust in nothing but valid records."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable, Sequence

from calibrator.runs import engine
from calibrator.runs.batch import (
    Batch,
    Progress,
    batch_arguments,
    clear,
    cpu_limit,
    note_ended,
    time_limit,
)
from calibrator.runs.folder import RunFolder, log, refuse_link
from calibrator.runs.programs import YADE_VARIABLE, Build, chosen, namespace
from calibrator.runs.record import Record
from calibrator.runs.request import Request, write_table


class Local(engine.Engine):
    """yade-batch on this machine, which ends with its driver.

    Parameters
    ----------
    jobs : runs at a time; 0 takes every core that this process is allowed.
    yade : the build of YADE that the case names; empty where it names none.
    scripts : where the set-ups' scripts lie in the folder of the runs.
    """

    pause = 0.5
    advice = ""
    early_ends = 2  # a yade-batch that dies again and again is not started for ever

    def __init__(self, jobs: int = 0, yade: str = "", scripts: str = "scripts") -> None:
        self.build = chosen(yade)
        self.scripts = scripts
        self.cores = self.jobs = jobs or len(os.sched_getaffinity(0))
        self.command: list[str] = []
        self.process: subprocess.Popen[bytes] | None = None
        self.batch: list[Request] = []

    def require(self) -> None:
        """Raise CalibratorError where YADE, or what yade-batch is called with, is missing."""
        self.command = yade_batch_command(self.build)

    def submit(self, folder: RunFolder, batch: Batch) -> None:
        """Start yade-batch over one table of all runs."""
        self.batch = batch.requests
        self.advice = (
            f"yade-batch ended early (the end of {folder.path}/logs/yade-batch.log says why), or"
            " records were damaged meanwhile; run the same command again"
        )
        clear(folder, self.batch)
        name = f"batches/{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}.table"
        write_table(folder.path / name, self.batch)
        patience = batch.patience(self.batch)
        limits = time_limit(batch.cost, patience), cpu_limit(batch.cost, patience)
        arguments = batch_arguments(name, self.batch, self.jobs, self.scripts)
        with open(refuse_link(folder.path / "logs" / "yade-batch.log"), "ab") as output:
            self.process = subprocess.Popen(
                [*self.command, *arguments],
                cwd=folder.path,
                env={**clean_environment(*limits), YADE_VARIABLE: self.build.yade},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def poll(self, folder: RunFolder, requests: Sequence[Request]) -> bool:
        """Whether yade-batch is at work; notes what became of its runs once it has ended."""
        if self.process is None:
            return False
        if self.process.poll() is None:
            return True
        self.end()
        note_ended(folder, self.batch)
        return False

    def end(self) -> None:
        """End yade-batch and every YADE below it: by itself it would leave them running."""
        if self.process is not None:
            _kill_group(self.process)
        self.process = None

    def give_up(self, folder: RunFolder, requests: Sequence[Request]) -> None:
        """Start no further run: yade-batch alone starts them."""
        self.end()


def run(
    folder: RunFolder,
    requests: Sequence[Request],
    jobs: int = 0,
    attempts: int = 2,
    report: Callable[[Progress], None] = lambda progress: None,
    go_on: bool = False,
) -> list[Record]:
    """Carry out requests on this machine; see `engine.run`."""
    return engine.run(Local(jobs), folder, requests, attempts, report, go_on)


def yade_batch_command(build: Build) -> list[str]:
    """How yade-batch is called: never orphaned, and cut off from the network where possible.

    Raises CalibratorError where it, or a program that it needs, is missing.
    """
    build.require()
    wall = namespace()
    if not wall:
        log.warning(
            "no network namespace here: yade-batch's status page (port 9080+) can be reached from"
            " other machines"
        )
    return [*wall, "setpriv", "--pdeathsig", "KILL", build.batch]


def clean_environment(time_limit: float, cpu_limit: float) -> dict[str, str]:
    """The little that YADE needs, and the limits [s] of a run by the clock and of its CPU time.

    A virtual environment's PYTHONPATH, or OpenMP settings, would change or break its runs.
    """
    kept = {
        n: os.environ[n] for n in ("PATH", "HOME", "TMPDIR", "USER", "LOGNAME") if n in os.environ
    }
    return {
        **kept,
        "LANG": "C.UTF-8",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONUNBUFFERED": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
        "CALIBRATOR_TIME_LIMIT": f"{time_limit:.0f}",
        "CALIBRATOR_CPU_LIMIT": f"{cpu_limit:.0f}",
    }


def _kill_group(process: subprocess.Popen[bytes]) -> None:
    """End a process and all below it, which is a group of its own."""
    for sign in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, sign)
            process.wait(2)
        except ProcessLookupError:
            break
        except subprocess.TimeoutExpired:
            continue
    process.wait()
