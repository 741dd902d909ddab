"""The case file: one TOML per calibration, unknown keys refused, checked before anything runs."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

from calibrator.case.case import Case
from calibrator.case.codec import Table, as_table, build, typed
from calibrator.case.constraints import Constraint, read_constraint
from calibrator.case.experiment import Condition
from calibrator.case.fidelity import Fidelity
from calibrator.case.lab import Nuisance, Observable, read_lab, read_nuisances
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.case.settings import (
    Cluster,
    Diagnosis,
    Interpolation,
    Plan,
    Replicates,
    Running,
    Search,
    Validation,
)
from calibrator.case.values import Value, checked_value, known
from calibrator.case.vocabulary import PARAMETERS, SETUPS, parameters_of
from calibrator.errors import CalibratorError, Mistakes
from calibrator.files import named_file, read_text

T = TypeVar("T")
CASE_MEGABYTES = 0.25

SECTIONS = {
    "plan": Plan,
    "interpolation": Interpolation,
    "search": Search,
    "verify": Replicates,
    "validate": Validation,
    "run": Running,
    "cluster": Cluster,
    "diagnosis": Diagnosis,
    "fidelity": Fidelity,
}
"""The tables that a dataclass of settings reads."""

KEYS = (
    "name",
    "about",
    "measured",
    "parameters",
    "fixed",
    "setups",
    "targets",
    "truth_file",
    "constraints",
    "conditions",
    *SECTIONS,
)
PLAIN_WORD = "[A-Za-z0-9_]{1,64}"
TARGET_OPTIONS = ("weight", "tolerance")
CURVE_OPTIONS = ("scale_error", "offset_error", "shift_error")


def read_case(path: str | Path, site: Path | None = None, lab: Path | None = None) -> Case:
    """Read and check a case file, and the [cluster] table of a site file.

    lab : lab file to read instead of the case's own. Raises CalibratorError with every key that is
    wrong and what to write instead, those of the lab file included, as far as they do not depend on
    each other.
    """
    path, mistakes = Path(path), Mistakes()
    tables, settings = _load(path), Table()
    _note_unknown(tables, mistakes)
    if site is not None:
        with mistakes.noted():
            tables["cluster"] = _with_site(as_table(tables.get("cluster", {}), "cluster"), site)
    for key, cls in SECTIONS.items():
        if key in tables:
            with mistakes.noted():
                settings[key] = build(cls, tables[key], key)
    own: Table = {}
    for part, read in (
        ("parameters", _parameters),
        ("fixed", _fixed),
        ("setups", _setups),
        ("conditions", _conditions),
        ("about", lambda tables: typed("about", str, tables.get("about", ""))),
        ("truth", lambda tables: _truth(path, tables)),
        ("measured", lambda tables: lab or _measured(tables, path)),
    ):
        with mistakes.noted():
            own[part] = read(tables)
    if "parameters" in own and "fixed" in own:
        with mistakes.noted():
            names = [p.name for p in own["parameters"]]
            own["constraints"] = _constraints(tables, names, own["fixed"])
    if "measured" in own:
        with mistakes.noted():
            own.update(_measurements(own["measured"], tables, own, settings, path))
    mistakes.raise_any()
    targets = own.pop("targets")
    problem = Problem(
        own.pop("parameters"),
        targets=tuple(t for role, t in targets if role == "calibrate"),
        held_out=tuple(t for role, t in targets if role == "held_out"),
        fixed=own.pop("fixed"),
        setups=own.pop("setups"),
        constraints=own.pop("constraints"),
        conditions=own.pop("conditions"),
    )
    return Case(tables["name"], path, problem, **own, **settings)


def _note_unknown(tables: Table, mistakes: Mistakes) -> None:
    """Note keys that no case has, a name that is none, and shell text."""
    for key in tables:
        with mistakes.noted():
            known(key, KEYS, "key in the case file")
    name, cluster = tables.get("name"), tables.get("cluster")
    if not isinstance(name, str) or not re.fullmatch(PLAIN_WORD, name):
        mistakes.note(
            [
                'name is missing or not a plain word: add name = "my_sand" (at most 64 of A-Z, a-z,'
                " 0-9 and _)"
            ]
        )
    if isinstance(cluster, dict) and "shell" in cluster:  # a case may come from anybody
        mistakes.note(
            ["cluster.shell in a case file: move it to a site file of your own, given with --site"]
        )


def _measurements(measured: Path, tables: Table, own: Table, settings: Table, path: Path) -> Table:
    """What the lab file says, and what the case says of its rows."""
    rows, mistakes = read_lab(measured), Mistakes()
    found: Table = {"observables": tuple(one for one in rows if not one.curve)}
    if "conditions" in own:
        for one in rows:
            with mistakes.noted():
                _require_own_condition(one, own["conditions"])
    with mistakes.noted():
        found["targets"] = _targets(tables, rows)
    with mistakes.noted():
        found["nuisances"] = _nuisances(settings.get("diagnosis", Diagnosis()), path, rows)
    mistakes.raise_any()
    return found


def _require_own_condition(one: Observable, conditions: dict[str, Condition]) -> None:
    """Raise CalibratorError where an observable's condition is none, or one of another set-up."""
    if not one.condition:
        return
    setup = conditions[known(one.condition, conditions, "condition")].setup
    if setup != one.setup:
        raise CalibratorError(f"{one.key}: the condition belongs to {setup}; correct the lab file")


