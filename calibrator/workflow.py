"""The verbs in workflow order. Each takes a Workspace, does one step, and leaves a machine-readable summary."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibrator import cluster
from calibrator.adaptive import Proposal, propose
from calibrator.adaptive import Settings as AdaptiveSettings
from calibrator.case import Case, Diagnosis, Replicates
from calibrator.coordinates import fit_responses
from calibrator.cost import core_seconds, particles, steps
from calibrator.database import Database, response_table
from calibrator.errors import CalibratorError
from calibrator.files import own_folder, parse_json, read_text, write_text
from calibrator.identifiability import identify
from calibrator.interpolation import Interpolant
from calibrator.nsga2 import SearchResult, Settings, generational_distance, search
from calibrator.objectives import OBJECTIVES, evaluation, rayleigh_time, time_step_warning
from calibrator.plan import PROPOSED_SEED, belongs, design_points, make_request, plan_requests, replicate_requests, substitutes
from calibrator.problem import Problem, known
from calibrator.quantities import SCHEMA, SETUPS
from calibrator.records import Record
from calibrator.runner import Progress, RunFolder, gather, run, yade_batch_command
from calibrator.selection import Reachability, compromise, spread, unreachable
from calibrator.sensitivity import sensitivity
from calibrator.table import Request, write_table
from calibrator.verification import Check, check, error_o1

Report = Callable[[Progress], None]

ACCEPTED = 1000  # parameter sets of the accepted region that the summary keeps, for the picture of the ridge
PARTS = 8  # of the database: each is left out once, for the intervals of the sensitivities


def silent(progress: Progress) -> None:
    """Report nothing."""


@dataclass(frozen=True)
class Workspace:
    """A case and the folder of its results. `fresh` ignores the shipped database, so that every run is done anew."""

    case: Case
    path: Path
    fresh: bool = False
    engine: str = "local"

    @property
    def runs(self) -> RunFolder:
        """The folder of the runs."""
        return RunFolder(self.path)

    def shipped(self) -> Database:
        """The database that may serve as a start; empty where none is named, or where fresh runs were asked for."""
        path = self.case.shipped
        return Database() if path is None or self.fresh else Database.read(path)

    def finished(self, requests: Sequence[Request]) -> list[Record]:
        """Finished runs of these requests: done here, or of the same content in the shipped database."""
        here = {r.run_id: r for r in gather(self.runs, requests)}
        there = self.shipped().records
        return [here.get(r.run_id) or there[r.run_id] for r in requests if r.run_id in here or r.run_id in there]

    def summary(self) -> dict[str, Any]:
        """What the verbs have written so far, by verb. It bears a seal, so that whatever reads it can trust its shape."""
        try:
            summary = parse_json(read_text(self.path / "summary.json", links=False))
            if not isinstance(summary, dict) or summary.pop("seal", None) != _seal(summary):
                raise ValueError("it was edited, or written by another version")
            return summary
        except FileNotFoundError:
            return {"case": self.case.name, "schema": SCHEMA}
        except (OSError, ValueError, RecursionError) as error:
            raise CalibratorError(f"{self.path}/summary.json is damaged ({error}): delete it and run the verbs again") from None

    def note(self, verb: str, outcome: dict[str, Any]) -> dict[str, Any]:
        """Write the outcome of a verb into summary.json, atomically; returns it."""
        summary = {**self.summary(), verb: outcome}
        sealed = {**summary, "seal": _seal(summary)}
        write_text(self.folder() / "summary.json", json.dumps(sealed, indent=1, allow_nan=False) + "\n")
        return outcome

    def folder(self, *names: str) -> Path:
        """A folder of the results, made where it is missing. Raises CalibratorError where it is a link to somewhere else."""
        folder = own_folder(self.path)
        for name in names:
            folder = own_folder(folder / name)
        return folder

    def outcome(self, verb: str) -> dict[str, Any]:
        """The outcome of an earlier verb. Raises CalibratorError naming the command to run first."""
        summary = self.summary()
        if verb not in summary:
            raise CalibratorError(f"{verb} has not been done yet: run `calibrator {verb} {self.case.path}` first")
        if verb == "calibrate" and not _fits(self.case, summary[verb]):
            raise CalibratorError(f"the case has changed since calibrate: run `calibrator calibrate {self.case.path}` again")
        return summary[verb]


def _seal(summary: dict[str, Any]) -> str:
    """Hash over a summary, the same before it is written and after it is read."""
    return hashlib.sha256(json.dumps(summary, sort_keys=True, allow_nan=False).encode()).hexdigest()[:16]


def _fits(case: Case, calibration: dict[str, Any]) -> bool:
    """Whether a calibration is one of these parameters, within their bounds, and of these targets."""
    keys = {t.key for t in case.problem.targets}
    for found in calibration["candidates"].values():
        if found["parameters"].keys() != set(case.problem.names) or found["predicted"].keys() != keys:
            return False
        if not all(p.low <= found["parameters"][p.name] <= p.high for p in case.problem.parameters):
            return False
    return True


def check_case(space: Workspace) -> dict[str, Any]:
    """Everything that can be wrong before a run is made: time steps, narrow necks, a missing YADE."""
    case, warnings = space.case, []
    for name in case.search.objectives:
        known(name, OBJECTIVES, "objective")
    requests = plan_requests(case)
    for setup in SETUPS:
        probe = next((r for r in requests if r.setup == setup), None)
        if probe is not None:
            warnings += _geometry_warnings(probe)
    columns = case.problem.columns(design_points(case))
    fraction, fixed_step = float(np.max(columns["rayleigh_fraction"])), float(np.max(columns["time_step"]))
    shortest = float(np.min(rayleigh_time(columns)))
    step = fixed_step or fraction * shortest
    warnings += [w for w in [time_step_warning(step * (1 - 1e-9), columns)] if w]
    if step > 0.2 * shortest * (1 + 1e-9) and np.min(columns["restitution"]) < 0.6:
        warnings.append(
            f"impacts with a restitution below 0.6 lose too much speed at a time step of {step / shortest:.0%} of the Rayleigh "
            "time: set rayleigh_fraction = 0.2 (or a smaller time_step) under [fixed]"
        )
    yade_batch_command()
    return space.note("check", {"runs": len(requests), "targets": [t.key for t in case.problem.targets], "warnings": warnings})


def _geometry_warnings(request: Request) -> list[str]:
    p = request.parameters
    if request.setup != "hourglass":
        return []
    ratio = float(p["neck_diameter"]) / (2 * float(p["particle_radius"]))
    return [f"the neck is {ratio:.1f} grain diameters wide: grains clog often below 6; widen it or expect clogged runs"] * (
        ratio < 6
    )


def plan(space: Workspace) -> dict[str, Any]:
    """Write the native yade-batch tables of the whole plan, and forecast particles, steps and core-hours."""
    requests = plan_requests(space.case)
    done = space.finished(requests)
    missing = _without(requests, done)
    per_setup = {}
    for setup in space.case.problem.calibration_setups:
        own = [r for r in requests if r.setup == setup]
        write_table(space.folder("plan") / f"{setup}.table", own)
        seconds = core_seconds(own, done)
        per_setup[setup] = {
            "runs": len(own),
            "particles": [min(map(particles, own)), max(map(particles, own))],
            "steps": [min(map(steps, own)), max(map(steps, own))],
            "core_seconds_per_run": [float(seconds.min()), float(seconds.max())],
            "core_hours": float(seconds.sum() / 3600),
        }
    return space.note(
        "plan",
        {
            "runs": len(requests),
            "finished": len(done),
            "core_hours": sum(s["core_hours"] for s in per_setup.values()),
            "core_hours_left": float(core_seconds(missing, done).sum() / 3600) if missing else 0.0,
            "setups": per_setup,
        },
    )


def _without(requests: Sequence[Request], records: Sequence[Record]) -> list[Request]:
    finished = {r.run_id for r in records}
    return [r for r in requests if r.run_id not in finished]


def run_plan(space: Workspace, report: Report = silent) -> dict[str, Any]:
    """Carry out the plan, with one substitute for each clogged run. Resumes; never repeats a finished run."""
    if space.case.plan.design == "adaptive":
        return _run_adaptively(space, report)
    requests = plan_requests(space.case)
    _within_budget(space, requests)
    records = carry_out(space, requests, report)
    records = records + carry_out(space, substitutes(records), report)
    return space.note("run", {"runs": len(records), "from_shipped_database": _shipped_runs(space), **_counts(records)})


def _run_adaptively(space: Workspace, report: Report) -> dict[str, Any]:
    """Start with the plan's first sets, unless the database has as many, then run what `adaptive.propose` asks for."""
    case, settings = space.case, _adaptive_settings(space.case)
    first = plan_requests(case)
    if len(_parameter_sets(case, database_records(space))[0]) < len(first):
        carry_out(space, first, report)
    carry_out(space, _proposed(space), report)  # what an interruption left undone
    while True:
        records = database_records(space)
        proposal = propose(
            case.problem, *_parameter_sets(case, records), settings, case.interpolation.similarity, _failed_sets(case, records)
        )
        if proposal.stops:
            break
        seed = case.plan.seed + PROPOSED_SEED + len(records)
        setups = case.problem.calibration_setups
        requests = [make_request(case, s, point, seed + i) for i, point in enumerate(proposal.points) for s in setups]
        _note_proposal(space, proposal, requests)
        carry_out(space, requests, report)
    recommended = dict(zip(case.problem.names, map(float, proposal.recommended), strict=True))
    outcome = {"ended": proposal.kind, "sentence": proposal.sentence, "recommended": recommended}
    return space.note("run", {"runs": len(records), "from_shipped_database": _shipped_runs(space), **outcome, **_counts(records)})


