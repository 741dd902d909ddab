"""Runs on this machine: yade-batch over native tables, and trust in nothing but valid records."""

from __future__ import annotations

import contextlib
import fcntl
import json
import logging
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from calibrator.cost import core_seconds
from calibrator.errors import CalibratorError, one_line
from calibrator.files import own_folder, parse_json, read_text, write_text
from calibrator.quantities import SCRIPTS
from calibrator.records import InvalidRecord, Record, read_record
from calibrator.table import Request, write_table

log = logging.getLogger(__name__)

RETRIED = ("crash", "lost", "timeout")
"""Failures worth another try. A retry of the same request gives the same bits, so the other kinds would fail again."""

FOLDERS = ("records", "logs", "batches", "locks")
ROOM = 2**20
"""Bytes that must fit into each folder: what a run of some ten thousand grains leaves."""


@dataclass(frozen=True)
class Progress:
    """A moment of a batch: runs done, failed and in all, seconds spent and predicted to be left."""

    done: int
    failed: int
    total: int
    elapsed: float
    left: float


class RunFolder:
    """Where one case keeps its runs; the only place that knows the names of the files in it."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def record(self, request: Request) -> Path:
        """The record file of a request."""
        return self.path / "records" / f"{request.run_id}.json"

    def curves(self, run_id: str) -> Path:
        """The arrays of a run."""
        return self.path / "records" / f"{run_id}.npz"

    def log(self, request: Request) -> Path:
        """The output of the last attempt at a request."""
        return self.path / "logs" / f"{request.run_id}.log"

    def failures(self) -> dict[str, dict[str, str | int]]:
        """{run id: kind, message and attempts} of the runs that ended without a good record."""
        try:
            return _checked_failures(parse_json(read_text(self.path / "failures.json", links=False)))
        except FileNotFoundError:
            return {}
        except (OSError, ValueError) as error:
            raise CalibratorError(
                f"{self.path}/failures.json is damaged ({error}): delete it, failed runs are tried again"
            ) from None

    def write_failures(self, failures: dict[str, dict[str, str | int]]) -> None:
        """Replace the list of failures atomically."""
        write_text(self.path / "failures.json", json.dumps(failures, indent=1, sort_keys=True) + "\n")

    def prepare(self) -> None:
        """Make the folders, and a link to the scripts so that no path with blanks reaches yade-batch's shell."""
        own_folder(self.path)
        for name in FOLDERS:
            own_folder(self.path / name)
        link = self.path / "scripts"
        if not link.exists() or link.resolve() != SCRIPTS:
            try:
                link.unlink(missing_ok=True)
            except IsADirectoryError:
                raise CalibratorError(f"{link} is a folder, and the link to YADE's scripts goes there: remove it") from None
            link.symlink_to(SCRIPTS, target_is_directory=True)

    def check_room(self) -> None:
        """Raise OSError where a run could not leave its files: a full or read-only disk must not be blamed on the run."""
        for name in FOLDERS:
            write_text(self.path / name / "room", " " * ROOM)
            (self.path / name / "room").unlink()

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Wait for another driver that is at work in this folder, and keep others out; the lock dies with its process."""
        own_folder(self.path)
        with open(refuse_link(self.path / "driver.lock"), "a") as stream:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                log.warning("another calibrator is at work in %s: waiting for it to end", one_line(str(self.path)))
                fcntl.flock(stream, fcntl.LOCK_EX)
            except OSError:
                pass  # a network file system without locks: there, two drivers may do a run twice, but lose none
            yield


def _checked_failures(raw: Any) -> dict[str, dict[str, str | int]]:
    """The list of failures, if it is one; else ValueError."""
    shape = {"kind": str, "message": str, "attempts": int}
    for run_id, entry in raw.items() if isinstance(raw, dict) else [("the file", raw)]:
        if not isinstance(entry, dict) or {k: type(v) for k, v in entry.items()} != shape or entry["kind"] not in RETRIED:
            raise ValueError(f"{run_id} does not give a kind, a message and attempts")
    return raw


def gather(folder: RunFolder, requests: Sequence[Request]) -> list[Record]:
    """The finished runs among the requests: valid records, and failures with their kind and reason."""
    failures, records = folder.failures(), []
    for request in requests:
        try:
            records.append(read_record(folder.record(request), request))
        except (FileNotFoundError, InvalidRecord):
            if request.run_id in failures:
                failure = failures[request.run_id]
                records.append(Record(request, str(failure["kind"]), error=one_line(str(failure["message"]))))
    return records


def run(
    folder: RunFolder,
    requests: Sequence[Request],
    jobs: int = 0,
    attempts: int = 2,
    report: Callable[[Progress], None] = lambda progress: None,
) -> list[Record]:
    """Carry out the requests that have no good record yet, longest first, retrying by failure kind.

    Returns the finished runs. Whatever is interrupted, calling again goes on from the records that exist.
    Raises CalibratorError if YADE is missing or yade-batch ends early, OSError where the disk is full or read-only.
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
        _run_batch(folder, pending, cost, command, jobs or len(os.sched_getaffinity(0)), 2.0**attempt, report)
    records = gather(folder, requests)
    if len(records) < len(requests):
        raise CalibratorError(
            f"{len(requests) - len(records)} runs are still to be done: yade-batch ended early (the end of "
            f"{folder.path}/logs/yade-batch.log says why), or records were damaged meanwhile; run the same command again"
        )
    return records


