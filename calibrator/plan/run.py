"""The runs of a plan, carried out as designed or adaptively, and the database that they make."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calibrator.case.case import Case
from calibrator.errors import CalibratorError
from calibrator.files import parse_json, read_text, write_text
from calibrator.plan.adaptive import Settings as AdaptiveSettings
from calibrator.plan.adaptive import propose
from calibrator.plan.curves import with_components
from calibrator.plan.outcome import Collection, rests_on
from calibrator.plan.proposal import Cheaper, Proposal
from calibrator.plan.requests import (
    belongs,
    cheap_share,
    make_request,
    plan_requests,
    substitutes,
)
from calibrator.plan.seeds import in_experiment, proposed_seed
from calibrator.responses.fit import cheap_runs
from calibrator.responses.success import Success, nothing_good
from calibrator.responses.table import experiment_of, response_table
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.workspace import (
    Report,
    Workspace,
    carry_out,
    counts,
    silent,
    without,
)


def run_plan(space: Workspace, report: Report = silent) -> Collection:
    """Carry out the plan, with one substitute for each clogged run.

    Resumes; never repeats a finished run. Raises CalibratorError where a batch of them would exceed
    run.budget_core_hours.
    """
    if space.case.plan.design == "adaptive":
        return _run_adaptively(space, report)
    requests = plan_requests(space.case)
    records = carry_out(space, requests, report)
    carry_out(space, substitutes(records), report)
    return space.note("run", _judged(space, all_records(space)))


def _run_adaptively(space: Workspace, report: Report) -> Collection:
    """Start with the plan's first sets, unless the database has as many, then run proposals."""
    plain, settings = space, _adaptive_settings(space.case)
    first = plan_requests(space.case)
    if len(_parameter_sets(space.case, database_records(space))[0]) < len(first):
        carry_out(space, first, report)
    carry_out(space, proposed(space), report)  # what an interruption left undone
    while True:
        if (found := _judged(plain, all_records(plain))).ended:
            return space.note("run", found)
        space = with_curves(plain)
        case, records = space.case, database_records(space)
        proposal = propose(
            case.problem,
            *_parameter_sets(case, records),
            settings,
            case.interpolation.similarity,
            Success.of(case.problem, records),
            _left(space, settings),
            _cheaper(space),
        )
        if proposal.stops:
            break
        own = case.cheap if proposal.cheap and case.cheap else case
        requests = _proposed_requests(own, proposal, len(all_records(space)))
        note_proposal(space, proposal, requests)
        carry_out(space, requests, report)
    recommended = dict(zip(case.problem.names, map(float, proposal.recommended), strict=True))
    found = dataclasses.replace(
        _collected(space, all_records(space)),
        ended=proposal.kind,
        sentence=proposal.sentence,
        recommended=recommended,
    )
    return space.note("run", found)


def _proposed_requests(case: Case, proposal: Proposal, made: int) -> list[Request]:
    """The runs of a proposal in every experiment, where so many have been made."""
    return [
        make_request(case, e, point, in_experiment(case, e, proposed_seed(case, made + i)))
        for i, point in enumerate(proposal.points)
        for e in case.problem.experiments
    ]


def _judged(space: Workspace, records: Sequence[Record]) -> Collection:
    """The finished runs, and the end of it where no run of an experiment was good."""
    found = _collected(space, records)
    if not (failure := nothing_good(space.case.problem, _in_full(space.case, records))):
        return found
    return dataclasses.replace(found, ended="failed", sentence=failure)


def _collected(space: Workspace, records: Sequence[Record]) -> Collection:
    """The database's finished runs as an outcome."""
    return Collection(
        runs=len(records),
        from_shipped_database=_shipped_runs(space, records),
        missing=len(without(plan_requests(space.case), records)),
        fingerprint=rests_on(space.case, records),
        **counts(records),
    )


def _shipped_runs(space: Workspace, records: Sequence[Record]) -> int:
    """How many of these runs the shipped database has, substitutes of clogged ones included."""
    shipped = space.shipped()
    if space.case.plan.design == "adaptive":
        return sum(_is_own(space.case, r.request) for r in shipped.records.values())
    return sum(r.run_id in shipped.records for r in records)