def _shipped_runs(space: Workspace) -> int:
    """How many of the plan's runs the shipped database has."""
    shipped = space.shipped()
    if space.case.plan.design == "adaptive":
        return sum(belongs(space.case, r.request) for r in shipped.records.values())
    return len(shipped.find(plan_requests(space.case)))


def _adaptive_settings(case: Case) -> AdaptiveSettings:
    return AdaptiveSettings(replicates=case.plan.replicates, budget=case.plan.most_runs)


def _parameter_sets(case: Case, records: Sequence[Record]) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, d) and responses of the targets (n, t), a row per set and seed with all its set-ups, in order of the seeds."""
    rows: dict[tuple[int, tuple[float, ...]], np.ndarray] = {}
    for record in records:
        point, values = response_table(case.problem, [record], [t.key for t in case.problem.targets])
        if len(point):
            row = rows.setdefault((int(record.request.parameters["seed"]), tuple(point[0])), np.full(values.shape[1], np.nan))
            row[~np.isnan(values[0])] = values[0][~np.isnan(values[0])]
    ordered = sorted(rows)
    return np.array([point for _, point in ordered]).reshape(-1, len(case.problem.names)), np.array([rows[k] for k in ordered])


def _failed_sets(case: Case, records: Sequence[Record]) -> np.ndarray:
    """Sets (f, d) with a run that has nothing to say; clogged ones count, as a neck that clogs once will do so again."""
    sets = [[r.request.value(n) for n in case.problem.names] for r in records if r.status != "ok"]
    return np.array(sets, float).reshape(-1, len(case.problem.names))


def _proposed(space: Workspace) -> list[Request]:
    """Every request that the adaptive design has made so far, from its log."""
    return [request for line in _proposal_lines(space) for request in _requests_in(space, line)]


def _proposal_lines(space: Workspace) -> list[str]:
    try:
        return read_text(space.path / "proposals.jsonl", links=False).split("\n")[:-1]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise CalibratorError(f"cannot read {space.path}/proposals.jsonl ({error}): delete it, finished runs are kept") from None


def _requests_in(space: Workspace, line: str) -> list[Request]:
    """The requests of one proposal; CalibratorError where it is none."""
    try:
        made = parse_json(line)["requests"]
        if not all(isinstance(r, dict) and r.keys() == {"setup", "parameters"} for r in made):
            raise ValueError("a request is not a set-up with parameters")
        return [Request.of(r["setup"], **r["parameters"]) for r in made]
    except (CalibratorError, ValueError, KeyError, TypeError) as error:
        raise CalibratorError(f"{space.path}/proposals.jsonl is damaged ({error}): delete it, finished runs are kept") from None


def _note_proposal(space: Workspace, proposal: Proposal, requests: Sequence[Request]) -> None:
    """Log a proposal before its runs start: a resumed design goes on from it, and the log says why each run was made."""
    made = [{"setup": r.setup, "parameters": r.parameters} for r in requests]
    line = {"kind": proposal.kind, "chance": proposal.chance, "sentence": proposal.sentence, "requests": made}
    lines = [*_proposal_lines(space), json.dumps(line)]
    write_text(space.folder() / "proposals.jsonl", "".join(f"{one}\n" for one in lines))


def _within_budget(space: Workspace, requests: Sequence[Request]) -> None:
    done = space.finished(requests)
    missing = _without(requests, done)
    hours = float(core_seconds(missing, done).sum() / 3600) if missing else 0.0
    if hours > space.case.run.budget_core_hours:
        raise CalibratorError(
            f"{len(missing)} runs would take {hours:.1f} core-hours, more than run.budget_core_hours = "
            f"{space.case.run.budget_core_hours:g}: raise that budget or make the plan smaller"
        )


def carry_out(space: Workspace, requests: Sequence[Request], report: Report) -> list[Record]:
    """Run what neither this folder nor the shipped database has; returns all finished records of the requests."""
    there = space.shipped().records
    missing = [r for r in requests if r.run_id not in there]
    if missing and space.engine == "slurm":
        cluster.run(space.runs, missing, space.case.cluster, space.case.run.attempts, report)
    elif missing:
        run(space.runs, missing, space.case.run.jobs, space.case.run.attempts, report)
    return space.finished(requests)


def _counts(records: Sequence[Record]) -> dict[str, Any]:
    kinds = sorted({r.status for r in records})
    counts = {kind: sum(r.status == kind for r in records) for kind in kinds}
    failed = {r.run_id: f"{r.status}: {r.error}" for r in records if r.status not in ("ok", "clogged")}
    return {
        "statuses": counts,
        "failed": failed,
        "yade": sorted({r.provenance["yade"] for r in records if "yade" in r.provenance}),
    }


def database_records(space: Workspace) -> list[Record]:
    """The finished runs of the plan and their substitutes; with an adaptive design all that belong to the case."""
    records = space.finished(plan_requests(space.case))
    if space.case.plan.design == "adaptive":
        shipped = [r for r in space.shipped().records.values() if belongs(space.case, r.request)]
        both = [*records, *space.finished(_proposed(space)), *shipped]
        return list({r.run_id: r for r in reversed(both)}.values())
    return records + space.finished(substitutes(records))


def collect(space: Workspace) -> dict[str, Any]:
    """Gather the finished runs of the plan into database.csv, and their timings into timings.csv."""
    records = database_records(space)
    if not records:
        raise CalibratorError(f"no finished run in {space.path}: run `calibrator run {space.case.path}` first")
    Database(records).write(space.folder() / "database.csv", made_by(space, "run"))
    _write_timings(space.folder() / "timings.csv", records)
    missing = len(_without(plan_requests(space.case), records))
    return space.note("collect", {"runs": len(records), "missing": missing, **_counts(records)})


def _write_timings(path: Path, records: Sequence[Record]) -> None:
    """Timings live apart from the database: they differ from one execution to the next, the database does not."""
    columns = ("filling_cpu", "release_cpu")
    lines = [",".join(["run_id", "setup", *columns, "wall_time", "host"])]
    for r in sorted((r for r in records if r.diagnostics.get("filling_cpu")), key=lambda r: r.run_id):
        times = [f"{r.diagnostics.get(c, 0.0):.2f}" for c in columns] + [f"{r.provenance.get('wall_time', 0.0):.2f}"]
        lines.append(",".join([r.run_id, r.request.setup, *times, str(r.provenance.get("host", "")).replace(",", " ")]))
    write_text(path, "\n".join(lines) + "\n")


def fit(case: Case, records: Sequence[Record]) -> Interpolant:
    """Interpolate the raw responses that the targets need."""
    keys = [t.key for t in case.problem.targets]
    points, values = response_table(case.problem, records, keys)
    if len(points) == 0:
        raise CalibratorError("the database has no good run: look at the failures that `calibrator collect` lists")
    return fit_responses(case.problem, points, values, keys, case.interpolation.method, case.interpolation.similarity)


def search_fronts(case: Case, interpolant: Interpolant) -> list[SearchResult]:
    """The search and its repeats with other seeds."""
    evaluate = evaluation(case.problem, interpolant, case.search.objectives)
    s = case.search
    return [
        search(
            case.problem,
            evaluate,
            Settings(s.population, s.generations, s.crossover, s.mutation, s.seed + i, (0, 1, 2, 3, 20, s.generations)),
            s.objectives,
        )
        for i in range(s.repeats)
    ]


def calibrate(space: Workspace) -> dict[str, Any]:
    """Interpolate, search the Pareto front, choose the spread individuals and the compromise, say what the data pins down."""
    case, problem = space.case, space.case.problem
    records = database_records(space)
    interpolant = fit(case, records)
    fronts = search_fronts(case, interpolant)
    front = fronts[0]
    mean, error = interpolant.predict_with_error(front.points)
    keys = interpolant.responses
    noise = dict(zip(keys, map(float, interpolant.noise), strict=True))
    by_key = [dict(zip(keys, columns.T, strict=True)) for columns in (mean, error)]
    chosen, reason = compromise(problem, front.objectives, by_key[0], by_key[1], noise, case.verify.replicates)
    individuals = spread(front.objectives).tolist() if len(front.names) > 1 else []
    points = {f"individual {chr(ord('A') + i)}": front.points[index] for i, index in enumerate(individuals)}
    points["compromise"] = front.points[chosen]
    confirmed = _confirmed_set(space)
    if confirmed is not None:
        points["compromise"], reason = confirmed, "confirmed by the last runs of the adaptive design"
    loo, _ = interpolant.leave_one_out()
    _write_front(space.folder() / "front.csv", case, front, mean)
    return space.note(
        "calibrate",
        {
            "candidates": _candidates(case, interpolant, points),
            "compromise_reason": reason,
            "front_size": len(front.points),
            "generational_distance": [[float(g) for g in generational_distance(f.fronts, f.fronts[-1])] for f in fronts],
            "seed_noise": noise,
            "leave_one_out_rms": _rms(loo - interpolant.values, interpolant.responses),
            "reachability": _reached(unreachable(problem, interpolant)),
            "identifiability": _identified(problem, interpolant, case.truth),
            "sensitivity": _sensitivity(case, records, interpolant),
            **_counts(records),
        },
    )


def _candidates(case: Case, interpolant: Interpolant, points: dict[str, np.ndarray]) -> dict[str, dict[str, Any]]:
    """Parameters, objectives and promised responses of each labelled set (d,)."""
    sets = np.array(list(points.values()))
    objectives = evaluation(case.problem, interpolant, case.search.objectives)(sets)
    mean, error = interpolant.predict_with_error(sets)
    return {
        label: {
            "parameters": dict(zip(case.problem.names, map(float, sets[i]), strict=True)),
            "objectives": dict(zip(case.search.objectives, map(float, objectives[i]), strict=True)),
            "predicted": {
                k: {"mean": float(m), "error": float(e)} for k, m, e in zip(interpolant.responses, mean[i], error[i], strict=True)
            },
        }
        for i, label in enumerate(points)
    }


def _confirmed_set(space: Workspace) -> np.ndarray | None:
    """The set (d,) that an adaptive design has confirmed; None for any other design, and where it ended without one."""
    outcome = space.summary().get("run", {})
    if space.case.plan.design != "adaptive" or outcome.get("ended") != "confirmed":
        return None
    if outcome["recommended"].keys() != set(space.case.problem.names):
        raise CalibratorError(f"the case has changed since run: run `calibrator run {space.case.path}` again")
    return np.array([outcome["recommended"][n] for n in space.case.problem.names])


def _rms(residual: np.ndarray, keys: Sequence[str]) -> dict[str, float]:
    return {k: float(np.sqrt(np.nanmean(residual[:, i] ** 2))) for i, k in enumerate(keys)}


def _reached(reach: Reachability) -> dict[str, Any]:
    return {
        "all": reach.joint.reachable and all(t.reachable for t in reach.targets),
        "sentences": [t.sentence for t in reach.targets] + [reach.joint.sentence],
        "missed": [t.key for t in reach.targets if not t.reachable],
    }


def _identified(problem: Problem, interpolant: Interpolant, truth: dict[str, float]) -> dict[str, Any]:
    """Profile intervals per parameter, with the known truth where the lab is synthetic."""
    found = identify(problem, interpolant)
    profiles = [
        {
            "name": p.name,
            "best": p.best,
            "interval_68": list(p.interval_68),
            "interval_95": list(p.interval_95),
            "pinned": p.pinned,
            "sentence": p.sentence,
            "truth": truth.get(p.name),
            "positions": p.positions.tolist(),
            "chi2": p.chi2.tolist(),
        }
        for p in found.parameters
    ]
    return {
        "chi2": found.chi2,
        "parameters": profiles,
        "correlation": found.correlation.tolist(),
        "accepted": found.accepted[:: max(1, len(found.accepted) // ACCEPTED)].tolist(),
        "assumed": list(found.assumed),
    }


def _sensitivity(case: Case, records: Sequence[Record], interpolant: Interpolant) -> dict[str, Any]:
    """Sobol indices of the targets' responses; on a grid, which must stay whole, without the part for the choice of sets."""
    sets = sorted({tuple(r.request.value(n) for n in case.problem.names) for r in records})
    part = {one: i % PARTS for i, one in enumerate(sets)}
    folds: list[Interpolant] = []
    if case.interpolation.method == "process" and len(sets) >= 3 * (len(case.problem.names) + 2):
        for left_out in range(PARTS):
            kept = [r for r in records if part[tuple(r.request.value(n) for n in case.problem.names)] != left_out]
            folds.append(fit(case, kept))
    found = sensitivity(case.problem, interpolant, folds)
    arrays = {k: getattr(found, k).tolist() for k in ("first", "total", "first_error", "total_error")}
    return {"responses": found.responses, "parameters": found.parameters, **arrays}


