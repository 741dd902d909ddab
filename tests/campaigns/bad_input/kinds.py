"""Bad input on purpose: kinds of files and arguments that tests/campaigns/bad_input/damage.py damages, and what
must hold for each of them.

Used by tests/campaigns/bad_input/test_kinds.py, a few hundred of each kind, and by tests/campaigns/bad_input/campaign.py, 100,000 in all.
Every input must be accepted, and then mean what it says, or be refused with one line. Every kind of
free text carries code that leaves a mark if anything runs it. No YADE is started.
"""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import io
import json
import os
import pickle
import shutil
import signal
import tomllib
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

from calibrator.case.case import Case
from calibrator.case.lab import read_lab, read_nuisances
from calibrator.case.toml import SECTIONS, read_case
from calibrator.case.vocabulary import PARAMETERS, RESPONSES, SCHEMA, SETUPS
from calibrator.cli import main
from calibrator.diagnosis import experiments
from calibrator.errors import CalibratorError
from calibrator.files import parse_json
from calibrator.plan import forecast
from calibrator.plan.design import sobol
from calibrator.plan.requests import plan_requests
from calibrator.plan.run import collect, proposed
from calibrator.report.findings import arrays_of
from calibrator.runs import local, workspace
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.record import InvalidRecord, Record, read_record
from calibrator.runs.request import Request, cell, write_table
from calibrator.search.calibrate import calibrate
from calibrator.verification.verify import verification_requests
from tests.campaigns.bad_input.damage import TOML_VALUES, VALUES, WORDS, damaged_bytes, damaged_json

# after which one input counts as a hang, on a machine that may be busy with simulations
SECONDS = 20.0
SMALL_PLAN = 300  # runs of a plan that is written out

CASE = """name = "toy"
about = "made up"
measured = "lab.csv"
truth_file = "truth.toml"
[parameters.rolling_friction]
low = 0.05
high = 0.45
samples = 2
[parameters.sliding_friction]
low = 0.2
high = 0.7
samples = 2
bits = 6
[parameters.young_modulus]
low = 0.5e6
high = 4e6
samples = 2
scale = "log"
[fixed]
restitution = 0.9
rolling_spring = "epsd2"
[setups.hourglass]
fill_mass = 16e-3
[targets."hourglass.bulk_density"]
tolerance = 0.01
weight = 2
[plan]
design = "sobol"
sets = 6
replicates = 2
seed = 1000
[interpolation]
method = "process"
similarity = false
[search]
objectives = ["error", "time_cost"]
population = 20
generations = 4
crossover = 0.9
repeats = 1
[verify]
replicates = 2
shipped = "runs.csv"
[conditions.wide]
setup = "hourglass"
neck_diameter = 16e-3
[diagnosis]
effects = ["bond_number", "neck_error"]
sets = 6
effect_sets = 5
nuisances = "nuisances.csv"
[run]
jobs = 1
budget_core_hours = 2.5
shipped = "../grid/runs.csv"
"""

LAB = """# a note
setup,response,value,scatter,replicates,unit,role
hourglass,bulk_density,1605.6,5,8,kg/m3,calibrate
hourglass,drained_equivalent_angle_deg,46.8,0.2,8,deg,calibrate
ledge,ledge_equivalent_angle_deg,37.44,,,deg,held_out
"""

WITH_CONDITIONS = """setup,condition,response,value,scatter,replicates,unit,role
hourglass,,bulk_density,1605.6,5,8,kg/m3,calibrate
hourglass,,mass_flow_rate,0.0246,1e-3,8,kg/s,diagnose
hourglass,wide,mass_flow_rate,0.0301,,3,kg/s,held_out
ledge,,ledge_equivalent_angle_deg,37.44,0.5,5,deg,diagnose
"""

NUISANCES = """# errors that observables share
nuisance,observables,error,unit
reading of angles,*_angle*_deg,0.5,deg
filled volume,*.bulk_density,0.5,%
neck,effect:neck_error,0.05e-3,m
"""

TRUTH = "[parameters]\nrolling_friction = 0.25\n"


# The folder in which everything happens