def pending_requests(folder: RunFolder, requests: Sequence[Request], attempts: int) -> list[Request]:
    """The requests that are still to be run; the list of failures is read once, as it grows with the runs."""
    failures = folder.failures()
    return [r for r in requests if _is_pending(folder, r, failed_attempts(failures, r), attempts)]


def _is_pending(folder: RunFolder, request: Request, failed: int, attempts: int) -> bool:
    """True unless a record can be believed, or its failure has been tried often enough."""
    try:
        record = read_record(folder.record(request), request)
    except FileNotFoundError:
        record = None
    except InvalidRecord as error:
        log.warning("record %s %s: running it again", request.run_id, error)
        folder.record(request).rename(folder.record(request).with_suffix(".invalid"))
        record = None
    if record is not None and record.status not in RETRIED:
        return False
    return failed < attempts


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
    if not all(_succeeded(folder, request) for request in batch):
        folder.check_room()
    note_failures(folder, batch)


def clear(folder: RunFolder, batch: Sequence[Request]) -> None:
    """Remove what failed attempts left: such a record would make the wrapper believe that the run is done.

    A good record stays: a run that outlived its driver may have written it since the batch was put together.
    """
    for request in batch:
        with contextlib.suppress(FileNotFoundError, InvalidRecord):
            if read_record(folder.record(request), request).status in RETRIED:
                folder.record(request).unlink()
        folder.log(request).unlink(missing_ok=True)
        refuse_link(folder.path / "locks" / request.run_id)


def time_limit(cost: dict[str, float], patience: float) -> float:
    """Wall-clock limit [s] of each run of a batch."""
    return patience * max(120.0, 10 * max(cost.values()))


def batch_arguments(table: str, batch: Sequence[Request], jobs: int) -> list[str]:
    """Arguments of yade-batch for a table, both relative to the folder of the runs."""
    setups = {r.setup for r in batch}
    options = {"-j": jobs, "--job-threads": 1, "--nice": 0, "--plot-update": 0, "--log": "logs/@.log"}
    pairs = [str(word) for pair in options.items() for word in pair]
    script = [f"scripts/{setup}.py" for setup in setups if len(setups) == 1]
    return [*pairs, "--disable-pynotify", "--executable", "scripts/run_yade.sh", table, *script]


def refuse_link(path: Path) -> Path:
    """A file that is going to be written in place; a link there is removed, lest it leads out of the results folder."""
    if path.is_symlink():
        path.unlink()
    return path


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
        report(Progress(len(finished), len(failed), len(batch), elapsed, _time_left(cost, finished, elapsed, jobs)))
        if ended:
            return
        time.sleep(0.5)


def notice(folder: RunFolder, requests: Sequence[Request], finished: set[str], failed: set[str]) -> None:
    """Add the run ids whose record has appeared since the last look to `finished`, and to `failed` those that are not ok."""
    for request in requests:
        if request.run_id not in finished and folder.record(request).exists():
            finished.add(request.run_id)
            if not _succeeded(folder, request):
                failed.add(request.run_id)


def _succeeded(folder: RunFolder, request: Request) -> bool:
    try:
        return read_record(folder.record(request), request).status == "ok"
    except (FileNotFoundError, InvalidRecord):
        return False