def _write_front(path: Path, case: Case, front: SearchResult, mean: np.ndarray) -> None:
    header = [*case.problem.names, *front.names, *(t.key for t in case.problem.targets)]
    table = np.column_stack([front.points, front.objectives, mean])
    write_text(path, "\n".join([",".join(header), *(",".join(map(repr, map(float, row))) for row in table)]) + "\n")


def candidate_points(space: Workspace) -> dict[str, np.ndarray]:
    """{label: parameter set (d,)} of the calibration's candidates, the compromise first."""
    found = space.outcome("calibrate")["candidates"]
    ordered = ["compromise", *(k for k in found if k != "compromise")]
    return {k: np.array([found[k]["parameters"][n] for n in space.case.problem.names]) for k in ordered}


def for_new_seeds(space: Workspace, settings: Replicates | Diagnosis) -> Workspace:
    """The workspace of a verification, validation or diagnosis: it starts from nothing but the runs shipped for that."""
    running = dataclasses.replace(space.case.run, shipped=settings.shipped)
    return dataclasses.replace(space, case=dataclasses.replace(space.case, run=running))


def made_by(space: Workspace, verb: str) -> str:
    return f"case {space.case.name}; calibrator {verb} {space.case.path.name}"


def verification_requests(space: Workspace) -> dict[str, list[Request]]:
    """Fresh seeds on the calibration's own set-ups, per candidate: many for the compromise, a few for the others."""
    case, requests = space.case, {}
    for index, (label, point) in enumerate(candidate_points(space).items()):
        count = case.verify.replicates if label == "compromise" else case.verify.spread_replicates
        fresh = dataclasses.replace(case.verify, replicates=max(count, 1))
        if count:
            requests[label] = [
                r for s in case.problem.calibration_setups for r in replicate_requests(case, s, point, fresh, index)
            ]
    return requests


