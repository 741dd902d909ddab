"""A world in place of YADE: runs cost nothing, and the true responses are known.

A world says what a run of a set-up at given parameters with a seed gives, how it ends, and how
much single runs scatter. Records are written as YADE's scripts write them, by the same code, and
everything after that is the calibrator's own.
"""

from __future__ import annotations

import math
import random
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from calibrator.runs import engine
from calibrator.runs.batch import Batch, clear, note_ended
from calibrator.runs.engines import ENGINES
from calibrator.runs.folder import RunFolder
from calibrator.runs.request import Request
from tests import fake_yade

sys.path.insert(0, str(fake_yade.SCRIPTS))
import contract

Noise = float | Mapping[str, float]


def _usual_responses(setup: str, p: dict[str, Any], seed: int) -> dict[str, float]:
    return fake_yade.responses_of(setup, p)


def _no_curves(setup: str, p: dict[str, Any], seed: int) -> dict[str, Any]:
    return {}


def _never_fails(setup: str, p: dict[str, Any], seed: int) -> str:
    return "ok"


@dataclass(frozen=True)
class World:
    """What runs give.

    Attributes
    ----------
    responses_of : (setup, parameters, seed) -> responses without noise; status_of : the same to how
        the run ends; noise : relative scatter of a run, one number or one per response; curves_of :
        the same to the arrays that a run leaves, with what scatter they have.
    """

    responses_of: Callable[[str, dict[str, Any], int], dict[str, float]] = _usual_responses
    status_of: Callable[[str, dict[str, Any], int], str] = _never_fails
    noise: Noise = fake_yade.NOISE
    curves_of: Callable[[str, dict[str, Any], int], dict[str, Any]] = _no_curves

    @classmethod
    def read(cls, text: str) -> World:
        """The world that a Python text defines; fake_yade and math are at hand."""
        names: dict[str, Any] = {"fake_yade": fake_yade, "math": math}
        exec(text, names)
        return cls(
            names.get("responses_of", _usual_responses),
            names.get("status_of", _never_fails),
            names.get("NOISE", fake_yade.NOISE),
        )

    def scatter(self, response: str) -> float:
        """Relative scatter of one run."""
        return self.noise if isinstance(self.noise, float) else self.noise.get(response, 0.0)

    def curves(self, request: Request) -> dict[str, Any]:
        """The arrays that a run leaves."""
        p = contract.checked(request.setup, dict(request.parameters))
        return self.curves_of(request.setup, p, int(request.parameters["seed"]))

    def record(self, request: Request) -> dict[str, Any] | None:
        """The record of a run; None for a run that dies without one."""
        seed = int(request.parameters["seed"])
        p = contract.checked(request.setup, dict(request.parameters))
        status = self.status_of(request.setup, p, seed)
        if status == "crash":
            return None
        draw = random.Random(request.run_id)
        responses = {
            name: value * (1 + self.scatter(name) * draw.gauss(0, 1))
            for name, value in self.responses_of(request.setup, p, seed).items()
        }
        if status == "clogged":
            responses = {n: v for n, v in responses.items() if n == "bulk_density"}
        good = status in ("ok", "clogged")
        return dict(
            schema=contract.CONTRACT["schema"], setup=request.setup, run_id=request.run_id,
            parameters=contract.echoed(p), status=status, responses=responses if good else {},
            error=None if good else f"made up: {status}",
            diagnostics=dict(particles=100, steps=1000, filling_cpu=1.0, release_cpu=1.0),
            provenance=dict(yade="fake", scripts="fake", host="fake", started=0.0, wall_time=2.0),
        )  # fmt: skip


class StandIn(engine.Engine):
    """An engine that makes the runs of a world, a few at each poll; `made` are all it made."""

    pause, advice, early_ends = 0.0, "", 2
    cores = 4

    def __init__(self, world: World) -> None:
        self.world = world
        self.made: list[Request] = []
        self.waiting: list[Request] = []

    def require(self) -> None:
        """Nothing is missing."""

    def submit(self, folder: RunFolder, batch: Batch) -> None:
        """Take all runs."""
        clear(folder, batch.requests)
        self.waiting = list(batch.requests)

    def poll(self, folder: RunFolder, requests: Sequence[Request]) -> bool:
        """Make some of them."""
        now, self.waiting = self.waiting[: self.cores], self.waiting[self.cores :]
        for request in now:
            self.made.append(request)
            record = self.world.record(request)
            if record is None:
                folder.log(request).write_text("made up: crash\n\nstatus  : 256 (x)\n")
            else:
                curves = self.world.curves(request) if record["status"] == "ok" else {}
                contract.write_record(str(folder.path / "records"), request.run_id, record, curves)
        note_ended(folder, now)
        return bool(self.waiting)

    def end(self) -> None:
        """Nothing is left behind."""

    def give_up(self, folder: RunFolder, requests: Sequence[Request]) -> None:
        """Make no further run."""
        self.waiting = []


def lacking_nothing(*asked: Any) -> Any:
    """A machine in place of this one, whose YADE nobody asks for."""
    return SimpleNamespace(warnings=list)


def put_in_place(monkeypatch: Any, world: World) -> StandIn:
    """Let the engine called local make the runs of a world."""
    made = StandIn(world)
    monkeypatch.setitem(ENGINES, "local", lambda case: made)
    monkeypatch.setattr("calibrator.check.examine", lacking_nothing)
    return made


def inputs_of(folder: Path, to: Path) -> World:
    """Copy a small input's case and lab files; returns its world."""
    for path in (*folder.glob("*.toml"), *folder.glob("*.csv")):
        (to / path.name).write_text(path.read_text())
    world = folder / "world.py"
    return World.read(world.read_text()) if world.exists() else World()