def _adaptive_settings(case: Case) -> AdaptiveSettings:
    """What the case says of an adaptive design."""
    return AdaptiveSettings(replicates=case.plan.replicates, budget=case.plan.most_runs)


def _parameter_sets(case: Case, records: Sequence[Record]) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, d) and the targets' responses (n, t) of the runs, in order of the seeds.

    A row holds a set and a seed, with all its experiments.
    """
    keys = [t.key for t in case.problem.targets]
    rows: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
    for record in records:
        points, values = response_table(case.problem, [record], keys)
        if len(points):
            moved = in_experiment(case, experiment_of(case.problem, record.request), 0)
            seed = int(record.request.parameters["seed"]) - moved
            _put_together(rows.setdefault(seed, []), points[0], values[0])
    ordered = [
        row for seed in sorted(rows) for row in sorted(rows[seed], key=lambda row: tuple(row[0]))
    ]
    points = np.array([point for point, _ in ordered]).reshape(-1, len(case.problem.names))
    return points, np.array([values for _, values in ordered]).reshape(-1, len(keys))


def _put_together(
    rows: list[tuple[np.ndarray, np.ndarray]], point: np.ndarray, values: np.ndarray
) -> None:
    """Add a run's point (d,) and values (t,) to the row of the same set, or as a new one.

    An experiment in which a parameter does not vary says nothing of it: its run belongs to the set
    whose other parameters are the same.
    """
    for known, measured in rows:
        both = np.isfinite(known) & np.isfinite(point)
        if both.any() and (known[both] == point[both]).all():
            known[np.isnan(known)] = point[np.isnan(known)]
            measured[np.isfinite(values)] = values[np.isfinite(values)]
            return
    rows.append((point.copy(), values.copy()))


def _left(space: Workspace, settings: AdaptiveSettings) -> int:
    """Sets that may still be run once, of all runs and of full ones.

    Those count that ended, however they did, and all asked for.
    """
    case = space.case
    made = {r.run_id: r for r in proposed(space)} | {
        r.run_id: r.request for r in all_records(space)
    }
    left = settings.budget - len(made)
    if case.fidelity is not None:
        full = sum(belongs(case, request) for request in made.values())
        left = min(left, case.fidelity.dear_runs - full)
    return left // len(case.problem.experiments)


def _cheaper(space: Workspace) -> Cheaper | None:
    """The cheap runs and what they cost; None where the case has no [fidelity]."""
    case = space.case
    runs = cheap_runs(case, cheap_records(space))
    return None if runs is None else Cheaper(runs, cheap_share(case))


def proposed(space: Workspace) -> list[Request]:
    """Every request that the adaptive design has made so far, from its log.

    Those of before a change of the case, or of another case of this name, are none of its.
    """
    made = [request for line in _proposal_lines(space) for request in _requests_in(space, line)]
    return [request for request in made if _is_own(space.case, request)]


def _proposal_lines(space: Workspace) -> list[str]:
    """The lines of the log of proposals; none where there is no log."""
    try:
        return read_text(space.path / "proposals.jsonl", links=False).split("\n")[:-1]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise CalibratorError(
            f"cannot read {space.path}/proposals.jsonl ({error}): delete it, finished runs are kept"
        ) from None


def _requests_in(space: Workspace, line: str) -> list[Request]:
    """The requests of one proposal; CalibratorError where it is none."""
    try:
        made = parse_json(line)["requests"]
        if not all(isinstance(r, dict) and r.keys() == {"setup", "parameters"} for r in made):
            raise ValueError("a request is not a set-up with parameters")
        return [Request.of(r["setup"], **r["parameters"]) for r in made]
    except (CalibratorError, ValueError, KeyError, TypeError) as error:
        raise CalibratorError(
            f"{space.path}/proposals.jsonl is damaged ({error}): delete it, finished runs are kept"
        ) from None


def note_proposal(space: Workspace, proposal: Proposal, requests: Sequence[Request]) -> None:
    """Log a proposal before its runs start.

    A resumed design goes on from it, and the log says why each run was made.
    """
    made = [{"setup": r.setup, "parameters": r.parameters} for r in requests]
    line = {
        "kind": proposal.kind,
        "chance": proposal.chance,
        "sentence": proposal.sentence,
        "requests": made,
    }
    lines = [*_proposal_lines(space), json.dumps(line)]
    write_text(space.folder() / "proposals.jsonl", "".join(f"{one}\n" for one in lines))


def all_records(space: Workspace) -> list[Record]:
    """The finished runs of the plan and their substitutes, the cheap ones of [fidelity] too.

    With an adaptive design these are all runs that belong to the case.
    """
    records = space.finished(plan_requests(space.case))
    if space.case.plan.design == "adaptive":
        there = [r.request for r in space.shipped().records.values()]
        shipped = [request for request in there if _is_own(space.case, request)]
        both = [*records, *space.finished(proposed(space)), *space.finished(shipped)]
        return list({r.run_id: r for r in reversed(both)}.values())
    return records + space.finished(substitutes(records))


def database_records(space: Workspace) -> list[Record]:
    """Those of all records whose responses are the case's own: not the cheap ones."""
    return _in_full(space.case, all_records(space))


