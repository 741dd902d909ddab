"""The folder of the runs: its files, its lock, and the records in it."""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import fcntl
import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from calibrator.case.vocabulary import SCRIPTS
from calibrator.errors import CalibratorError, one_line
from calibrator.files import own_folder, parse_json, read_text, write_bytes, write_text
from calibrator.runs.record import InvalidRecord, Record, read_record
from calibrator.runs.request import Request

log = logging.getLogger(__name__)
RETRIED = ("crash", "lost", "timeout")
"""Failures worth another try.

A retry of the same request gives the same bits, so the other kinds would fail again.
"""

FOLDERS = ("records", "logs", "batches", "locks", "checkpoints")
NO_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)
"""What a drive without symbolic links answers."""
ROOM = 2**20
"""Bytes that must fit into each folder: what a run of some ten thousand grains leaves."""


@dataclass(frozen=True)
class Failure:
    """Why a run ended without a good record: its kind, of RETRIED, in words, and how often."""

    kind: str
    message: str
    attempts: int


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

    def checkpoints(self, request: Request) -> list[Path]:
        """The scenes that a run under way, or killed, can go on from: one, where there is any."""
        return sorted((self.path / "checkpoints" / request.run_id).glob("step_*"))

    def failures(self) -> dict[str, Failure]:
        """Why runs ended without a good record, by run id.

        Raises CalibratorError where the list is damaged.
        """
        try:
            return _checked_failures(
                parse_json(read_text(self.path / "failures.json", links=False))
            )
        except FileNotFoundError:
            return {}
        except (OSError, ValueError) as error:
            raise CalibratorError(
                f"{self.path}/failures.json is damaged ({error}): delete it, failed runs are tried"
                " again"
            ) from None

    def write_failures(self, failures: Mapping[str, Failure]) -> None:
        """Replace the list of failures atomically."""
        plain = {run_id: dataclasses.asdict(one) for run_id, one in failures.items()}
        text = json.dumps(plain, indent=1, sort_keys=True)
        write_text(self.path / "failures.json", text + "\n")

    def prepare(self) -> None:
        """Make the folders, and a link to the scripts.

        The link keeps a path with blanks from yade-batch's shell. Where the drive has no links, as
        those of memory sticks and some network shares, there is a copy. Raises CalibratorError
        where something else stands in the way.
        """
        own_folder(self.path)
        for name in FOLDERS:
            own_folder(self.path / name)
        link = self.path / "scripts"
        if link.is_dir() and not link.is_symlink():
            _copy_scripts(link)
        elif link.resolve() != SCRIPTS or not link.exists():
            link.unlink(missing_ok=True)
            try:
                link.symlink_to(SCRIPTS, target_is_directory=True)
            except OSError as error:
                if error.errno not in NO_LINKS:
                    raise
                link.mkdir()
                _copy_scripts(link)

    def check_room(self) -> None:
        """Raise OSError where a run could not leave its files.

        A full or read-only disk must not be blamed on the run.
        """
        for name in FOLDERS:
            write_text(self.path / name / "room", " " * ROOM)
            (self.path / name / "room").unlink()

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Wait for another driver that is at work in this folder, and keep others out.

        The lock dies with its process.
        """
        own_folder(self.path)
        with open(refuse_link(self.path / "driver.lock"), "a") as stream:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                log.warning(
                    "another calibrator is at work in %s: waiting for it to end",
                    one_line(str(self.path)),
                )
                fcntl.flock(stream, fcntl.LOCK_EX)
            except OSError:
                # a network file system without locks: there, two drivers may do a run twice, but
                # lose none
                pass
            yield


def _copy_scripts(folder: Path) -> None:
    """Bring a folder's copy of the scripts up to date.

    Raises CalibratorError where it holds something else.
    """
    own = {path.name: path.read_bytes() for path in SCRIPTS.iterdir() if path.is_file()}
    if any(path.name not in {*own, "__pycache__"} for path in folder.iterdir()):
        raise CalibratorError(
            f"{folder} is a folder, and YADE's scripts go there: remove it, or give another place"
            " with --results"
        )
    for name, raw in own.items():
        path = folder / name
        if path.is_symlink() or not path.exists() or path.read_bytes() != raw:
            write_bytes(path, raw)
        with contextlib.suppress(PermissionError):  # a drive without links may have no modes either
            path.chmod((SCRIPTS / name).stat().st_mode)


def _checked_failures(raw: Any) -> dict[str, Failure]:
    """The list of failures, if it is one; else ValueError."""
    shape = {"kind": str, "message": str, "attempts": int}
    for run_id, entry in raw.items() if isinstance(raw, dict) else [("the file", raw)]:
        if (
            not isinstance(entry, dict)
            or {k: type(v) for k, v in entry.items()} != shape
            or entry["kind"] not in RETRIED
        ):
            raise ValueError(f"{run_id} does not give a kind, a message and attempts")
    return {run_id: Failure(**entry) for run_id, entry in raw.items()}


def gather(folder: RunFolder, requests: Sequence[Request]) -> list[Record]:
    """The finished runs among the requests: valid records, and failures with their reason."""
    failures, records = folder.failures(), []
    for request in requests:
        try:
            records.append(read_record(folder.record(request), request))
        except (FileNotFoundError, InvalidRecord):
            if request.run_id in failures:
                failure = failures[request.run_id]
                records.append(Record(request, failure.kind, error=one_line(failure.message)))
    return records


def refuse_link(path: Path) -> Path:
    """A file that is going to be written in place.

    A link there is removed, lest it leads out of the results folder.
    """
    if path.is_symlink():
        path.unlink()
    return path