def verify(space: Workspace, report: Report = silent) -> dict[str, Any]:
    """Run YADE afresh at the candidates, on the set-ups used, and compare with promise and target.

    Never uses the plan's runs; those of `verify.shipped` only, where a case has it.
    """
    space = for_new_seeds(space, space.case.verify)
    calibration, requests = space.outcome("calibrate"), verification_requests(space)
    records = carry_out(space, [r for own in requests.values() for r in own], report)
    Database(records).write(space.folder() / "verification.csv", made_by(space, "verify"))
    by_id = {r.run_id: r for r in records}
    outcome = {}
    for label, own in requests.items():
        predicted = {k: (v["mean"], v["error"]) for k, v in calibration["candidates"][label]["predicted"].items()}
        done = [by_id[r.run_id] for r in own if r.run_id in by_id]
        outcome[label] = _verdict(space, check(space.case.problem.targets, done, predicted, calibration["seed_noise"]), done)
    return space.note("verify", {"passed": outcome["compromise"]["passed"], "candidates": outcome})


def validation_requests(space: Workspace) -> dict[str, list[Request]]:
    """Fresh seeds per candidate on every set-up that only held-out targets know; of the others only where asked for."""
    case, requests = space.case, {}
    setups = [s for s in SETUPS if any(t.setup == s for t in case.problem.held_out)]
    for index, (label, point) in enumerate(candidate_points(space).items()):
        count = case.validate.replicates if label == "compromise" else case.validate.spread_replicates
        fresh = dataclasses.replace(case.validate, replicates=max(count, 1))
        if count:
            requests[label] = [r for s in setups for r in replicate_requests(case, s, point, fresh, index)]
    return requests