class Yard:
    """A folder with a good case and its results, traps beside it, and a place where code would
    leave its mark.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.cases, self.grid = (
            path,
            path / "project" / "cases",
            path / "project" / "grid",
        )
        self.marks = path / "marks"
        for folder in (self.cases, self.grid, self.marks):
            folder.mkdir(parents=True)
        (self.cases / "lab.csv").write_text(LAB)
        (self.cases / "nuisances.csv").write_text(NUISANCES)
        (self.cases / "truth.toml").write_text(TRUTH)
        (self.cases / "toy.toml").write_text(CASE)
        self.case = read_case(self.cases / "toy.toml")
        self.requests = plan_requests(self.case)
        self.database = made_up_database(self.requests)
        self.database.write(self.grid / "runs.csv")
        shutil.copy(self.grid / "runs.csv", self.cases)
        self._set_traps()
        self.space = workspace.Workspace(self.case, path / "results" / "toy")
        for verb in (forecast.plan, collect, calibrate):
            verb(self.space)
        whole = self.space.outcome("calibrate")  # of which a small part will do
        self.space.note(
            "calibrate", {k: whole[k] for k in ("candidates", "seed_noise", "statuses", "failed")}
        )
        self.summary = parse_json((self.space.path / "summary.json").read_text())
        (self.space.path / "records").mkdir()

    def _set_traps(self) -> None:
        secret = self.path / "secret.csv"
        secret.write_text(LAB)
        os.mkfifo(self.cases / "pipe")
        (self.cases / "loop").symlink_to("loop")
        (self.cases / "away").symlink_to(secret)
        (self.cases / "zero").symlink_to("/dev/zero")
        (self.cases / "folder").mkdir()

    def executed(self) -> int:
        """How many times code from an input has run."""
        return len(list(self.marks.iterdir()))

    def spells(self) -> list[str]:
        """Texts that leave a mark if Python evaluates them or a shell runs them."""
        mark = f"{self.marks}/$$"
        python = f"__import__('os').system('touch {self.marks}/python')"
        return [
            python,
            f"1 if {python} else 1",
            f"$(touch {mark})",
            f"`touch {mark}`",
            f"; touch {mark};",
            f"'; touch {mark} #",
        ]


def made_up_database(requests: list[Request]) -> Database:
    """Runs that never took place, smooth in the parameters."""
    records = []
    for i, r in enumerate(requests):
        p = r.parameters
        density = 1700 - 120 * float(p["sliding_friction"]) + i % 3
        angle = 40 + 20 * float(p["rolling_friction"]) + 0.1 * (i % 2)
        responses = {"bulk_density": density, "drained_equivalent_angle_deg": angle}
        records.append(
            Record(
                r,
                "ok",
                responses,
                "",
                {"particles": 9, "steps": 10},
                {"yade": "none", "scripts": "none"},
            )
        )
    return Database(records)


# What must hold


class Broken(AssertionError):
    """An input that was neither accepted rightly nor refused properly."""


def require(condition: bool, what: str) -> None:
    """Raise Broken unless the condition holds."""
    if not condition:
        raise Broken(what)


def refusal(error: Exception) -> None:
    """A refusal is one printable line of bounded length that ends with what to do."""
    line = str(error)
    require(line.isprintable() and 10 < len(line) < 1100, f"not one line: {line!r}")
    require(
        isinstance(error, InvalidRecord) or ": " in line or "; " in line, f"no remedy: {line!r}"
    )


def ask(call: Callable[[], Any]) -> Any:
    """What the call returns; None where it is refused."""
    try:
        return call()
    except (CalibratorError, InvalidRecord) as error:
        refusal(error)
        return None


def only_data(text: str) -> bool:
    """Whether a table's cell is a number or a quoted word of the vocabulary, for Python as well as
    for its looks.
    """
    choices = {c for q in PARAMETERS.values() for c in q.choices or ()}
    tree = ast.parse(text, mode="eval").body
    inner = (
        tree.operand if isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.USub) else tree
    )
    if not isinstance(inner, ast.Constant) or any(c.isspace() for c in text):
        return False
    return (
        inner.value in choices
        if isinstance(inner.value, str)
        else type(inner.value) in (int, float)
    )


def safe_table(path: Path) -> None:
    """Every cell of a written table is data, and every line complete."""
    header, *lines = path.read_text().splitlines()
    for line in lines:
        run_id, *cells = line.split(" ")
        require(
            len(cells) == len(header.split()) - 1 and run_id.isalnum(), f"a broken line: {line!r}"
        )
        require(
            all(only_data(c) for c in cells if not c.startswith("scripts/")),
            f"code in a table: {line!r}",
        )
        scripts = [c for c in cells if c.startswith("scripts/")]
        require(
            all(s in [f"scripts/{x}.py" for x in SETUPS] for s in scripts),
            f"a strange script: {line!r}",
        )


@dataclass(frozen=True)
class Kind:
    """A kind of input: how it is drawn in a yard, and what is done with it there;

    `share` is its part of all inputs.
    """

    draw: Callable[[Yard], st.SearchStrategy[Any]]
    use: Callable[[Yard, Any], None]
    share: float


KINDS: dict[str, Kind] = {}


def kind(
    share: float, draw: Callable[[Yard], st.SearchStrategy[Any]]
) -> Callable[[Callable[[Yard, Any], None]], Any]:
    """Register what is done with an input under the function's name."""

    def register(use: Callable[[Yard, Any], None]) -> Callable[[Yard, Any], None]:
        KINDS[use.__name__] = Kind(draw, use, share)
        return use

    return register


