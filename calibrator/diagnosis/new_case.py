"""A named effect, written as a new case file."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.case.case import Case
from calibrator.case.vocabulary import EFFECTS, effect_of
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.explanations import Effect
from calibrator.diagnosis.surfaces import fewest_runs
from calibrator.files import read_text, write_text
from calibrator.runs.workspace import Workspace

LONGEST_NAME = 64  # of a case
WITH_RUNS = ("run", "verify", "validate", "diagnosis")  # tables that may name shipped runs
Table = dict[str, Any]  # of a case file, as TOML has it


def write_new_case(space: Workspace, effect: Effect, size: float, error: float) -> Path:
    """Write the case with an effect among its parameters, beside copies of the files that it names.

    size, error : amplitude and standard error in plausible scales; the parameter's bounds are three
    errors away, at least half of the size. The tables are written anew from what they say, so that
    comments are lost. Left out are shipped runs and a known truth, which know nothing of the
    effect. Returns the path of the new case.
    """
    case, folder = space.case, space.folder("with_effect")
    ending = f"_with_{effect.name}"
    name = case.name[: LONGEST_NAME - len(ending)] + ending
    low, high = _bounds(effect, size, error)
    tables = tomllib.loads(read_text(case.path))
    gone = _without_effect(tables, effect.name)
    tables["name"] = name
    tables.setdefault("parameters", {})[effect.name] = {"low": low, "high": high}
    tables["measured"] = _copied(case.measured, folder / f"{name}_lab.csv")
    if case.diagnosis.nuisances:
        nuisances = case.path.parent / case.diagnosis.nuisances
        copy = _copied(nuisances, folder / f"{name}_nuisances.csv")
        tables["diagnosis"]["nuisances"] = copy
    if (sets := _sets(case)) > case.diagnosis.sets:
        tables.setdefault("diagnosis", {})["sets"] = sets
    path = folder / f"{name}.toml"
    write_text(path, "\n".join([*_head(case, effect, gone), "", *_lines(tables)]) + "\n")
    return path


def _sets(case: Case) -> int:
    """Sets that a diagnosis needs where there is one parameter more."""
    parameters, effects = len(case.problem.names) + 1, len(case.diagnosis.effects)
    changed = fewest_runs(parameters, effects) - effects * case.diagnosis.effect_sets
    return max(fewest_runs(parameters, 0), changed)


def _bounds(effect: Effect, size: float, error: float) -> tuple[float, float]:
    """Lower and upper bound of the effect's column, within what it can take."""
    reach, column = max(3 * error, 0.5 * abs(size)), EFFECTS[effect.name]
    ends = np.clip([size - reach, size + reach], *effect.bounds)
    # an amplitude at its bound may miss the column's by a rounding error
    low, high = np.clip([ex.column_value(effect, end) for end in ends], column.low, column.high)
    return float(min(low, high)), float(max(low, high))


def _without_effect(tables: Table, name: str) -> list[str]:
    """Take out of the tables what cannot stand beside the effect as a parameter, and stale runs.

    Returns the places where a value of the effect was fixed, with the value.
    """
    tables.pop("truth_file", None)
    for section in WITH_RUNS:
        tables.get(section, {}).pop("shipped", None)
    setups = tables.get("setups", {})
    places = {"fixed": tables.get("fixed", {}), **{f"setups.{s}": own for s, own in setups.items()}}
    return [
        f"{place}.{name} = {_value(own.pop(name))}" for place, own in places.items() if name in own
    ]


def _copied(source: Path, target: Path) -> str:
    shutil.copyfile(source, target)
    return target.name


def _head(case: Case, effect: Effect, gone: list[str]) -> list[str]:
    called = effect_of(effect.name).called
    return [
        f"# The case {case.name} with {called}, which a diagnosis named.",
        f"# Added: [parameters.{effect.name}].",
        *(f"# Taken out: {place}." for place in gone),
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