def _with_site(own: Table, path: Path) -> Table:
    """The case's [cluster] and the site's together.

    A key with two values is refused, so that neither wins unnoticed.
    """
    tables = _load(path)
    for key in tables:
        known(key, ("cluster",), "key in the site file")
    site = as_table(tables.get("cluster", {}), "cluster")
    for key in own:
        if key in site and own[key] != site[key]:
            raise CalibratorError(
                f"cluster.{key} differs in the case and in {path}: delete one of them"
            )
    return {**site, **own}


def _load(path: Path) -> Table:
    """The tables of a TOML file; CalibratorError, with the remedy, where it is none."""
    try:
        return _plain(tomllib.loads(read_text(path, CASE_MEGABYTES)))
    except FileNotFoundError:
        raise CalibratorError(
            f"no case file {path}: give the path of a TOML file such as cases/coarse_sand.toml"
        ) from None
    except OSError as error:
        raise CalibratorError(f"cannot read {path} ({error}): give a readable TOML file") from None
    # also an integer of thousands of digits, and brackets without end
    except (ValueError, RecursionError) as error:
        raise CalibratorError(f"{path} is not valid TOML ({error}): correct that line") from None


def _plain(value: T, depth: int = 0) -> T:
    """The value itself, if it is not nested deeper than any case and TOML allows its integers.

    Raises ValueError otherwise.
    """
    if depth > 10:
        raise ValueError("tables or lists nested more than ten deep")
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError("an integer beyond 64 bits")
    for one in (
        value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    ):
        _plain(one, depth + 1)
    return value


def _measured(tables: Table, path: Path) -> Path:
    """The path of the lab file that the case names."""
    if not isinstance(tables.get("measured"), str):
        raise CalibratorError(
            'measured is missing: add measured = "lab.csv", the file with the measured responses'
        )
    return named_file(path, tables["measured"], "measured")


def _conditions(tables: Table) -> dict[str, Condition]:
    """The case's conditions by name."""
    conditions, mistakes = {}, Mistakes()
    for name, spec in as_table(tables.get("conditions", {}), "conditions").items():
        where = f"conditions.{name}"
        if not re.fullmatch(PLAIN_WORD, name):
            mistakes.note([f"{where}: the name is not a plain word; use A-Z, a-z, 0-9 and _"])
        with mistakes.noted():
            values = dict(as_table(spec, where))
            setup = known(values.pop("setup", ""), SETUPS, f"set-up of {where}")
            own = [n for n in parameters_of(setup) if n != "seed"]
            conditions[name] = Condition(setup, _values(values, where, own))
    mistakes.raise_any()
    return conditions


def _values(given: Table, where: str, names: Iterable[str] = PARAMETERS) -> dict[str, Value]:
    """The values of a table of parameters, each of which is one of these names."""
    found, mistakes, names = {}, Mistakes(), list(names)
    for name, value in as_table(given, where).items():
        with mistakes.noted():
            own = known(name, names, f"parameter in [{where}]")
            found[own] = checked_value(name, value)
    mistakes.raise_any()
    return found