def validate(space: Workspace, report: Report = silent) -> dict[str, Any]:
    """Predict the held-out measurements with fresh runs of the compromise; see `verify` for the runs it uses.

    The outcome is the compromise's verdict; those of the other candidates, where asked for, are under "candidates".
    """
    space = for_new_seeds(space, space.case.validate)
    requests = validation_requests(space)
    records = carry_out(space, [r for own in requests.values() for r in own], report)
    Database(records).write(space.folder() / "validation.csv", made_by(space, "validate"))
    by_id = {r.run_id: r for r in records}
    verdicts = {}
    for label, own in requests.items():
        done = [by_id[r.run_id] for r in own if r.run_id in by_id]
        verdicts[label] = _verdict(space, check(space.case.problem.held_out, done), done)
    compromise = verdicts.pop("compromise")
    return space.note("validate", {**compromise, "candidates": verdicts})


def _verdict(space: Workspace, checks: Sequence[Check], records: Sequence[Record]) -> dict[str, Any]:
    rows = [
        {
            "key": c.target.key,
            "target": c.target.value,
            "target_error": c.target.standard_error,
            "predicted": c.predicted,
            "predicted_error": c.predicted_error,
            "simulated": c.simulated,
            "scatter": c.scatter,
            "standard_error": c.standard_error,
            "runs": c.runs,
            "relative_error": c.relative_error,
            "band": c.band,
            "passed": c.passed,
            "promise_kept": c.promise_kept,
        }
        for c in checks
    ]
    return {
        "responses": rows,
        "passed": bool(rows) and all(c.passed for c in checks),
        "o1": error_o1(checks),
        "from_shipped_database": len(space.shipped().find([r.request for r in records])),
        **_counts(records),
    }


def probe_request(space: Workspace, setup: str, label: str = "compromise") -> Request:
    """The first fresh run of a candidate on a set-up: the one whose grains the report draws."""
    point = candidate_points(space)[label]
    seed = space.case.verify.seed if setup in space.case.problem.calibration_setups else space.case.validate.seed
    return make_request(space.case, setup, point, seed)
