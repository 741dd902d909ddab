"""One made-up laboratory from its case file to its page, each verb as a user calls it."""

from __future__ import annotations

import contextlib
import io
import json
import re
import traceback
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from calibrator import check
from calibrator.case.case import Case
from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.report import html
from calibrator.runs.database import Database
from calibrator.runs.engines import ENGINES
from calibrator.verbs import VERBS
from tests.campaigns.answers.laboratory import Laboratory, case_text, measure
from tests.campaigns.answers.worlds import MadeUp, draw
from tests.stand_in import StandIn, lacking_nothing

DRAWN = 4  # every so manieth page has its figures, which are most of a trial's time
EDITED = 0.25  # share of the laboratories in which an input is edited between two verbs


@dataclass
class Called:
    """How a verb ended."""

    verb: str
    status: int
    told: str
    said: str


@dataclass
class Trial:
    """A laboratory and what the calibrator made of it.

    calls : of the verbs in their order; broke : the traceback of one that broke; edited : verb
    after which an input was edited, what was edited, and what the next verb did; mixed : whether
    the database, made again after that, holds runs of before; made : runs, an attempt that failed
    and the next one at it counted once.
    """

    seed: int
    made_up: MadeUp
    lab: Laboratory
    case: Case | None
    calls: list[Called] = field(default_factory=list)
    broke: str = ""
    edited: tuple[str, str, Called] | None = None
    mixed: bool = False
    made: int = 0
    summary: dict[str, Any] = field(default_factory=dict)
    page: str = ""

    def call(self, verb: str) -> Called | None:
        """How a verb ended; None where it was not called."""
        return next((c for c in self.calls if c.verb == verb), None)


def trial(seed: int, folder: Path) -> Trial:
    """Carry out the trial of a seed in an empty folder."""
    rng = np.random.default_rng(seed)
    made_up = draw(rng)
    lab = measure(made_up, rng)
    lab.write(folder / "lab.csv")
    (folder / "case.toml").write_text(case_text(made_up, lab, rng))
    place = StandIn(made_up.world())
    edit = str(rng.choice(["calibrate", "verify", "validate"])) if rng.random() < EDITED else ""
    done = Trial(seed, made_up, lab, None)
    with _in_place(place, drawn=seed % DRAWN == 0):
        with contextlib.suppress(CalibratorError):  # the verbs say the same
            done.case = read_case(folder / "case.toml")
        for verb in VERBS:
            called = _called(done, verb, folder)
            if called is None or (called.status == 2 and verb != "check"):
                break
            done.calls.append(called)
            done.made = len({r.run_id for r in place.made})
            if verb == edit:
                done.edited = _edited(done, verb, folder, rng)
                break
    results = folder / "results" / "made_up"
    if (results / "summary.json").exists():
        done.summary = json.loads((results / "summary.json").read_text(), parse_constant=_refuse)
    if (results / "report.html").exists():
        done.page = (results / "report.html").read_text()
    return done


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} in summary.json")


@contextlib.contextmanager
def _in_place(place: StandIn, drawn: bool) -> Any:
    """Put a stand-in in place of the local engine, and no figures on most pages."""
    engine, figure, examine = ENGINES["local"], html.Album.figure, check.examine
    ENGINES["local"] = lambda case: place
    check.examine = lacking_nothing
    if not drawn:
        html.Album.figure = lambda *given: ""  # type: ignore[method-assign]
    try:
        yield
    finally:
        ENGINES["local"], check.examine = engine, examine
        html.Album.figure = figure  # type: ignore[method-assign]


def _called(done: Trial, verb: str, folder: Path) -> Called | None:
    """Call a verb; None, and a note, where it broke. A refusal is noted as well."""
    told, said = io.StringIO(), io.StringIO()
    arguments = [verb, str(folder / "case.toml"), "--results", str(folder / "results")]
    try:
        with contextlib.redirect_stdout(told), contextlib.redirect_stderr(said):
            status = main(arguments)
    except Exception:
        done.broke = f"{verb}: {traceback.format_exc()}"
        return None
    # the results are kept with the project, and name no folder of a machine
    own = [stream.getvalue().replace(f"{folder}/", "") for stream in (told, said)]
    called = Called(verb, status, *own)
    if status == 2 and verb != "check":
        done.calls.append(called)
    return called


def _edited(
    done: Trial, verb: str, folder: Path, rng: np.random.Generator
) -> tuple[str, str, Called] | None:
    """Edit an input that the answer rests on, then ask for the page of the answer of before."""
    case, lab = folder / "case.toml", folder / "lab.csv"
    what = str(rng.choice(["target", "tolerance", "bound", "geometry", "fixed"]))
    if what == "target":
        target = done.lab.targets[0]
        lab.write_text(lab.read_text().replace(f",{target.value!r},", f",{target.value * 1.07!r},"))
    text = case.read_text()
    if what == "tolerance":
        text = re.sub(r"tolerance = .*", "tolerance = 0.02", text)
    elif what == "bound":
        parameter = done.made_up.parameters[0]
        text = text.replace(f"high = {parameter.high!r}", f"high = {parameter.high * 0.99!r}", 1)
    setup, name, value = "", "poisson_ratio", 0.21
    if what == "geometry":
        setup = done.lab.targets[0].setup
        name, value = "box_length" if setup == "ledge" else "cylinder_diameter", 0.034
        text += f"[setups.{setup}]\n{name} = {value}\n"
    elif what == "fixed":
        text += f"[fixed]\n{name} = {value}\n"
    case.write_text(text)
    called = _called(done, "report", folder)
    if what in ("geometry", "fixed"):
        done.mixed = _mixed(done, folder, setup, name, value)
    return None if called is None else (verb, what, called)


def _mixed(done: Trial, folder: Path, setup: str, name: str, value: float) -> bool:
    """Whether the database, made again, has a run of this set-up (or any) without the new value.

    It is also the same as in an empty folder, but for an adaptive design, which rightly goes on
    from its runs on the set-ups that stay as they were.
    """
    again, empty = _database(folder, "results"), _database(folder, "empty")
    own = [r.request for r in again.records.values() if r.request.setup == setup or not setup]
    old = any(request.parameters[name] != value for request in own)
    adaptive = done.case is not None and done.case.plan.design == "adaptive"
    return old or not (adaptive or again.records == empty.records)


def _database(folder: Path, results: str) -> Database:
    """The database that `run` and `collect` make in a folder."""
    for verb in ("run", "collect"):
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            main([verb, str(folder / "case.toml"), "--results", str(folder / results)])
    path = folder / results / "made_up" / "database.csv"
    return Database.read(path) if path.exists() else Database()
