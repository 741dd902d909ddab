"""A named effect, written as a new case file."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.case.case import Case
from calibrator.case.curve import curve_file
from calibrator.case.lab import NUISANCES, WITH_CONDITION, Observable
from calibrator.case.problem import Target
from calibrator.case.toml import read_case
from calibrator.case.vocabulary import CURVES, EFFECTS, RESPONSES, effect_of, parameters_of
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.explanations import Effect
from calibrator.diagnosis.runs import enough_sets, require_diagnosable
from calibrator.errors import CalibratorError
from calibrator.files import read_text, write_text
from calibrator.responses.coordinates import OWN_SCALE
from calibrator.runs.workspace import Workspace

LONGEST_NAME = 64  # of a case
WITH_RUNS = ("run", "verify", "validate", "diagnosis")  # tables that may name shipped runs
Table = dict[str, Any]  # of a case file, as TOML has it


def write_new_case(space: Workspace, effect: Effect, size: float, error: float) -> Path:
    """Write the case with an effect among its parameters, beside copies of the files that it names.

    size, error : amplitude and standard error in plausible scales; the parameter's bounds are three
    errors away, at least half of the size. Every row that was measured for the diagnosis and that a
    calibration can use is a target of the new case, so that the size rests on all of them. The
    tables are written anew from what they say, so that comments are lost. Left out are shipped runs
    and a known truth, which know nothing of the effect. Returns the path of the new case. Raises
    CalibratorError where it could not be used as it is.
    """
    case, folder = space.case, space.folder("with_effect")
    ending = f"_with_{effect.name}"
    name = case.name[: LONGEST_NAME - len(ending)] + ending
    low, high = _bounds(effect, size, error)
    tables = tomllib.loads(read_text(case.path))
    gone = _without_effect(tables, effect.name)
    tables["name"] = name
    tables.setdefault("parameters", {})[effect.name] = {"low": low, "high": high}
    parameters = [*case.problem.names, effect.name]
    rows = [_as_target(case, one, parameters) for one in case.observables]
    _write_lab(folder / f"{name}_lab.csv", rows, case)
    tables["measured"] = f"{name}_lab.csv"
    if tables.get("diagnosis", {}).pop("nuisances", ""):
        gone += _write_nuisances(tables, folder / f"{name}_nuisances.csv", case, effect.name)
    _enlarge_plan(tables, case, rows)
    path, head = folder / f"{name}.toml", _head(case, effect, gone, rows)
    _write(path, head, tables)
    new = read_case(path)
    if (sets := enough_sets(new, new.observables)) > new.diagnosis.sets:
        tables.setdefault("diagnosis", {})["sets"] = sets
        _write(path, head, tables)
        new = read_case(path)
    require_diagnosable(new, new.observables)
    return path


def _write(path: Path, head: Sequence[str], tables: Table) -> None:
    write_text(path, "\n".join([*head, "", *_lines(tables)]) + "\n")


def _as_target(case: Case, one: Observable, parameters: Sequence[str]) -> Observable:
    """A row of the diagnosis as one to calibrate, if it can be that; others stay as they are.

    An experiment in which none of the parameters varies says nothing of them, and a value of zero
    needs a scatter to be met within.
    """
    held = case.conditions[one.condition].values.keys() if one.condition else set()
    moved = parameters_of(one.setup).keys() & set(parameters) - held
    if one.role != "diagnose" or not moved:
        return one
    try:
        return replace(one, role="calibrate")
    except CalibratorError:
        return one


def _write_lab(path: Path, rows: Sequence[Observable], case: Case) -> None:
    """The lab file with these rows, and with a note of those whose role is another one."""
    before = {one.key: one.role for one in case.observables}
    changed = [one.key for one in rows if one.role != before[one.key]]
    lines = [f"# {len(rows)} rows, as in {case.measured.name} but for roles."]
    if changed:
        lines.append(f"# Role diagnose there, calibrate here: {', '.join(changed)}.")
    lines.append(",".join(WITH_CONDITION))
    for one in rows:
        scatter = repr(one.scatter) if one.scatter else ""
        numbers = f"{one.value!r},{scatter},{one.replicates},{RESPONSES[one.response].unit}"
        lines.append(f"{one.setup},{one.condition},{one.response},{numbers},{one.role}")
    lines += [_curve(path, t, "calibrate") for t in case.problem.targets if t.curve]
    lines += [_curve(path, t, "held_out") for t in case.problem.held_out if t.curve]
    write_text(path, "\n".join(lines) + "\n")


def _curve(lab: Path, target: Target, role: str) -> str:
    """The row of a curve, whose file is written beside the lab file."""
    assert target.curve is not None
    name = f"{lab.stem}_{target.key.replace('@', '_').replace('.', '_')}.csv"
    write_text(lab.with_name(name), curve_file(target.curve))
    unit = CURVES[target.response].unit
    numbers = f"{name},,{target.replicates},{unit}"
    return f"{target.setup},{target.condition},{target.response},{numbers},{role}"


def _write_nuisances(tables: Table, path: Path, case: Case, effect: str) -> list[str]:
    """The table of nuisances without those that cannot stand beside the effect.

    No run could say what these do. Returns them in words.
    """
    gone = [n for n in case.nuisances if n.effect and ex.never_together(n.effect, effect)]
    if kept := [n for n in case.nuisances if n not in gone]:
        lines = [",".join(NUISANCES)]
        lines += [f"{_cell(n.name)},{_cell(n.observables)},{n.error!r},{n.unit}" for n in kept]
        write_text(path, "\n".join(lines) + "\n")
        tables["diagnosis"]["nuisances"] = path.name
    return [f"nuisance {n.name}, {n.observables}" for n in gone]


def _cell(text: str) -> str:
    """A cell of a table, as it can be read again with a separator or a quotation mark in it."""
    return '"' + text.replace('"', '""') + '"' if set(text) & set(',;\t"#') else text


def _enlarge_plan(tables: Table, case: Case, rows: Sequence[Observable]) -> None:
    """Let a plan have what one parameter and perhaps some experiments more ask for at least."""
    plan, fewest = tables.get("plan", {}), len(case.problem.names) + 3
    if plan.get("sets", fewest) < fewest:
        plan["sets"] = fewest  # an interpolant takes two sets more than parameters
    if case.plan.design == "adaptive":
        experiments = len({one.experiment for one in rows if one.role == "calibrate"})
        # of all experiments together
        plan["most_runs"] = case.plan.most_runs * experiments // len(case.problem.experiments)


def _bounds(effect: Effect, size: float, error: float) -> tuple[float, float]:
    """Lower and upper bound of the effect's column, within what it can take."""
    reach, column = max(3 * error, 0.5 * abs(size)), EFFECTS[effect.name]
    ends = np.clip([size - reach, size + reach], *effect.bounds)
    # an amplitude at its bound may miss the column's by a rounding error
    low, high = np.clip([ex.column_value(effect, end) for end in ends], column.low, column.high)
    return float(min(low, high)), float(max(low, high))


