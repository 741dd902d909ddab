"""Which run is looked at: one that is named by its id, or a candidate's."""

from __future__ import annotations

import dataclasses
import difflib
import re
from dataclasses import dataclass
from pathlib import Path

from calibrator.case.values import known
from calibrator.errors import CalibratorError, shown
from calibrator.files import parse_json, read_text
from calibrator.plan.requests import replicate_requests
from calibrator.plan.run import with_curves
from calibrator.runs.database import Database
from calibrator.runs.record import Record, read_record
from calibrator.runs.request import Request
from calibrator.runs.workspace import Workspace, for_new_seeds
from calibrator.search.outcome import COMPROMISE, Calibration, current_calibration

FEW = 6
"""Run ids that a message names."""


@dataclass(frozen=True)
class Choice:
    """A run to be looked at.

    candidate : whose it is, empty where the run was named; record : as it was noted, None where it
    has not been made.
    """

    request: Request
    candidate: str
    record: Record | None


def choose(space: Workspace, run: str = "", setup: str = "") -> Choice:
    """The run that a user names.

    Parameters
    ----------
    run : a run id or a beginning of one, or a candidate such as B; the compromise where empty.
    setup : experiment of a candidate's run, such as ledge; the case's first where empty.

    Raises
    ------
    CalibratorError, with what to do, where no run has that id or several begin so; where there is
    no calibration, or it has no such candidate or the case no such experiment.
    """
    if not re.fullmatch(r"[0-9a-f]+", run):
        return _of_candidate(space, run, setup)
    if setup:
        raise CalibratorError(f"run {run} has a set-up of its own: leave --setup out")
    record = _named(space, run)
    return Choice(record.request, "", record)


def _of_candidate(space: Workspace, candidate: str, setup: str) -> Choice:
    """A candidate's first fresh run that ended well, else the first that would be made."""
    space = with_curves(space)
    found = current_calibration(space)
    label = f"individual {candidate}"
    if label not in found.candidates:
        label = known(candidate or COMPROMISE, found.ordered, "run or candidate")
    problem = space.case.problem
    experiments = list(dict.fromkeys([*problem.experiments, *sorted(problem.held_out_experiments)]))
    experiment = known(setup or experiments[0], experiments, "experiment")
    return candidate_run(space, found, label, experiment)


def candidate_run(space: Workspace, found: Calibration, label: str, experiment: str) -> Choice:
    """A candidate's run of an experiment: the first fresh one that ended well.

    The first that `verify` or `validate` would make, where there is none.
    """
    case = space.case
    used = experiment in case.problem.experiments
    fresh = case.verify if used else case.validate
    count = fresh.replicates if label == COMPROMISE else fresh.spread_replicates
    settings = dataclasses.replace(fresh, replicates=max(count, 1))
    point = found.candidates[label].point(case.problem.names)
    index = list(found.ordered).index(label)
    requests = replicate_requests(case, experiment, point, settings, index)
    done = for_new_seeds(space, fresh).finished(requests)
    for record in done:
        if record.status == "ok":
            return Choice(record.request, label, record)
    noted = {r.run_id: r for r in done}
    return Choice(requests[0], label, noted.get(requests[0].run_id))


def _named(space: Workspace, beginning: str) -> Record:
    """The run whose id begins so."""
    runs = _noted(space)
    found = [run_id for run_id in runs if run_id.startswith(beginning)]
    if len(found) == 1:
        return runs[found[0]]
    if found:
        named = ", ".join(sorted(found)[:FEW]) + (", ..." if len(found) > FEW else "")
        raise CalibratorError(
            f"{len(found)} runs begin with {beginning}: {named}: give more of the run id"
        )
    if not runs:
        raise CalibratorError(
            f"unknown run {shown(beginning)}: no run is noted yet, make some by"
            f" `{space.command('run')}`"
        )
    heads = {run_id[: max(len(beginning), 4)]: run_id for run_id in runs}
    near = difflib.get_close_matches(beginning, heads, 3, 0.5)
    hint = f"did you mean {' or '.join(heads[n] for n in near)}?" if near else "none is like it;"
    raise CalibratorError(
        f"unknown run {shown(beginning)}: {hint} {space.path}/database.csv lists runs; give the"
        " beginning of an id there"
    )


def _noted(space: Workspace) -> dict[str, Record]:
    """All runs that are noted here or shipped, by run id."""
    found: dict[str, Record] = {}
    for settings in (space.case.verify, space.case.validate, space.case.diagnosis):
        found.update(for_new_seeds(space, settings).shipped().records)
    found.update(space.shipped().records)
    for name in ("database", "verification", "validation"):
        if (path := space.path / f"{name}.csv").is_file():
            found.update(Database.read(path).records)
    for path in sorted((space.path / "records").glob("*.json")):
        if (record := _by_itself(path)) is not None:
            found[record.run_id] = record
    return found


def _by_itself(path: Path) -> Record | None:
    """A record whose request nobody remembers: that which it echoes; None where it is damaged."""
    try:
        raw = parse_json(read_text(path, 16, links=False))
        return read_record(path, Request.of(raw["setup"], **raw["parameters"]))
    except (OSError, ValueError, KeyError, TypeError, CalibratorError):
        return None
