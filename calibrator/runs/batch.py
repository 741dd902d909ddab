"""What engines share: pending runs, their time limits, yade-batch's arguments, and progress."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from calibrator.runs.failures import failed_attempts, note_failures
from calibrator.runs.folder import RETRIED, RunFolder, log, refuse_link
from calibrator.runs.record import InvalidRecord, read_record
from calibrator.runs.request import Request


@dataclass(frozen=True)
class Progress:
    """A moment of a batch: runs done, failed and in all, seconds spent and predicted to be left."""

    done: int
    failed: int
    total: int
    elapsed: float
    left: float


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


class Watch:
    """Which runs of a batch have ended, and how long the others will take.

    Parameters
    ----------
    cores : how many runs are made at a time; None where that is up to a queue.
    """

    def __init__(self, folder: RunFolder, batch: Batch, cores: int | None) -> None:
        self.folder, self.batch, self.cores = folder, batch, cores
        self.begin = time.monotonic()
        self.finished: set[str] = set()
        self.failed: set[str] = set()

    def look(self) -> Progress:
        """The batch as its records show it now."""
        for request in self.batch.requests:
            if request.run_id not in self.finished and self.folder.record(request).exists():
                self.finished.add(request.run_id)
                if not succeeded(self.folder, request):
                    self.failed.add(request.run_id)
        elapsed, total = time.monotonic() - self.begin, len(self.batch.requests)
        return Progress(len(self.finished), len(self.failed), total, elapsed, self._left(elapsed))

    def _left(self, elapsed: float) -> float:
        cost = self.batch.cost
        total, spent = sum(cost.values()), sum(cost[i] for i in self.finished)
        if self.cores is None:  # how long jobs queue is not known: the rate is all there is
            spent = max(spent, total / len(cost))
            return elapsed * (total - spent) / spent
        by_model = total / self.cores - elapsed
        by_rate = elapsed * (total - spent) / spent if spent > 0 else by_model
        share = spent / total  # trust the measured rate more and more as runs finish
        return max(0.0, share * by_rate + (1 - share) * by_model)


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


def time_limit(cost: dict[str, float], patience: float) -> float:
    """Wall-clock limit [s] of each run of a batch."""
    return patience * max(120.0, 10 * max(cost.values()))


def batch_arguments(table: str, batch: Sequence[Request], jobs: int) -> list[str]:
    """Arguments of yade-batch for a table, both relative to the folder of the runs."""
    setups = {r.setup for r in batch}
    options = {
        "-j": jobs,
        "--job-threads": 1,
        "--nice": 0,
        "--plot-update": 0,
        "--log": "logs/@.log",
    }
    pairs = [str(word) for pair in options.items() for word in pair]
    script = [f"scripts/{setup}.py" for setup in setups if len(setups) == 1]
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
