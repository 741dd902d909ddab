"""The verbs in workflow order. Each takes a Workspace, does one step, and leaves a machine-readable summary."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.case import Case
from calibrator.coordinates import fit_responses
from calibrator.cost import core_seconds, particles, steps
from calibrator.database import Database, response_table
from calibrator.errors import CalibratorError
from calibrator.experiments import unmeasured
from calibrator.files import write_text
from calibrator.identifiability import identify
from calibrator.interpolation import Interpolant
from calibrator.nsga2 import SearchResult, Settings, generational_distance, search
from calibrator.objectives import OBJECTIVES, evaluation, rayleigh_time, time_step_warning
from calibrator.plan import design_points, make_request, plan_requests, replicate_requests
from calibrator.plan_runs import collect as collect
from calibrator.plan_runs import confirmed_set, database_records
from calibrator.plan_runs import run_plan as run_plan
from calibrator.problem import Problem, known
from calibrator.quantities import SETUPS
from calibrator.records import Record
from calibrator.runner import yade_batch_command
from calibrator.selection import Reachability, compromise, spread, unreachable
from calibrator.sensitivity import sensitivity
from calibrator.table import Request, write_table
from calibrator.verification import Check, check, error_o1
from calibrator.workspace import Report, Workspace, carry_out, counts, for_new_seeds, made_by, silent, work_left

ACCEPTED = 1000  # parameter sets of the accepted region that the summary keeps, for the picture of the ridge
PARTS = 8  # of the database: each is left out once, for the intervals of the sensitivities


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
    warnings += unmeasured(case)
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
    _, hours_left = work_left(space, requests)
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
            "core_hours_left": hours_left,
            "setups": per_setup,
        },
    )


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
    confirmed = confirmed_set(space)
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
            **counts(records),
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
        **counts(records),
    }


def probe_request(space: Workspace, setup: str, label: str = "compromise") -> Request:
    """The first fresh run of a candidate on a set-up: the one whose grains the report draws."""
    point = candidate_points(space)[label]
    seed = space.case.verify.seed if setup in space.case.problem.calibration_setups else space.case.validate.seed
    return make_request(space.case, setup, point, seed)
