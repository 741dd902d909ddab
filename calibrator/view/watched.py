"""Making a run again with snapshots, by the same machinery in a folder of its own."""

from __future__ import annotations

from pathlib import Path

from calibrator.case.vocabulary import SCRIPTS
from calibrator.errors import CalibratorError
from calibrator.files import own_folder, read_bytes, write_bytes
from calibrator.runs.engine import run
from calibrator.runs.folder import RETRIED, RunFolder
from calibrator.runs.local import Local
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.workspace import Report, Workspace

WATCHED, SNAPSHOTS = "watched", "snapshots"
DIFFERING = 3
"""Responses that a message names."""


def watch(space: Workspace, request: Request, folder: Path, report: Report) -> Record:
    """Make a run again in a folder, on this machine, with snapshots; one that is there is kept.

    Returns its record, the snapshots are in `folder`/snapshots. A call that is killed goes on as
    any other does (runs/engine.py). Raises CalibratorError where YADE is missing or the run leaves
    no record.
    """
    runs = RunFolder(own_folder(folder))
    script = own_folder(folder / WATCHED) / f"{request.setup}.py"
    write_bytes(script, read_bytes(SCRIPTS / "watch" / "watch.py"))
    if not any((folder / SNAPSHOTS).glob("*.npz")):
        for path in (runs.record(request), folder / "failures.json"):
            path.unlink(missing_ok=True)  # else the run would count as done, or as tried enough
    engine = Local(1, space.case.run.yade, WATCHED)
    engine.rate = space.case.run.particle_steps_per_second
    (record,) = run(engine, runs, [request], space.case.run.attempts, report)
    if record.status in RETRIED:
        raise CalibratorError(
            f"run {record.run_id} could not be made again: {record.status}: {record.error}; mend"
            f" that ({runs.log(request)} says more), delete {folder}/failures.json, and run the"
            " same command again"
        )
    return record


def differences(noted: Record, again: Record) -> list[str]:
    """How a run made again departs from the noted one, in words; empty where it is the same."""
    found = [
        f"{name} = {there!r} instead of {here!r}"
        for name in sorted({*noted.responses, *again.responses})
        if (here := noted.responses.get(name)) != (there := again.responses.get(name))
    ]
    if noted.status != again.status:
        found.insert(0, f"{again.status} instead of {noted.status}")
    steps = [r.diagnostics.get("steps") for r in (noted, again)]
    if not found and None not in steps and steps[0] != steps[1]:
        found.append(f"{steps[1]} steps instead of {steps[0]}")
    return found


def same(noted: Record | None, again: Record, anyway: bool) -> bool | None:
    """Whether a run made again is the noted one, bit for bit; None where none can be compared.

    anyway : take another one, too. Raises CalibratorError, with both origins and what to do, where
    it is another one that is not to be taken.
    """
    if noted is None or noted.status in RETRIED:
        return None
    if not (differ := differences(noted, again)):
        return True
    if anyway:
        return False
    origins = [
        f"scripts {r.provenance.get('scripts', 'unknown')}, YADE"
        f" {r.provenance.get('yade', 'unknown')}"
        for r in (noted, again)
    ]
    more = ", ..." * (len(differ) > DIFFERING)
    raise CalibratorError(
        f"run {noted.run_id} is of another version: made again it gives"
        f" {', '.join(differ[:DIFFERING])}{more} (noted: {origins[0]}; now: {origins[1]}): view it"
        " with that version, or the run as it is today with --anyway"
    )
