"""Runs on this machine: yade-batch over native tables, and trust in nothing but valid records."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Sequence

from calibrator.errors import CalibratorError
from calibrator.runs.batch import (
    Progress,
    batch_arguments,
    clear,
    notice,
    pending_requests,
    succeeded,
    time_limit,
)
from calibrator.runs.cost import core_seconds
from calibrator.runs.failures import note_failures
from calibrator.runs.folder import RunFolder, gather, log, refuse_link
from calibrator.runs.record import Record
from calibrator.runs.request import Request, write_table


def run(
    folder: RunFolder,
    requests: Sequence[Request],
    jobs: int = 0,
    attempts: int = 2,
    report: Callable[[Progress], None] = lambda progress: None,
) -> list[Record]:
    """Carry out the requests that have no good record yet, longest first, retrying by failure kind.

    Returns the finished runs. Whatever is interrupted, calling again goes on from the records that
    exist. Raises CalibratorError if YADE is missing or yade-batch ends early, OSError where the
    disk is full or read-only.
    """
    folder.prepare()
    for attempt in range(attempts):
        pending = pending_requests(folder, requests, attempts)
        if not pending:
            break
        command = yade_batch_command()
        predicted = core_seconds(pending, gather(folder, requests))
        cost = dict(zip((r.run_id for r in pending), predicted, strict=True))
        pending.sort(key=lambda r: -cost[r.run_id])
        _run_batch(
            folder,
            pending,
            cost,
            command,
            jobs or len(os.sched_getaffinity(0)),
            2.0**attempt,
            report,
        )
    records = gather(folder, requests)
    if len(records) < len(requests):
        raise CalibratorError(
            f"{len(requests) - len(records)} runs are still to be done: yade-batch ended early (the"
            f" end of {folder.path}/logs/yade-batch.log says why), or records were damaged"
            " meanwhile; run the same command again"
        )
    return records


def _run_batch(
    folder: RunFolder,
    batch: list[Request],
    cost: dict[str, float],
    command: list[str],
    jobs: int,
    patience: float,
    report: Callable[[Progress], None],
) -> None:
    folder.check_room()
    clear(folder, batch)
    name = f"batches/{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}.table"
    write_table(folder.path / name, batch)
    limit = time_limit(cost, patience)
    arguments = batch_arguments(name, batch, jobs)
    with open(refuse_link(folder.path / "logs" / "yade-batch.log"), "ab") as output:
        process = subprocess.Popen(
            [*command, *arguments],
            cwd=folder.path,
            env=clean_environment(limit),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            _watch(process, folder, batch, cost, jobs, report)
        finally:
            _kill_group(process)
    if not all(succeeded(folder, request) for request in batch):
        folder.check_room()
    note_failures(folder, batch)


def _watch(
    process: subprocess.Popen[bytes],
    folder: RunFolder,
    batch: list[Request],
    cost: dict[str, float],
    jobs: int,
    report: Callable[[Progress], None],
) -> None:
    begin, finished, failed = time.monotonic(), set[str](), set[str]()
    while True:
        ended = process.poll() is not None
        notice(folder, batch, finished, failed)
        elapsed = time.monotonic() - begin
        report(
            Progress(
                len(finished),
                len(failed),
                len(batch),
                elapsed,
                _time_left(cost, finished, elapsed, jobs),
            )
        )
        if ended:
            return
        time.sleep(0.5)


def _time_left(cost: dict[str, float], finished: set[str], elapsed: float, jobs: int) -> float:
    total, spent = sum(cost.values()), sum(cost[i] for i in finished)
    by_model = total / jobs - elapsed
    by_rate = elapsed * (total - spent) / spent if spent > 0 else by_model
    share = spent / total  # trust the measured rate more and more as runs finish
    return max(0.0, share * by_rate + (1 - share) * by_model)


def yade_batch_command() -> list[str]:
    """How yade-batch is called: with its servers cut off from the network where that is possible,
    and never orphaned.
    """
    for program in ("yade-batch", "yade", "setpriv"):
        if shutil.which(program) is None:
            raise CalibratorError(
                f"{program} is not installed: run `make yade` (apt-get install"
                " --no-install-recommends yade)"
            )
    command = ["setpriv", "--pdeathsig", "KILL", "yade-batch"]
    for namespace in (["unshare", "--map-root-user", "--net"], ["unshare", "--net"]):
        if (
            shutil.which("unshare")
            and subprocess.run([*namespace, "true"], capture_output=True).returncode == 0
        ):
            return [*namespace, *command]
    log.warning(
        "no network namespace here: yade-batch's status page (port 9080+) can be reached from other"
        " machines"
    )
    return command


def clean_environment(time_limit: float) -> dict[str, str]:
    """The little that YADE needs.

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
    }


def _kill_group(process: subprocess.Popen[bytes]) -> None:
    """End yade-batch and every YADE below it; yade-batch itself would leave its children running."""
    for sign in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, sign)
            process.wait(2)
        except ProcessLookupError:
            break
        except subprocess.TimeoutExpired:
            continue
    process.wait()
