"""The verbs `verify` and `validate`: fresh runs against promise and measurement."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from calibrator.case.vocabulary import SETUPS
from calibrator.plan.requests import make_request, replicate_requests
from calibrator.runs.database import Database
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.workspace import (
    Report,
    Workspace,
    carry_out,
    counts,
    for_new_seeds,
    made_by,
    silent,
)
from calibrator.verification.comparison import Check, check, error_o1


def candidate_points(space: Workspace) -> dict[str, np.ndarray]:
    """{label: parameter set (d,)} of the calibration's candidates, the compromise first."""
    found = space.outcome("calibrate")["candidates"]
    ordered = ["compromise", *(k for k in found if k != "compromise")]
    return {
        k: np.array([found[k]["parameters"][n] for n in space.case.problem.names]) for k in ordered
    }


def verification_requests(space: Workspace) -> dict[str, list[Request]]:
    """Fresh seeds on the calibration's own set-ups, per candidate: many for the compromise, a few
    for the others.
    """
    case, requests = space.case, {}
    for index, (label, point) in enumerate(candidate_points(space).items()):
        count = case.verify.replicates if label == "compromise" else case.verify.spread_replicates
        fresh = dataclasses.replace(case.verify, replicates=max(count, 1))
        if count:
            requests[label] = [
                r
                for s in case.problem.calibration_setups
                for r in replicate_requests(case, s, point, fresh, index)
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
        predicted = {
            k: (v["mean"], v["error"])
            for k, v in calibration["candidates"][label]["predicted"].items()
        }
        done = [by_id[r.run_id] for r in own if r.run_id in by_id]
        outcome[label] = _verdict(
            space,
            check(space.case.problem.targets, done, predicted, calibration["seed_noise"]),
            done,
        )
    return space.note("verify", {"passed": outcome["compromise"]["passed"], "candidates": outcome})


def validation_requests(space: Workspace) -> dict[str, list[Request]]:
    """Fresh seeds per candidate on every set-up that only held-out targets know; of the others only
    where asked for.
    """
    case, requests = space.case, {}
    setups = [s for s in SETUPS if any(t.setup == s for t in case.problem.held_out)]
    for index, (label, point) in enumerate(candidate_points(space).items()):
        count = (
            case.validate.replicates if label == "compromise" else case.validate.spread_replicates
        )
        fresh = dataclasses.replace(case.validate, replicates=max(count, 1))
        if count:
            requests[label] = [
                r for s in setups for r in replicate_requests(case, s, point, fresh, index)
            ]
    return requests


def validate(space: Workspace, report: Report = silent) -> dict[str, Any]:
    """Predict the held-out measurements with fresh runs of the compromise; see `verify` for the
    runs it uses.

    The outcome is the compromise's verdict; those of the other candidates, where asked for, are
    under "candidates".
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


def _verdict(
    space: Workspace, checks: Sequence[Check], records: Sequence[Record]
) -> dict[str, Any]:
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
    seed = (
        space.case.verify.seed
        if setup in space.case.problem.calibration_setups
        else space.case.validate.seed
    )
    return make_request(space.case, setup, point, seed)
