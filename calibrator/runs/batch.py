"""What engines share: pending runs, their time limits, yade-batch's arguments, and progress."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from calibrator.runs.failures import failed_attempts, note_failures
from calibrator.runs.folder import RETRIED, RunFolder, log, refuse_link
from calibrator.runs.record import InvalidRecord, read_record
from calibrator.runs.request import Request

HANGS = 10
"""Times its CPU time that a run may take by the clock: a machine may be as busy as that."""


@dataclass(frozen=True)
class Progress:
    """A moment of a call: runs done, failed and in all, seconds spent and predicted to be left.

    Attributes
    ----------
    done : runs with a final end, good or not; failed : those of them without every response;
        elapsed, left [s] : of the batch in flight; retried : runs that ended without a result and
        have another attempt, under way or to come.
    """

    done: int
    failed: int
    total: int
    elapsed: float
    left: float
    retried: int = 0


@dataclass(frozen=True)
class Batch:
    """Runs that are to be made, the longest first.

    Attributes
    ----------
    cost : predicted core-seconds by run id; failed : how often each has failed, by run id.
    """

    requests: list[Request]
    cost: dict[str, float]
    failed: dict[str, int]

    def patience(self, requests: Sequence[Request]) -> float:
        """Factor on the time limit of these runs: two for each failure of the least lucky one."""
        return float(2.0 ** max(self.failed[r.run_id] for r in requests))


def pending_requests(
    folder: RunFolder, requests: Sequence[Request], attempts: int
) -> list[Request]:
    """The requests that are still to be run."""
    failures = folder.failures()  # read once, as it grows with the runs
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


def clear(folder: RunFolder, batch: Sequence[Request]) -> None:
    """Remove what failed attempts left.

    A record of theirs would make the wrapper believe that the run is done. A good one stays: a run
    that outlived its driver may have written it since the batch was put together.
    """
    for request in batch:
        with contextlib.suppress(FileNotFoundError, InvalidRecord):
            if read_record(folder.record(request), request).status in RETRIED:
                folder.record(request).unlink()
        folder.log(request).unlink(missing_ok=True)
        refuse_link(folder.path / "locks" / request.run_id)


def cpu_limit(cost: dict[str, float], patience: float) -> float:
    """Limit [s] of the CPU time of each run of a batch: a busy machine does not use it up."""
    return patience * max(120.0, 10 * max(cost.values()))


def time_limit(cost: dict[str, float], patience: float) -> float:
    """Limit [s] by the clock of each run of a batch, long enough to catch only what hangs."""
    return HANGS * cpu_limit(cost, patience)


def batch_arguments(
    table: str, batch: Sequence[Request], jobs: int, scripts: str = "scripts"
) -> list[str]:
    """Arguments of yade-batch for a table and scripts, all relative to the folder of the runs.

    scripts : where those of the set-ups are; a table of several set-ups names them itself.
    """
    setups = {r.setup for r in batch}
    options = {
        "-j": jobs,
        "--job-threads": 1,
        "--nice": 0,
        "--plot-update": 0,
        "--log": "logs/@.log",
    }
    pairs = [str(word) for pair in options.items() for word in pair]
    script = [f"{scripts}/{setup}.py" for setup in setups if len(setups) == 1]
    return [*pairs, "--disable-pynotify", "--executable", "scripts/run_yade.sh", table, *script]


def note_ended(
    folder: RunFolder,
    requests: Sequence[Request],
    verdicts: Mapping[str, tuple[str, str]] | None = None,
) -> None:
    """Note what became of runs that have ended; see `note_failures`.

    Raises OSError where the disk is full or read-only, which is no failure of the runs.
    """
    if not all(succeeded(folder, request) for request in requests):
        folder.check_room()
    note_failures(folder, requests, verdicts)


def succeeded(folder: RunFolder, request: Request) -> bool:
    """Whether a run has left a valid record with every response."""
    try:
        return read_record(folder.record(request), request).status == "ok"
    except (FileNotFoundError, InvalidRecord):
        return False
