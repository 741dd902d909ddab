"""What every engine shares: which runs are pending, their time limits, and the progress that is
reported.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

from calibrator.runs.failures import failed_attempts
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


def pending_requests(
    folder: RunFolder, requests: Sequence[Request], attempts: int
) -> list[Request]:
    """The requests that are still to be run; the list of failures is read once, as it grows with
    the runs.
    """
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


def clear(folder: RunFolder, batch: Sequence[Request]) -> None:
    """Remove what failed attempts left: such a record would make the wrapper believe that the run
    is done.

    A good record stays: a run that outlived its driver may have written it since the batch was put
    together.
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


def notice(
    folder: RunFolder, requests: Sequence[Request], finished: set[str], failed: set[str]
) -> None:
    """Add the run ids whose record has appeared since the last look to `finished`, and to `failed`
    those that are not ok.
    """
    for request in requests:
        if request.run_id not in finished and folder.record(request).exists():
            finished.add(request.run_id)
            if not succeeded(folder, request):
                failed.add(request.run_id)


def succeeded(folder: RunFolder, request: Request) -> bool:
    try:
        return read_record(folder.record(request), request).status == "ok"
    except (FileNotFoundError, InvalidRecord):
        return False
