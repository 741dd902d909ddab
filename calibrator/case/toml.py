"""The case file: one TOML per calibration, unknown keys refused, checked before anything runs."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from pathlib import Path
from typing import Any, TypeVar

from calibrator.case.case import Case
from calibrator.case.codec import Table, build, typed
from calibrator.case.constraints import Constraint, read_constraint
from calibrator.case.lab import Nuisance, Observable, read_lab, read_nuisances
from calibrator.case.problem import Parameter, Problem, Target, Value, checked_value, known
from calibrator.case.settings import (
    Cluster,
    Condition,
    Diagnosis,
    Interpolation,
    Plan,
    Replicates,
    Running,
    Search,
    Validation,
)
from calibrator.case.vocabulary import PARAMETERS, SETUPS, parameters_of
from calibrator.errors import CalibratorError
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


def read_case(path: str | Path, site: Path | None = None, lab: Path | None = None) -> Case:
    """Read and check a case file, and the [cluster] table of a site file.

    lab : lab file to read instead of the case's own. Raises CalibratorError with the offending key
    and what to write instead.
    """
    path = Path(path)
    tables = _tables(path, site)
    settings: Table = {
        key: build(cls, tables[key], key) for key, cls in SECTIONS.items() if key in tables
    }
    truth = _truth(path, tables["truth_file"]) if "truth_file" in tables else {}
    about = typed("about", str, tables.get("about", ""))
    measured = lab or _measured(tables, path)
    observables, conditions = read_lab(measured), _conditions(tables)
    for one in observables:
        _require_own_condition(one, conditions)
    nuisances = _nuisances(settings.get("diagnosis", Diagnosis()), path, observables)
    return Case(
        tables["name"],
        path,
        _problem(tables, observables),
        about=about,
        truth=truth,
        measured=measured,
        observables=tuple(observables),
        conditions=conditions,
        nuisances=nuisances,
        **settings,
    )


def _tables(path: Path, site: Path | None) -> Table:
    """The tables of a case file, all of which are known, with the site's [cluster] and a name."""
    tables = _load(path)
    if "shell" in _table(tables.get("cluster", {}), "cluster"):  # a case may come from anybody
        raise CalibratorError(
            "cluster.shell in a case file: move it to a site file of your own, given with --site"
        )
    if site is not None:
        tables["cluster"] = _with_site(tables.get("cluster", {}), site)
    for key in tables:
        known(key, KEYS, "key in the case file")
    name = tables.get("name")
    if not isinstance(name, str) or not re.fullmatch(PLAIN_WORD, name):
        raise CalibratorError(
            'name is missing or not a plain word: add name = "my_sand" (at most 64 of A-Z, a-z, 0-9'
            " and _)"
        )
    return tables


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
    site = _table(tables.get("cluster", {}), "cluster")
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
    conditions = {}
    for name, spec in _table(tables.get("conditions", {}), "conditions").items():
        where = f"conditions.{name}"
        if not re.fullmatch(PLAIN_WORD, name):
            raise CalibratorError(f"{where}: the name is not a plain word; use A-Z, a-z, 0-9 and _")
        values = dict(_table(spec, where))
        setup = known(values.pop("setup", ""), SETUPS, f"set-up of {where}")
        own = {n: q for n, q in parameters_of(setup).items() if n != "seed"}
        conditions[name] = Condition(
            setup,
            {
                known(n, own, f"parameter of {where}"): checked_value(n, v)
                for n, v in values.items()
            },
        )
    return conditions


def _nuisances(
    diagnosis: Diagnosis, path: Path, observables: list[Observable]
) -> tuple[Nuisance, ...]:
    """The table of nuisances that a diagnosis names; empty where it names none."""
    if not diagnosis.nuisances:
        return ()
    return tuple(
        read_nuisances(named_file(path, diagnosis.nuisances, "diagnosis.nuisances"), observables)
    )


def _problem(tables: Table, observables: list[Observable]) -> Problem:
    """Parameters, targets and fixed values."""
    parameters = tuple(
        _parameter(name, spec)
        for name, spec in _table(tables.get("parameters", {}), "parameters").items()
    )
    fixed = {n: checked_value(n, v) for n, v in _table(tables.get("fixed", {}), "fixed").items()}
    if "seed" in fixed:
        raise CalibratorError(
            "seed cannot be fixed: replicates need different seeds; set plan.seed instead"
        )
    targets = _targets(tables, observables)
    return Problem(
        parameters,
        targets=tuple(t for role, t in targets if role == "calibrate"),
        held_out=tuple(t for role, t in targets if role == "held_out"),
        fixed=fixed,
        setups=_setups(tables),
        constraints=_constraints(tables, [p.name for p in parameters], fixed),
    )


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
    if "name" in _table(spec, where):
        raise CalibratorError(f"{where} has a key name: remove it, the table's heading is the name")
    return build(Parameter, {"name": name, **spec}, where)


def _setups(tables: Table) -> dict[str, dict[str, Value]]:
    """The values that single set-ups have of their own."""
    setups: dict[str, dict[str, Value]] = {}
    for setup, spec in _table(tables.get("setups", {}), "setups").items():
        own = parameters_of(known(setup, SETUPS, "set-up"))
        setups[setup] = {
            known(n, own, f"parameter of {setup}"): checked_value(n, v)
            for n, v in _table(spec, f"setups.{setup}").items()
        }
    return setups


def _table(value: Any, where: str) -> Table:
    """The value if it is a table, else CalibratorError."""
    if not isinstance(value, dict):
        raise CalibratorError(f"{where} must be a table: write [{where}] on a line of its own")
    return value


def _targets(tables: Table, observables: list[Observable]) -> list[tuple[str, Target]]:
    """(role, target) of every row to calibrate or to validate with.

    [targets."setup.response"] may set weight and tolerance.
    """
    options = _table(tables.get("targets", {}), "targets")
    rows = [
        (one.role, one.target())
        for one in observables
        if one.role != "diagnose" and not one.condition
    ]
    targets = []
    for role, target in rows:
        extra = {
            k: typed(
                f"targets.{target.key}.{known(k, ('weight', 'tolerance'), 'target option')}",
                float,
                v,
            )
            for k, v in _table(options.get(target.key, {}), f"targets.{target.key}").items()
        }
        targets.append((role, dataclasses.replace(target, **extra)))
    for key in options:
        known(key, [o.key for o in observables], "target")
    return targets


def _truth(path: Path, name: Any) -> dict[str, float]:
    """The parameters behind a synthetic lab.

    They are read only to print how far the calibration is from them.
    """
    tables = _load(named_file(path, typed("truth_file", str, name), "truth_file"))
    for key in tables:
        known(key, ("parameters",), "table in the truth file")
    given = _table(tables.get("parameters", {}), "parameters").items()
    return {n: typed(f"{name}: {n}", float, checked_value(n, v)) for n, v in given}