def cheap_records(space: Workspace) -> list[Record]:
    """Those of all records that are cheap; none where the case has no [fidelity]."""
    cheap = space.case.cheap
    return [] if cheap is None else [r for r in all_records(space) if belongs(cheap, r.request)]


def _in_full(case: Case, records: Sequence[Record]) -> list[Record]:
    """Those of a case's records that are not cheap."""
    return [r for r in records if case.cheap is None or belongs(case, r.request)]


def _is_own(case: Case, request: Request) -> bool:
    """Whether a run is one of this case's, in full or cheap."""
    return belongs(case, request) or (case.cheap is not None and belongs(case.cheap, request))


def with_curves(space: Workspace) -> Workspace:
    """The workspace with its curves to calibrate as targets that the database's runs give.

    See `curves.with_components`; the workspace itself where no target is a curve. Where there are
    cheap runs, their curves give the shapes, as they are the many ones.
    """
    if not any(t.curve for t in space.case.problem.targets):
        return space
    return with_components(space, cheap_records(space) or database_records(space))


def collect(space: Workspace) -> Collection:
    """Gather the finished runs of the plan into database.csv, and their times into timings.csv.

    Raises CalibratorError where no run is finished.
    """
    records = all_records(space)
    if not records:
        raise CalibratorError(
            f"no finished run in {space.path}: run `{space.command('run')}` first"
        )
    space.write_database("database.csv", records, "run")
    _write_timings(space.folder() / "timings.csv", records)
    return space.note("collect", _collected(space, records))


def _write_timings(path: Path, records: Sequence[Record]) -> None:
    """Write the times of the runs made here.

    They live apart from the database: they differ from one execution to the next, it does not.
    """
    columns = ("filling_cpu", "release_cpu")
    lines = [",".join(["run_id", "setup", *columns, "wall_time", "host"])]
    timed = [r for r in records if r.diagnostics.get("filling_cpu")]
    for r in sorted(timed, key=lambda r: r.run_id):
        times = [*(r.diagnostics.get(c, 0.0) for c in columns), r.provenance.get("wall_time", 0.0)]
        host = str(r.provenance.get("host", "")).replace(",", " ")
        lines.append(",".join([r.run_id, r.request.setup, *(f"{t:.2f}" for t in times), host]))
    write_text(path, "\n".join(lines) + "\n")


def confirmed_set(space: Workspace) -> np.ndarray | None:
    """The set (d,) that an adaptive design has confirmed.

    None for any other design, where it has not been run, and where it ended without one. Raises
    CalibratorError where it was confirmed for other targets, bounds or runs than those of now.
    """
    if space.case.plan.design != "adaptive" or space.outcome("run", Collection) is None:
        return None
    now = rests_on(space.case, all_records(space))
    found = space.current("run", Collection, now)
    if found.ended != "confirmed":
        return None
    return np.array([found.recommended[n] for n in space.case.problem.names])