def _without_effect(tables: Table, name: str) -> list[str]:
    """Take out of the tables what cannot stand beside the effect as a parameter, and stale runs.

    Returns the places where something else stood, with what it was.
    """
    tables.pop("truth_file", None)
    for section in WITH_RUNS:
        tables.get(section, {}).pop("shipped", None)
    setups = tables.get("setups", {})
    places = {"fixed": tables.get("fixed", {}), **{f"setups.{s}": own for s, own in setups.items()}}
    gone = [
        f"{place}.{name} = {_value(own.pop(name))}" for place, own in places.items() if name in own
    ]
    if name in OWN_SCALE and tables.get("interpolation", {}).pop("similarity", False):
        gone.append("interpolation.similarity = true")
    return gone


def _head(case: Case, effect: Effect, gone: Sequence[str], rows: Sequence[Observable]) -> list[str]:
    called = effect_of(effect.name).called
    targets = sum(one.role == "calibrate" for one in rows)
    return [
        f"# The case {case.name} with {called}, which a diagnosis named.",
        f"# Added: [parameters.{effect.name}].",
        *(f"# Taken out: {place}." for place in gone),
        f"# Targets: {targets} of {len(rows)} rows, {len(case.problem.targets)} before; the lab"
        " file says which.",
    ]


def _lines(table: Table, heading: str = "") -> list[str]:
    """A table as TOML: its values, then the tables in it, each under a heading of its own."""
    inner = {key: value for key, value in table.items() if isinstance(value, dict)}
    own = [f"{_key(k)} = {_value(value)}" for k, value in table.items() if k not in inner]
    # a table that holds nothing but tables needs no heading
    lines = ["", f"[{heading}]"] * bool(heading and (own or not inner)) + own
    for key, value in inner.items():
        lines += _lines(value, f"{heading}.{_key(key)}" if heading else _key(key))
    return lines


def _key(name: str) -> str:
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else _value(name)


def _value(value: Any) -> str:
    """A value that may stand in a case, as TOML writes it.

    Raises TypeError for dates and lists of tables, which no case has.
    """
    if isinstance(value, str):
        # JSON's escapes are TOML's, but for the one character that only TOML escapes
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, list):
        return f"[{', '.join(_value(one) for one in value)}]"
    raise TypeError(f"no value of a case: {value!r}")
