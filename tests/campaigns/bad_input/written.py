"""What a user writes: case files, lab files and nuisance tables."""

from __future__ import annotations

import codecs
import dataclasses
import json
import re
import tomllib
from typing import Any

import numpy as np

from calibrator.case.case import Case
from calibrator.case.lab import read_lab, read_nuisances
from calibrator.case.toml import SECTIONS, read_case
from calibrator.diagnosis import experiments
from calibrator.plan.design import sobol
from calibrator.plan.requests import plan_requests
from calibrator.runs.request import Request, write_table
from tests.campaigns.bad_input.damage import TOML_VALUES, damaged_bytes
from tests.campaigns.bad_input.rules import Kind, ask, registry, require, safe_table, texts
from tests.campaigns.bad_input.yard import CASE, LAB, NUISANCES, WITH_CONDITIONS, Yard

KINDS: dict[str, Kind] = {}
kind = registry(KINDS)
SMALL_PLAN = 300  # runs of a plan that is written out


@kind(
    0.16,
    lambda yard: damaged_bytes(
        [CASE.encode()], [*TOML_VALUES, *texts(yard), *map(json.dumps, yard.spells())]
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
        own = getattr(case, section)
        settings = {} if own is None else dataclasses.asdict(own)
        given = {
            k: tuple(v) if isinstance(v, list) else v for k, v in tables.get(section, {}).items()
        }
        if any(settings.get(k) != v for k, v in given.items()):
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


def _filled(data: bytes) -> list[str]:
    """The lines of a table, its header among them, that are no notes and have a cell that is full.

    A spreadsheet may have saved it as UTF-16, and leaves lines of empty cells.
    """
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    lines = data.decode("utf-16" if wide else "utf-8-sig").splitlines()
    return [x for x in lines if re.sub(r'[,;"\s]', "", x) and not re.match(r'[\s"]*(#|sep=)', x)]


@kind(0.15, lambda yard: damaged_bytes([LAB.encode(), WITH_CONDITIONS.encode()], texts(yard)))
def lab_file(yard: Yard, data: bytes) -> None:
    """Every row of an accepted lab file is a target; none is lost, and none made up."""
    path = yard.cases / "input.csv"
    path.write_bytes(data)
    rows = ask(lambda: read_lab(path))
    if rows is not None:
        lines = _filled(data)
        require(len(rows) == len(lines) - 1, "a row was lost")
        for row, line in zip(rows, lines[1:], strict=True):
            require(
                all(x in line for x in (row.role, row.setup, row.response, row.condition)),
                f"{row.key} is not in {line!r}",
            )


@kind(
    0.06,
    lambda yard: damaged_bytes(
        [NUISANCES.encode()], [*texts(yard), "effect:tilt_deg", "effect:", "*" * 99, "[!", "%"]
    ),
)
def nuisance_table(yard: Yard, data: bytes) -> None:
    """Every row of an accepted table is an error of a measurement or an effect; none is lost."""
    path = yard.cases / "input.csv"
    path.write_bytes(data)
    rows = read_lab(yard.cases / "lab.csv")
    found = ask(lambda: read_nuisances(path, rows))
    if found is not None:
        lines = _filled(data)
        require(len(found) == len(lines) - 1, "a row was lost")
        for one in found:
            touched = bool(one.effect) or any(one.touches(o) for o in rows)
            require(touched and np.isfinite(one.error) and one.error > 0, f"{one} does nothing")