def _time_left(cost: dict[str, float], finished: set[str], elapsed: float, jobs: int) -> float:
    total, spent = sum(cost.values()), sum(cost[i] for i in finished)
    by_model = total / jobs - elapsed
    by_rate = elapsed * (total - spent) / spent if spent > 0 else by_model
    share = spent / total  # trust the measured rate more and more as runs finish
    return max(0.0, share * by_rate + (1 - share) * by_model)


def note_failures(folder: RunFolder, batch: Sequence[Request], verdicts: Mapping[str, tuple[str, str]] | None = None) -> None:
    """Count an attempt for each run that left no good record, with the kind and reason that its log shows.

    verdicts : {run id: (kind, message)} of runs without a record about which more is known than their log says
    """
    failures = folder.failures()
    for request in batch:
        try:
            record = read_record(folder.record(request), request)
            kind, message = record.status, record.error
        except (FileNotFoundError, InvalidRecord) as error:
            known = (verdicts or {}).get(request.run_id)
            if known is None and not _started(folder.log(request)):
                continue  # that yade-batch died, or YADE went missing, is no failure of the runs that were to come
            kind, message = known or _verdict_from_log(folder.log(request), error)
        if kind in RETRIED:
            failures[request.run_id] = {"kind": kind, "message": message, "attempts": failed_attempts(failures, request) + 1}
        else:
            failures.pop(request.run_id, None)
    folder.write_failures(failures)


def failed_attempts(failures: dict[str, dict[str, str | int]], request: Request) -> int:
    """How often a run has failed, by the list of failures."""
    return int(failures[request.run_id]["attempts"]) if request.run_id in failures else 0


def exit_code(log_file: Path) -> int | None:
    """Exit code of a run, 128 + n where signal n killed it; None where yade-batch has not appended its summary to the log.

    What yade-batch writes is the status of the shell that it has started the run in, or of the run itself.
    """
    status = re.search(r"^status  : (\d{1,5}) ", _text(log_file), re.MULTILINE)
    code = os.waitstatus_to_exitcode(int(status.group(1))) if status else None
    return code if code is None or code >= 0 else 128 - code


def _text(log_file: Path) -> str:
    return log_file.read_text("utf-8", errors="replace") if log_file.is_file() else ""


def _started(log_file: Path) -> bool:
    """Whether a run got as far as YADE: it has a log, and that does not say that a program was missing (126, 127)."""
    return log_file.is_file() and exit_code(log_file) not in (126, 127)


def _verdict_from_log(path: Path, why: Exception) -> tuple[str, str]:
    """What became of a run without a valid record."""
    if isinstance(why, InvalidRecord):
        return "lost", f"invalid record: {why}"
    code = exit_code(path)
    without_sentence = {
        None: ("lost", "no record and no exit status: the run was killed with its driver"),
        0: ("lost", "it ended without writing a record"),
        124: ("timeout", "the wall-clock limit passed"),
        137: ("lost", "killed from outside (signal 9)"),
        143: ("lost", "ended from outside (signal 15)"),
    }
    if code in without_sentence:
        return without_sentence[code]
    lines = [line for line in _text(path).split("=" * 19)[0].splitlines() if line.strip()]
    return "crash", f"exit code {code}: {lines[-1][:200] if lines else 'no output'}"


def yade_batch_command() -> list[str]:
    """How yade-batch is called: with its servers cut off from the network where that is possible, and never orphaned."""
    for program in ("yade-batch", "yade", "setpriv"):
        if shutil.which(program) is None:
            raise CalibratorError(f"{program} is not installed: run `make yade` (apt-get install --no-install-recommends yade)")
    command = ["setpriv", "--pdeathsig", "KILL", "yade-batch"]
    for namespace in (["unshare", "--map-root-user", "--net"], ["unshare", "--net"]):
        if shutil.which("unshare") and subprocess.run([*namespace, "true"], capture_output=True).returncode == 0:
            return [*namespace, *command]
    log.warning("no network namespace here: yade-batch's status page (port 9080+) can be reached from other machines")
    return command


def clean_environment(time_limit: float) -> dict[str, str]:
    """The little that YADE needs. A virtual environment's PYTHONPATH, or OpenMP settings, would change or break its runs."""
    kept = {n: os.environ[n] for n in ("PATH", "HOME", "TMPDIR", "USER", "LOGNAME") if n in os.environ}
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
