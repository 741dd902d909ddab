"""A case, the folder of its results, and what every verb does there: runs, notes, counts."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from calibrator.case.case import Case
from calibrator.case.codec import build, plain
from calibrator.case.fingerprint import Fingerprint, changed
from calibrator.case.settings import Diagnosis, Replicates
from calibrator.case.vocabulary import RESPONSES, SCHEMA
from calibrator.errors import CalibratorError, DryRun
from calibrator.files import own_folder, parse_json, read_text, write_text
from calibrator.runs.batch import Progress
from calibrator.runs.cost import core_hours, core_seconds
from calibrator.runs.curves import Curves, curves_of, read_companion, write_companion
from calibrator.runs.database import Database
from calibrator.runs.engine import run
from calibrator.runs.engines import ENGINES
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.record import Record
from calibrator.runs.request import Request

Report = Callable[[Progress], None]
Outcome = TypeVar("Outcome")


Measure = Callable[["Workspace", Sequence[Record]], list[Record]]
"""What adds responses to finished runs that their records do not hold."""


def silent(progress: Progress) -> None:
    """Report nothing."""


def as_they_are(space: Workspace, records: Sequence[Record]) -> list[Record]:
    """Add no response to records."""
    return list(records)


@dataclass(frozen=True)
class Workspace:
    """A case and the folder of its results.

    Attributes
    ----------
    path : folder of the results; fresh : ignore the shipped database, so that every run is done
        anew; engine : "local" or "slurm".
    arguments : options of the command line that other verbs on these results need too, for the
        commands that messages name.
    go_on : make all runs of a plan, also where the first ones fail alike; spent [h] : core-hours of
        each batch that has been carried out since the workspace was made.
    dry_run : raise DryRun where runs would be made.
    measure : adds what is measured on the curves of finished runs (see `plan.curves`).
    """

    case: Case
    path: Path
    fresh: bool = False
    engine: str = "local"
    arguments: tuple[str, ...] = ()
    go_on: bool = False
    spent: list[float] = dataclasses.field(default_factory=list, compare=False, repr=False)
    dry_run: bool = False
    measure: Measure = dataclasses.field(default=as_they_are, compare=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", Path(self.path))

    @property
    def runs(self) -> RunFolder:
        """The folder of the runs."""
        return RunFolder(self.path)

    def shipped(self) -> Database:
        """The database that may serve as a start.

        Empty where none is named, or where fresh runs were asked for.
        """
        path = self.case.shipped
        return Database() if path is None or self.fresh else Database.read(path)

    def finished(self, requests: Sequence[Request]) -> list[Record]:
        """Finished runs of these requests: done here, or shipped with the same content."""
        here = {r.run_id: r for r in gather(self.runs, requests)}
        there = self.shipped().records
        found = [
            here.get(r.run_id) or there[r.run_id]
            for r in requests
            if r.run_id in here or r.run_id in there
        ]
        return self.measure(self, found)

    def curves(self, records: Sequence[Record]) -> dict[str, Curves]:
        """The curves of these runs by run id, of those that left any, here or shipped."""
        here = {r.run_id: own for r in records if (own := curves_of(self.runs, r))}
        path, others = self.case.shipped, [r.run_id for r in records if r.run_id not in here]
        there = {} if path is None or self.fresh or not others else read_companion(path, others)
        return {**there, **here}

    def write_database(self, name: str, records: Sequence[Record], verb: str) -> None:
        """Write runs that a verb made as a CSV of this name, and beside it their curves.

        Those only where the case has a curve as a target.
        """
        path = self.folder() / name
        Database(records).write(path, made_by(self, verb))
        if self.case.has_curves:
            write_companion(path, self.curves(records))

    def summary(self) -> dict[str, Any]:
        """What the verbs have written so far, by verb.

        It bears a seal, so that whatever reads it can trust its shape.
        """
        try:
            summary = parse_json(read_text(self.path / "summary.json", links=False))
            if not isinstance(summary, dict) or summary.pop("seal", None) != _seal(summary):
                raise ValueError("it was edited, or written by another version")
            return summary
        except FileNotFoundError:
            return {"case": self.case.name, "schema": SCHEMA}
        except (OSError, ValueError, RecursionError) as error:
            raise CalibratorError(
                f"{self.path}/summary.json is damaged ({error}): delete it and run the verbs again"
            ) from None

    def note(self, verb: str, outcome: Outcome) -> Outcome:
        """Write the outcome of a verb into summary.json, atomically; returns it."""
        summary = {**self.summary(), verb: plain(outcome)}
        sealed = {**summary, "seal": _seal(summary)}
        text = json.dumps(sealed, indent=1, allow_nan=False)
        write_text(self.folder() / "summary.json", text + "\n")
        return outcome

    def folder(self, *names: str) -> Path:
        """A folder of the results, made where it is missing.

        Raises CalibratorError where it is a link to somewhere else.
        """
        folder = own_folder(self.path)
        for name in names:
            folder = own_folder(folder / name)
        return folder

    def outcome(self, verb: str, cls: type[Outcome]) -> Outcome | None:
        """What a verb noted, whatever it was computed from; None where it has not been called.

        Raises CalibratorError where it is not what this version writes.
        """
        noted = self.summary().get(verb)
        try:
            return None if noted is None else build(cls, noted, verb)
        except CalibratorError as error:
            raise CalibratorError(
                f"{self.path}/summary.json was written by another version ({error}): "
                f"run `{self.command(verb)}` again"
            ) from None

    def current(self, verb: str, cls: type[Outcome], now: Fingerprint) -> Outcome:
        """What a verb noted, if it was computed from what the case and the runs are now.

        Raises CalibratorError, with the command to run, where the verb has not been called or any
        part of what its outcome rests on has changed since.
        """
        outcome = self.outcome(verb, cls)
        if outcome is None:
            raise CalibratorError(f"{verb} has not been done yet: run `{self.command(verb)}` first")
        if parts := changed(outcome.fingerprint, now):  # type: ignore[attr-defined]
            raise CalibratorError(
                f"{' and '.join(parts)} changed since {verb}: run `{self.command(verb)}` again"
            )
        return outcome

    def command(self, verb: str, path: Path | None = None) -> str:
        """The command line that calls a verb on this case, or on the one at a path."""
        return shlex.join(["calibrator", verb, str(path or self.case.path), *self.arguments])


def _seal(summary: dict[str, Any]) -> str:
    """Hash over a summary, the same before it is written and after it is read."""
    return hashlib.sha256(
        json.dumps(summary, sort_keys=True, allow_nan=False).encode()
    ).hexdigest()[:16]


def without(requests: Sequence[Request], records: Sequence[Record]) -> list[Request]:
    """The requests that these records do not answer."""
    finished = {r.run_id for r in records}
    return [r for r in requests if r.run_id not in finished]


def work_left(space: Workspace, requests: Sequence[Request]) -> tuple[list[Request], float]:
    """The requests that are not finished, and the core-hours that they are predicted to take."""
    done = space.finished(requests)
    missing = without(requests, done)
    rate = space.case.run.particle_steps_per_second
    return missing, float(core_seconds(missing, done, rate).sum() / 3600) if missing else 0.0


@dataclass(frozen=True)
class Budget:
    """What one command may spend: the key of the case file, core-hours [h], and a way out."""

    key: str
    hours: float
    remedy: str = "raise that budget, or ask for fewer runs"


def beyond(space: Workspace, requests: Sequence[Request], budget: Budget | None = None) -> str:
    """A sentence where what was spent and these runs together exceed the budget, else "".

    budget : run.budget_core_hours unless another is given.
    """
    budget = budget or Budget("run.budget_core_hours", space.case.run.budget_core_hours)
    missing, hours = work_left(space, requests)
    spent = sum(space.spent)
    if not missing or spent + hours <= budget.hours:
        return ""
    so_far = f" beyond the {spent:.2f} that this command has spent" if spent else ""
    return (
        f"{len(missing)} runs would take {hours:.2f} core-hours{so_far}, more than {budget.key} ="
        f" {budget.hours:g}: {budget.remedy}; finished runs are kept, and the same command goes on"
        " from them"
    )


def carry_out(
    space: Workspace, requests: Sequence[Request], report: Report, budget: Budget | None = None
) -> list[Record]:
    """Run what neither this folder nor the shipped database has.

    Returns all finished records of the requests. Raises CalibratorError, before any run, where they
    are beyond the budget, which is run.budget_core_hours unless another is given; DryRun instead of
    both, or of making runs, where the workspace asks for that.
    """
    words = beyond(space, requests, budget)
    if space.dry_run and (work := work_left(space, requests))[0]:
        raise DryRun(len(work[0]), work[1], space.engine, words)
    if words:
        raise CalibratorError(words)
    there = space.shipped().records
    missing = [r for r in requests if r.run_id not in there]
    if missing:
        engine = ENGINES[space.engine](space.case)
        engine.rate = space.case.run.particle_steps_per_second
        before = {r.run_id for r in gather(space.runs, missing)}
        attempts = space.case.run.attempts
        records = run(engine, space.runs, missing, attempts, report, space.go_on)
        new = [r for r in records if r.run_id not in before]
        space.spent.append(sum(map(core_hours, new)))
    return space.finished(requests)


@dataclass(frozen=True, kw_only=True)
class Counts:
    """How runs ended.

    Attributes
    ----------
    statuses : number of runs by status; failed : status and reason by run id, of runs that neither
        ended well nor clogged; yade : versions of YADE that made them.
    """

    statuses: dict[str, int]
    failed: dict[str, str]
    yade: tuple[str, ...]

    @property
    def total(self) -> int:
        """All runs."""
        return sum(self.statuses.values())

    @property
    def good(self) -> int:
        """Runs with every response."""
        return self.statuses.get("ok", 0)


def counts(records: Sequence[Record]) -> dict[str, Any]:
    """How these runs ended: the fields of `Counts`."""
    kinds = sorted({r.status for r in records})
    return {
        "statuses": {kind: sum(r.status == kind for r in records) for kind in kinds},
        "failed": {
            r.run_id: f"{r.status}: {r.error}" for r in records if r.status not in ("ok", "clogged")
        },
        "yade": tuple(sorted({r.provenance["yade"] for r in records if "yade" in r.provenance})),
    }


def contents(records: Sequence[Record]) -> list[tuple[str, str, dict[str, float]]]:
    """What an outcome takes from records, for its fingerprint: run id, status and responses.

    What is measured on a run's curves is none of its record, and follows from the targets.
    """
    return sorted(
        (r.run_id, r.status, {n: v for n, v in r.responses.items() if n in RESPONSES})
        for r in records
    )


def for_new_seeds(space: Workspace, settings: Replicates | Diagnosis) -> Workspace:
    """The workspace of a verification, validation or diagnosis.

    It starts from nothing but the runs shipped for that.
    """
    running = dataclasses.replace(space.case.run, shipped=settings.shipped)
    return dataclasses.replace(space, case=dataclasses.replace(space.case, run=running))


def made_by(space: Workspace, verb: str) -> str:
    """What a database says of its origin."""
    return f"case {space.case.name}; calibrator {verb} {space.case.path.name}"
