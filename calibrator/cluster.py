"""Runs on a cluster: SLURM job arrays of yade-batch, with the queue and the record store as the only state."""

from __future__ import annotations

import fcntl
import getpass
import json
import shlex
import shutil
import subprocess
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from calibrator.case import Cluster
from calibrator.cost import core_seconds
from calibrator.errors import CalibratorError
from calibrator.records import Record
from calibrator.runner import (
    Progress,
    RunFolder,
    batch_arguments,
    clear,
    gather,
    note_failures,
    pending_requests,
    succeeded,
    time_limit,
)
from calibrator.table import Request, write_table

LARGEST_ARRAY = 1001
LONGEST_TABLE = 2000  # every run parses the whole table
POLL = 5.0  # seconds between two looks at the queue
QUEUE_TRIES = 12  # looks at a queue that does not answer before giving up


def run(
    folder: RunFolder,
    requests: Sequence[Request],
    options: Cluster,
    attempts: int = 2,
    report: Callable[[Progress], None] = lambda progress: None,
) -> list[Record]:
    """Carry out the requests that have no good record yet through SLURM; the contract is that of `runner.run`.

    The driver may die at any time: the jobs go on, and the next call waits for them before it submits what is missing.
    Raises CalibratorError where SLURM is missing, does not answer, refuses a submission, or where another driver is at work.
    """
    for program in ("sbatch", "squeue"):
        if shutil.which(program) is None:
            raise CalibratorError(f"{program} is not installed here: call this on a login node, or leave out --engine slurm")
    folder.prepare()
    with _only_driver(folder):
        _settle(folder, requests, options, report)
        while pending := pending_requests(folder, requests, attempts):
            submitted = _submit(folder, pending, options)
            if not _settle(folder, requests, options, report):
                raise CalibratorError(
                    f"no run of {submitted} started: read {folder.path}/{submitted}/*.out, correct [cluster], then call again"
                )
    return gather(folder, requests)


@contextmanager
def _only_driver(folder: RunFolder) -> Iterator[None]:
    """Two drivers at once would submit the same runs."""
    with open(folder.path / "locks" / "driver", "w") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise CalibratorError(f"another driver is at work in {folder.path}: wait for it, or end it first") from None
        yield


def _submit(folder: RunFolder, pending: list[Request], options: Cluster) -> str:
    """Submit the requests as arrays, those with the same number of failed attempts together; returns the last batch's name."""
    failures = folder.failures()
    groups: dict[int, list[Request]] = {}
    for request in pending:
        groups.setdefault(int(failures.get(request.run_id, {"attempts": 0})["attempts"]), []).append(request)
    name = ""
    for failed, group in sorted(groups.items()):
        cost = dict(zip((r.run_id for r in group), map(float, core_seconds(group, gather(folder, group))), strict=True))
        slices = _slices(sorted(group, key=lambda r: -cost[r.run_id]), cost, 60 * options.slice_minutes)
        for first in range(0, len(slices), LARGEST_ARRAY):
            name = _submit_array(folder, slices[first : first + LARGEST_ARRAY], options, time_limit(cost, 2.0**failed))
    return name


def _slices(requests: Sequence[Request], cost: dict[str, float], seconds: float) -> list[list[Request]]:
    """Cut into slices of at most so many predicted seconds, and of one run at least."""
    slices: list[list[Request]] = []
    spent = 0.0
    for request in requests:
        if not slices or spent + cost[request.run_id] > seconds or len(slices[-1]) >= LONGEST_TABLE:
            slices.append([])
            spent = 0.0
        slices[-1].append(request)
        spent += cost[request.run_id]
    return slices