def _texts(yard: Yard) -> list[str]:
    return [*WORDS, *yard.spells()]


@kind(
    0.16,
    lambda yard: damaged_bytes(
        [CASE.encode()], [*TOML_VALUES, *_texts(yard), *map(json.dumps, yard.spells())]
    ),
)
def case_file(yard: Yard, data: bytes) -> None:
    """A case is read as it stands, or refused; a small plan of it is written as data."""
    path = yard.cases / "input.toml"
    path.write_bytes(data)
    case = ask(lambda: read_case(path))
    if case is None:
        return
    require(
        as_written(case, tomllib.loads(data.decode("utf-8-sig"))),
        "a setting differs from what the file says",
    )
    sets = (
        np.prod([p.samples for p in case.problem.parameters])
        if case.plan.design == "grid"
        else case.plan.sets
    )
    if sets * case.plan.replicates * 3 <= SMALL_PLAN:
        _plan(yard, case)


def as_written(case: Case, tables: dict[str, Any]) -> bool:
    """Whether a case holds what its file says, key by key, and nothing else."""
    for section in SECTIONS:
        settings = dataclasses.asdict(getattr(case, section))
        given = {
            k: tuple(v) if isinstance(v, list) else v for k, v in tables.get(section, {}).items()
        }
        if any(settings[k] != v for k, v in given.items()):
            return False
    bounds = {p.name: (p.low, p.high) for p in case.problem.parameters}
    wanted = {n: (spec["low"], spec["high"]) for n, spec in tables["parameters"].items()}
    fixed, setups = tables.get("fixed", {}), tables.get("setups", {})
    conditions = {n: {"setup": c.setup, **c.values} for n, c in case.conditions.items()}
    texts = case.name == tables["name"] and case.about == tables.get("about", "")
    same = (
        case.problem.fixed == fixed
        and case.problem.setups == setups
        and conditions == tables.get("conditions", {})
    )
    return texts and bounds == wanted and same


def _plan(yard: Yard, case: Case) -> None:
    _written(yard, ask(lambda: plan_requests(case)))
    if (
        case.diagnosis.sets * case.diagnosis.replicates
        + len(case.diagnosis.effects) * case.diagnosis.effect_sets
        <= SMALL_PLAN
    ):
        _written(yard, ask(lambda: _diagnosed(case)))


def _diagnosed(case: Case) -> list[Request]:
    """Every run behind a diagnosis, under each of the case's conditions."""
    variants = [
        dataclasses.replace(o, role="diagnose", condition=c)
        for o in case.observables
        for c in case.conditions
    ]
    own = [o for o in variants if case.conditions[o.condition].setup == o.setup]
    found, points = (
        experiments.experiments(case, [*case.observables, *own]),
        sobol(case.problem, case.diagnosis.sets),
    )
    plain = experiments.plain_requests(case, found, points)
    return [
        r
        for one in (
            *plain,
            *experiments.change_requests(case, found, experiments.library(case), points),
        )
        for r in one
    ]


