"""What runs and verbs leave, and somebody may have damaged or forged."""

from __future__ import annotations

import io
import json
import os
import pickle
import types
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.case.vocabulary import RESPONSES, SCHEMA
from calibrator.plan.run import proposed
from calibrator.report.findings import arrays_of
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.record import read_record
from calibrator.runs.request import Request, write_table
from calibrator.search.outcome import current_calibration
from tests.campaigns.bad_input.damage import damaged_bytes, damaged_json
from tests.campaigns.bad_input.rules import Kind, ask, registry, require, safe_table, texts
from tests.campaigns.bad_input.yard import Yard

KINDS: dict[str, Kind] = {}
kind = registry(KINDS)


def good_record(request: Request) -> dict[str, Any]:
    """The record of a run that never took place."""
    return {
        "schema": SCHEMA,
        "setup": request.setup,
        "run_id": request.run_id,
        "parameters": request.parameters,
        "status": "ok",
        "responses": {"bulk_density": 1500.0, "mass_flow_rate": 0.01},
        "error": None,
        "diagnostics": {"particles": 9, "steps": 100, "filling_cpu": 1.0, "stop_reason": "rest"},
        "provenance": {
            "yade": "none",
            "scripts": "none",
            "host": "here",
            "started": 1e9,
            "wall_time": 2.0,
        },
    }


@kind(0.16, lambda yard: damaged_json([good_record(yard.requests[0])], texts(yard)))
def record(yard: Yard, data: bytes) -> None:
    """An accepted record says what its file says, and survives the way into a database and back."""
    request = yard.requests[0]
    path = RunFolder(yard.space.path).record(request)
    path.write_bytes(data)
    found = ask(lambda: read_record(path, request))
    path.unlink()
    if found is None:
        return
    raw = json.loads(data.decode("utf-8-sig"))
    responses = {n: float(v) for n, v in raw["responses"].items()}
    same = (
        raw["parameters"] == request.parameters
        and raw["status"] == found.status
        and responses == found.responses
    )
    require(same, "not what the file says")
    if yard.executed() == 0 and len(found.error) % 4 == 0:
        Database([found]).write(yard.path / "input.csv")
        (twin,) = Database.read(yard.path / "input.csv").records.values()
        require(
            (twin.request, twin.status, twin.responses) == (request, found.status, found.responses),
            "lost in the database",
        )


@kind(0.1, lambda yard: damaged_bytes([(yard.grid / "runs.csv").read_bytes()], texts(yard)))
def database(yard: Yard, data: bytes) -> None:
    """Every row of an accepted database is a run with its own id; requests made of it are data."""
    path = yard.grid / "input.csv"
    path.write_bytes(data)
    found = ask(lambda: Database.read(path))
    if found is None:
        return
    for r in found.records.values():
        require(
            all(np.isfinite(v) and n in RESPONSES for n, v in r.responses.items()),
            "a response is no number",
        )
        require(
            r.run_id.encode() in data and r.status.encode() in data and r.error.isprintable(),
            "not what the file says",
        )
    if found.records:
        write_table(yard.path / "input.table", [r.request for r in found.records.values()])
        safe_table(yard.path / "input.table")


@kind(0.08, lambda yard: damaged_json([yard.summary], texts(yard)))
def summary(yard: Yard, data: bytes) -> None:
    """What the verbs left is believed whole or not at all."""
    path = yard.space.path / "summary.json"
    path.write_bytes(data)
    found = ask(yard.space.summary)
    if found is not None:
        require(
            {**found, "seal": yard.summary["seal"]} == yard.summary,
            "an edited summary was believed",
        )
    calibration = ask(lambda: current_calibration(yard.space))
    require((calibration is None) == (found is None), "a summary was half believed")


def good_failures(yard: Yard) -> dict[str, Any]:
    """A list of failures, one of them among the yard's requests."""
    kinds = {"0" * 16: "crash", "1" * 16: "lost", yard.requests[0].run_id: "timeout"}
    return {run_id: {"kind": k, "message": "it died", "attempts": 2} for run_id, k in kinds.items()}


@kind(0.05, lambda yard: damaged_json([good_failures(yard)], texts(yard)))
def failures(yard: Yard, data: bytes) -> None:
    """An accepted list of failures can be gathered from and written again."""
    (yard.space.path / "failures.json").write_bytes(data)
    found = ask(yard.space.runs.failures)
    if found is not None:
        for r in gather(yard.space.runs, yard.requests):
            require(
                r.status in ("crash", "lost", "timeout") and r.error.isprintable(),
                "a strange failure",
            )
    (yard.space.path / "failures.json").unlink()


def _proposal(yard: Yard) -> dict[str, Any]:
    made = [{"setup": r.setup, "parameters": r.parameters} for r in yard.requests[:2]]
    return {"kind": "explore", "chance": 0.5, "sentence": "a run", "requests": made}


@kind(
    0.07,
    lambda yard: damaged_json([_proposal(yard)], texts(yard)).map(
        lambda data: data.replace(b"\n", b" ") + b"\n"
    ),
)
def proposals(yard: Yard, data: bytes) -> None:
    """Requests from the log of an adaptive design are data or refused."""
    path = yard.space.path / "proposals.jsonl"
    path.write_bytes(data)
    found = ask(lambda: proposed(yard.space))
    path.unlink()
    if found:
        write_table(yard.path / "input.table", found)
        safe_table(yard.path / "input.table")


class Spell:
    """What a pickle can do: run a command when it is read."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, (f"touch {self.mark}/pickle",)


def some_arrays(yard: Yard) -> list[bytes]:
    """Curves as the scripts leave them, a single array, pickled objects, and a bare pickle."""
    grains, line = np.full((4, 3), 0.01, "f4"), np.linspace(0, 1, 5)
    good = {
        "filled": grains,
        "final": grains[:2],
        "time": line,
        "passed_mass": line,
        "profile_x": line,
        "profile_height": line,
    }
    spell = np.array([Spell(yard.marks)], dtype=object)
    found = []
    for given in (good, {**good, "time": line[:2]}, {"a": spell}):
        for save in (np.savez, np.savez_compressed):
            stream = io.BytesIO()
            save(stream, **given)
            found.append(stream.getvalue())
    stream = io.BytesIO()
    np.save(stream, line)
    return [*found, stream.getvalue(), pickle.dumps(Spell(yard.marks))]


@kind(0.05, lambda yard: damaged_bytes(some_arrays(yard), texts(yard)))
def curves(yard: Yard, data: bytes) -> None:
    """Arrays are numbers of the right shape, and nothing is unpickled."""
    path = yard.space.path / "records" / "input.npz"
    path.write_bytes(data)
    findings = types.SimpleNamespace(
        space=types.SimpleNamespace(runs=types.SimpleNamespace(curves=lambda run_id: path))
    )
    found = ask(lambda: arrays_of(findings, types.SimpleNamespace(run_id="input")))
    for name in {"filled", "final"} & set(found or ()):
        require(found[name].shape[1:] == (3,), "not a list of centres")
