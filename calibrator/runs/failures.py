"""What became of a run that left no record: its kind, its reason, how often it was tried."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from calibrator.runs.folder import RETRIED, Failure, RunFolder
from calibrator.runs.record import InvalidRecord, read_record
from calibrator.runs.request import Request

KILLED = (
    "killed from outside (signal 9), as a machine does that runs out of memory: free some, or make"
    " fewer runs at a time (run.jobs)"
)


def note_failures(
    folder: RunFolder,
    batch: Sequence[Request],
    verdicts: Mapping[str, tuple[str, str]] | None = None,
) -> None:
    """Count an attempt for each run that left no good record, with its kind and reason.

    Parameters
    ----------
    verdicts : kind and message by run id, of runs without a record about which more is known than
        their log says.
    """
    failures = folder.failures()
    for request in batch:
        verdict = verdict_on(folder, request, (verdicts or {}).get(request.run_id))
        if verdict is None:
            # that yade-batch died, or YADE went missing, is no failure of runs still to come
            continue
        kind, message = verdict
        if kind in RETRIED:
            attempts = failed_attempts(failures, request) + 1
            failures[request.run_id] = Failure(kind, message, attempts)
        else:
            failures.pop(request.run_id, None)
    folder.write_failures(failures)


def verdict_on(
    folder: RunFolder, request: Request, known: tuple[str, str] | None = None
) -> tuple[str, str] | None:
    """Kind and reason of the end of a run; None where it did not get as far as YADE.

    known : of a run without a record about which more is known than its log says.
    """
    try:
        record = read_record(folder.record(request), request)
        return record.status, record.error
    except (FileNotFoundError, InvalidRecord) as error:
        if known is None and not _started(folder.log(request)):
            return None
        return known or _verdict_from_log(folder.log(request), error)


def has_ended(folder: RunFolder, request: Request) -> bool:
    """Whether a run has left a record, or the exit status of its YADE."""
    if folder.record(request).exists():
        return True
    log_file = folder.log(request)
    return _started(log_file) and exit_code(log_file) is not None


def failed_attempts(failures: Mapping[str, Failure], request: Request) -> int:
    """How often a run has failed, by the list of failures."""
    return failures[request.run_id].attempts if request.run_id in failures else 0


def exit_code(log_file: Path) -> int | None:
    """Exit code of a run, 128 + n where signal n killed it; None where its log ends without one.

    What yade-batch writes is the status of the shell that it has started the run in, or of the run
    itself.
    """
    status = re.search(r"^status  : (\d{1,5}) ", _text(log_file), re.MULTILINE)
    code = os.waitstatus_to_exitcode(int(status.group(1))) if status else None
    return code if code is None or code >= 0 else 128 - code


def _text(log_file: Path) -> str:
    return log_file.read_text("utf-8", errors="replace") if log_file.is_file() else ""


def _started(log_file: Path) -> bool:
    """Whether a run got as far as YADE.

    It has a log then, and that does not say that a program was missing (126, 127).
    """
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
        137: ("lost", KILLED),
        143: ("lost", "ended from outside (signal 15)"),
        152: ("timeout", "its limit of CPU time passed"),
    }
    if code in without_sentence:
        return without_sentence[code]
    lines = [line for line in _text(path).split("=" * 19)[0].splitlines() if line.strip()]
    return "crash", f"exit code {code}: {lines[-1][:200] if lines else 'no output'}"