def _written(yard: Yard, requests: list[Request] | None) -> None:
    if requests:
        write_table(yard.path / "input.table", requests)
        safe_table(yard.path / "input.table")


@kind(0.15, lambda yard: damaged_bytes([LAB.encode(), WITH_CONDITIONS.encode()], _texts(yard)))
def lab_file(yard: Yard, data: bytes) -> None:
    """Every row of an accepted lab file is a target; none is lost, and none made up."""
    path = yard.cases / "input.csv"
    path.write_bytes(data)
    rows = ask(lambda: read_lab(path))
    if rows is not None:
        lines = [
            x for x in data.decode("utf-8-sig").splitlines() if x.strip() and not x.startswith("#")
        ]
        require(len(rows) == len(lines) - 1, "a row was lost")
        for row, line in zip(rows, lines[1:], strict=True):
            require(
                all(x in line for x in (row.role, row.setup, row.response, row.condition)),
                f"{row.key} is not in {line!r}",
            )


@kind(
    0.06,
    lambda yard: damaged_bytes(
        [NUISANCES.encode()], [*_texts(yard), "effect:tilt_deg", "effect:", "*" * 99, "[!", "%"]
    ),
)
def nuisance_table(yard: Yard, data: bytes) -> None:
    """Every row of an accepted table is an error of something that was measured, or of an effect;
    none is lost.
    """
    path = yard.cases / "input.csv"
    path.write_bytes(data)
    rows = read_lab(yard.cases / "lab.csv")
    found = ask(lambda: read_nuisances(path, rows))
    if found is not None:
        lines = [
            x for x in data.decode("utf-8-sig").splitlines() if x.strip() and not x.startswith("#")
        ]
        require(len(found) == len(lines) - 1, "a row was lost")
        for one in found:
            touched = bool(one.effect) or any(one.touches(o) for o in rows)
            require(touched and np.isfinite(one.error) and one.error > 0, f"{one} does nothing")


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


@kind(0.16, lambda yard: damaged_json([good_record(yard.requests[0])], _texts(yard)))
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


@kind(0.1, lambda yard: damaged_bytes([(yard.grid / "runs.csv").read_bytes()], _texts(yard)))
def database(yard: Yard, data: bytes) -> None:
    """Every row of an accepted database is a run whose id belongs to its parameters; requests made
    of it are data.
    """
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


@kind(0.08, lambda yard: damaged_json([yard.summary], _texts(yard)))
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
    requests = ask(lambda: verification_requests(yard.space))
    require((requests is None) == (found is None), "a summary was half believed")


def good_failures(yard: Yard) -> dict[str, Any]:
    """A list of failures, one of them among the yard's requests."""
    kinds = {"0" * 16: "crash", "1" * 16: "lost", yard.requests[0].run_id: "timeout"}
    return {run_id: {"kind": k, "message": "it died", "attempts": 2} for run_id, k in kinds.items()}