def _nuisances(
    diagnosis: Diagnosis, path: Path, observables: list[Observable]
) -> tuple[Nuisance, ...]:
    """The table of nuisances that a diagnosis names; empty where it names none."""
    if not diagnosis.nuisances:
        return ()
    return tuple(
        read_nuisances(named_file(path, diagnosis.nuisances, "diagnosis.nuisances"), observables)
    )


def _parameters(tables: Table) -> tuple[Parameter, ...]:
    """What is to be calibrated."""
    found, mistakes = [], Mistakes()
    for name, spec in as_table(tables.get("parameters", {}), "parameters").items():
        with mistakes.noted():
            found.append(_parameter(name, spec))
    mistakes.raise_any()
    return tuple(found)


def _fixed(tables: Table) -> dict[str, Value]:
    """The values of all set-ups."""
    fixed = _values(tables.get("fixed", {}), "fixed")
    if "seed" in fixed:
        raise CalibratorError(
            "seed cannot be fixed: replicates need different seeds; set plan.seed instead"
        )
    return fixed


def _constraints(
    tables: Table, calibrated: list[str], fixed: dict[str, Value]
) -> tuple[Constraint, ...]:
    """The inequalities of the key `constraints`."""
    given = typed("constraints", tuple[str, ...], tables.get("constraints", []))
    numbers = {n: float(v) for n, v in fixed.items() if not isinstance(v, str)}
    return tuple(c for text in given for c in read_constraint(text, calibrated, numbers))


def _parameter(name: str, spec: Any) -> Parameter:
    """One table of [parameters]."""
    where = f"parameters.{known(name, PARAMETERS, 'parameter')}"
    if "name" in as_table(spec, where):
        raise CalibratorError(f"{where} has a key name: remove it, the table's heading is the name")
    return build(Parameter, {"name": name, **spec}, where)


def _setups(tables: Table) -> dict[str, dict[str, Value]]:
    """The values that single set-ups have of their own."""
    setups, mistakes = {}, Mistakes()
    for setup, spec in as_table(tables.get("setups", {}), "setups").items():
        with mistakes.noted():
            own = parameters_of(known(setup, SETUPS, "set-up"))
            setups[setup] = _values(spec, f"setups.{setup}", own)
    mistakes.raise_any()
    return setups


def _targets(tables: Table, observables: list[Observable]) -> list[tuple[str, Target]]:
    """(role, target) of every row to calibrate or to validate with.

    [targets."setup.response"] may set weight and tolerance, and what a curve's points share.
    """
    options = as_table(tables.get("targets", {}), "targets")
    keys, targets, mistakes = [o.key for o in observables], [], Mistakes()
    for key in options:
        with mistakes.noted():
            known(key, keys, "target")
    for one in observables:
        if one.role == "diagnose":
            continue
        where = f"targets.{one.key}"
        allowed = (*TARGET_OPTIONS, *CURVE_OPTIONS) if one.curve else TARGET_OPTIONS
        with mistakes.noted():
            extra: Table = {
                k: typed(f"{where}.{known(k, allowed, 'target option')}", float, v)
                for k, v in as_table(options.get(one.key, {}), where).items()
            }
            if one.curve:
                shared = {k: extra.pop(k) for k in CURVE_OPTIONS if k in extra}
                extra["curve"] = dataclasses.replace(one.curve, **shared)
            targets.append((one.role, dataclasses.replace(one.target(), **extra)))
    mistakes.raise_any()
    return targets


def _truth(path: Path, tables: Table) -> dict[str, float]:
    """The parameters behind a synthetic lab; empty where the case names none.

    They are read only to print how far the calibration is from them.
    """
    if "truth_file" not in tables:
        return {}
    name = typed("truth_file", str, tables["truth_file"])
    truth = _load(named_file(path, name, "truth_file"))
    for key in truth:
        known(key, ("parameters",), "table in the truth file")
    given = as_table(truth.get("parameters", {}), "parameters").items()
    return {n: typed(f"{name}: {n}", float, checked_value(n, v)) for n, v in given}