def _submit_array(folder: RunFolder, slices: list[list[Request]], options: Cluster, limit: float) -> str:
    """Write the batch, then submit it under its own name: what squeue shows can always be read back. Returns the name."""
    name = f"batches/{time.strftime('%Y%m%d-%H%M%S')}-{uuid.uuid4().hex[:12]}"
    path = folder.path / name
    path.mkdir()
    for index, own in enumerate(slices):
        clear(folder, own)
        write_table(path / f"{index}.table", own)
        (path / f"{index}.sh").write_text(shlex.join(batch_arguments(f"{name}/{index}.table", own, 1)) + "\n")
    (path / "job.sh").write_text(_job(name, options, limit))
    (path / "manifest.tmp").write_text(json.dumps([[r.run_id for r in own] for own in slices]) + "\n")
    (path / "manifest.tmp").rename(path / "manifest.json")
    answer = subprocess.run(_sbatch(folder, name, len(slices), options), capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if answer.returncode:
        (path / "settled").touch()
        why = " ".join(answer.stderr.split())
        raise CalibratorError(
            f"SLURM refused the submission ({why}): correct [cluster] in the case or site file, then call again"
        )
    return name


def _sbatch(folder: RunFolder, name: str, tasks: int, options: Cluster) -> list[str]:
    given = {"partition": options.partition, "account": options.account, "time": options.time, "mem": options.memory}
    return [
        "sbatch",
        "--parsable",
        f"--array=0-{tasks - 1}",
        "--job-name=calibrator",
        f"--comment={name}",
        f"--chdir={folder.path.resolve()}",
        f"--output={name}/%a.out",
        "--open-mode=append",
        "--ntasks=1",
        "--cpus-per-task=1",
        "--no-requeue",  # the driver decides what runs again
        "--export=PATH,HOME,USER,LOGNAME",
        *(f"--{key}={value}" for key, value in given.items() if value),
        f"{folder.path.resolve()}/{name}/job.sh",
    ]


def _job(name: str, options: Cluster, limit: float) -> str:
    """The script of an array task. The module lines are the user's own shell text."""
    return "\n".join(
        [
            "#!/bin/bash -l",
            *options.modules,
            "unset PYTHONHOME VIRTUAL_ENV",
            "export LANG=C.UTF-8 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1",
            f"export CALIBRATOR_TIME_LIMIT={limit:.0f}",
            "wall=()",
            "if unshare --map-root-user --net true 2>/dev/null; then wall=(unshare --map-root-user --net)",
            "elif unshare --net true 2>/dev/null; then wall=(unshare --net); fi",
            f'eval "exec "\'"${{wall[@]}}"\'" setpriv --pdeathsig KILL yade-batch $(cat {name}/$SLURM_ARRAY_TASK_ID.sh)"',
            "",
        ]
    )


def _queue() -> set[str]:
    """The batches that have a task in the queue. Raises CalibratorError if SLURM does not answer for a minute."""
    command = ["squeue", "--noheader", "--user", getpass.getuser(), "--format=%k"]
    for attempt in range(QUEUE_TRIES):
        answer = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if answer.returncode == 0:
            return {line.strip() for line in answer.stdout.splitlines()}
        if attempt < QUEUE_TRIES - 1:
            time.sleep(POLL)
    raise CalibratorError(f"squeue does not answer ({' '.join(answer.stderr.split())}): call again when SLURM is back")


def _open_batches(folder: RunFolder) -> list[Path]:
    return [p.parent for p in sorted(folder.path.glob("batches/*/manifest.json")) if not (p.parent / "settled").exists()]


def _settle(folder: RunFolder, requests: Sequence[Request], options: Cluster, report: Callable[[Progress], None]) -> bool:
    """Wait until no batch is in flight, noting the failures of each that ended. True if any of their runs started."""
    begin, gone, started = time.monotonic(), dict[Path, float](), False
    by_id = {r.run_id: r for r in requests}
    while batches := _open_batches(folder):
        queued = _queue()
        for batch in batches:
            own = [by_id[i] for part in json.loads((batch / "manifest.json").read_text()) for i in part if i in by_id]
            if f"batches/{batch.name}" in queued:
                gone.pop(batch, None)
            elif (
                all(_has_verdict(folder, r) for r in own)
                or time.monotonic() - gone.setdefault(batch, time.monotonic()) >= options.grace
            ):
                started = _close(folder, batch, own) or started
        _report(folder, requests, begin, report)
        if _open_batches(folder):
            time.sleep(POLL)
    return started


def _has_verdict(folder: RunFolder, request: Request) -> bool:
    log = folder.log(request)
    return folder.record(request).exists() or (log.exists() and "\nstatus  :" in log.read_text(errors="replace"))


def _close(folder: RunFolder, batch: Path, requests: Sequence[Request]) -> bool:
    """Note the failures of an ended batch. A run that never started costs no attempt."""
    tried = [r for r in requests if folder.record(r).exists() or folder.log(r).exists()]
    note_failures(folder, tried)
    (batch / "settled").touch()
    return bool(tried)


def _report(folder: RunFolder, requests: Sequence[Request], begin: float, report: Callable[[Progress], None]) -> None:
    """Tell the progress; how long the queue will take is not known, so the time left follows from the rate alone."""
    done = [r for r in requests if folder.record(r).exists()]
    elapsed = time.monotonic() - begin
    left = elapsed * (len(requests) - len(done)) / max(len(done), 1)
    report(Progress(len(done), sum(not succeeded(folder, r) for r in done), len(requests), elapsed, left))