@kind(0.05, lambda yard: damaged_json([good_failures(yard)], _texts(yard)))
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
    lambda yard: damaged_json([_proposal(yard)], _texts(yard)).map(
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
    """Curves as the scripts leave them, compressed and not, a single array, pickled objects, and a
    bare pickle.
    """
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


@kind(0.05, lambda yard: damaged_bytes(some_arrays(yard), _texts(yard)))
def curves(yard: Yard, data: bytes) -> None:
    """Arrays are numbers of the right shape, and nothing is unpickled."""
    path = yard.space.path / "records" / "input.npz"
    path.write_bytes(data)
    findings = types.SimpleNamespace(
        space=types.SimpleNamespace(runs=types.SimpleNamespace(curves=lambda run_id: path))
    )
    found = ask(lambda: arrays_of(findings, types.SimpleNamespace(run_id="input")))  # type: ignore[arg-type]
    for name in {"filled", "final"} & set(found or ()):
        require(found[name].shape[1:] == (3,), "not a list of centres")


def _settings(yard: Yard) -> st.SearchStrategy[Any]:
    return st.tuples(
        st.sampled_from(SETUPS),
        st.dictionaries(st.sampled_from([*PARAMETERS, "x", "setup"]), VALUES, max_size=4),
    )


@kind(0.12, _settings)
def request(yard: Yard, given: tuple[str, dict[str, Any]]) -> None:
    """A request is a number or a known word for each parameter, in its range, or is refused."""
    setup, values = given
    made = ask(lambda: Request.of(setup, **values))
    if made is not None:
        for name, value in values.items():
            # an effect that is off is left out
            require(made.value(name) == value, f"{name} became another value")
        require(all(only_data(cell(n, v)) for n, v in made.parameters.items()), "code in a cell")
    for name, value in values.items():
        text = ask(lambda name=name, value=value: cell(name, value)) if name in PARAMETERS else None
        require(text is None or only_data(text), f"code in a cell: {text!r}")


def _arguments(yard: Yard) -> st.SearchStrategy[Any]:
    words = [w for w in [*_texts(yard), *TOML_VALUES] if len(w) < 1000]
    verbs = [
        "check",
        "plan",
        "plan",
        "run",
        "collect",
        "verify",
        "validate",
        "report",
        "preflight",
        "diagnose",
        "calibrat",
    ]
    names = ("input.toml", "input.toml", "toy.toml", "pipe", "loop", "zero", "folder", "lab.csv")
    cases = [*(str(yard.cases / n) for n in names), *words]
    results = [
        str(yard.path / n)
        for n in ("out", "out", "secret.csv", "a b;c'd\"e", "new\nline", "caf\udce9")
    ]
    known = [
        "--fresh",
        "--verify-afresh",
        "--help",
        "--version",
        "--results",
        "-x",
        "--",
        "--yes",
        "--lab",
        "--engine",
        "--site",
    ]
    options = st.sampled_from([*known, *words])
    arguments = st.tuples(
        st.sampled_from([*verbs, *words]),
        st.sampled_from(cases),
        st.sampled_from([*results, *(w for w in words if not _leads_away(w))]),
    )
    contents = damaged_bytes([CASE.encode()], [*TOML_VALUES, *words])
    return st.tuples(arguments, st.lists(options, max_size=2), st.just(None) | contents)


def _leads_away(word: str) -> bool:
    """Whether a results folder of that name would be made outside the yard, at the tester's own
    expense.
    """
    return word.startswith(("/", "~", "..")) or not word


@kind(0.05, _arguments)
def command_line(yard: Yard, given: tuple[tuple[str, str, str], list[str], bytes | None]) -> None:
    """Status 0, or status 2 (1) and one line; no file is left half-written, and none outside the
    results.
    """
    (verb, case, results), options, contents = given
    (yard.cases / "input.toml").write_bytes(CASE.encode() if contents is None else contents)
    code, said = called([verb, case, "--results", results, *options], yard.path / "cwd")
    require(code in (0, 2), f"status {code}: {said!r}")
    require(code == 0 or (said.count("\n") == 1 and said.endswith("\n")), f"not one line: {said!r}")
    require(not list(yard.path.rglob("*.tmp")), "half a file")


def called(arguments: list[str], folder: Path) -> tuple[int, str]:
    """Status and stderr of the command line, in this process and without any YADE."""
    out = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="strict")
    err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="backslashreplace")
    folder.mkdir(exist_ok=True)
    # which `check` asks for
    before, path, command = os.getcwd(), os.environ["PATH"], local.yade_batch_command
    handler = signal.getsignal(signal.SIGTERM)
    os.environ["PATH"], local.yade_batch_command = "/nowhere", lambda: ["true"]  # type: ignore[assignment]
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = main(arguments)
            except SystemExit as end:
                code = int(end.code or 0)
    finally:
        os.chdir(before)
        os.environ["PATH"], local.yade_batch_command = path, command
        signal.signal(signal.SIGTERM, handler)
    err.flush()
    return code, err.buffer.getvalue().decode()  # type: ignore[attr-defined]


class Hang(BaseException):
    """Raised inside an input that takes too long."""


@contextlib.contextmanager
def time_limit(seconds: float = SECONDS) -> Iterator[None]:
    """Raise Hang in the body after so many seconds."""

    def ring(*_: Any) -> None:
        raise Hang

    old = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)


def use(yard: Yard, name: str, given: Any) -> None:
    """Use one input within the time limit; raises whatever goes wrong."""
    marks = yard.executed()
    with time_limit():
        KINDS[name].use(yard, given)
    require(yard.executed() == marks, "code of the input was run")
