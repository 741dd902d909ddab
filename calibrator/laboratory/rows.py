"""From the readings of repeats to rows of the lab file, and into that file."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calibrator.case.cells import read_rows
from calibrator.case.lab import COLUMNS, OPTIONAL, Observable, read_lab
from calibrator.case.vocabulary import RESPONSES
from calibrator.errors import CalibratorError, Mistakes, one_line
from calibrator.files import read_text, write_text
from calibrator.laboratory.outcome import Measured, Reading, Row

LESSER = frozenset(
    (
        "onset_delay",
        "late_early_ratio",
        "rate_fluctuation",
        "drained_curvature",
        "drained_asymmetry_deg",
        "ledge_curvature",
        "pile_curvature",
        "pile_asymmetry_deg",
        "pile_apex_rounding",
        "drum_cubic_3",
        "drum_cubic_2",
        "drum_cubic_1",
        "drum_cubic_0",
        "drum_blur",
    )
)
"""Responses that tell effects apart and pin no parameter down: their role is diagnose."""


def combined(readings: Sequence[Reading], setup: str, condition: str, role: str) -> list[Row]:
    """A row of each response: mean, scatter and number of the repeats that measured it.

    The scatter is the standard deviation of one repeat, or the error of a single reading where that
    is larger, as with one repeat only, whose scatter nothing else shows.
    """
    rows = []
    names = [n for n in RESPONSES if setup in RESPONSES[n].setups]
    for name in names:
        ours = [r.values[name] for r in readings if name in r.values and r.values[name].response]
        if not ours:
            continue
        values = np.array([one.value for one in ours])
        errors = [one.error for one in ours if one.error is not None]
        own = math.sqrt(float(np.mean(np.square(errors)))) if errors else None
        spread = float(values.std(ddof=1)) if len(values) > 1 else None
        scatter = max((s for s in (own, spread) if s is not None), default=None)
        kept = "diagnose" if name in LESSER and role == "calibrate" else role
        unit = RESPONSES[name].unit
        mean = float(values.mean())
        rows.append(Row(setup, condition, name, mean, scatter, len(values), unit, kept))
    return rows


def check_rows(rows: Sequence[Row]) -> None:
    """Raise CalibratorError for each row that a lab file cannot have."""
    mistakes = Mistakes()
    for row in rows:
        with mistakes.noted():
            Observable(
                row.setup,
                row.response,
                row.value,
                row.scatter or 0.0,
                row.replicates,
                row.role,
                row.condition,
            )
    mistakes.raise_any()


def notes_of(outcome: Measured, command: Sequence[str]) -> list[str]:
    """What stands above the rows: of which files, how, with which errors."""
    said = [f"calibrator {shlex.join(command)}"]
    for reading in outcome.readings:
        said += [f"{reading.source}: {note}" for note in reading.notes]
        said += [f"{reading.source}: warning: {note}" for note in reading.warnings]
    said += [f"converted: {words}" for words in outcome.converted]
    said += [*outcome.notes, *(f"warning: {words}" for words in outcome.warnings)]
    return [f"# {one_line(line)}" for line in said]


def write_rows(path: Path, rows: Sequence[Row], notes: Sequence[str]) -> None:
    """Write rows to a lab file, or append them to one that is there, in its own columns.

    Raises CalibratorError where the file is none, has other columns, or has a response already.
    """
    if not path.exists():
        with_condition = any(row.condition for row in rows)
        header = ["setup", *(["condition"] if with_condition else []), *COLUMNS[1:]]
        lines = [",".join(r.cells(with_condition)) for r in rows]
        write_text(path, "\n".join([*notes, ",".join(header), *lines]) + "\n")
        return
    there = {one.key for one in read_lab(path)}
    mistakes = Mistakes()
    mistakes.note(
        f"{path} has {key} already; take that row out, give another --condition, or another --lab"
        for row in rows
        if (key := _key(row)) in there
    )
    mistakes.raise_any()
    text = read_text(path, 1)
    header = _columns(path, text)
    lines = [",".join(_cells(row, header, path)) for row in rows]
    write_text(path, "\n".join([text.rstrip("\n"), *notes, *lines]) + "\n")


def _key(row: Row) -> str:
    experiment = f"{row.setup}@{row.condition}" if row.condition else row.setup
    return f"{experiment}.{row.response}"


def _columns(path: Path, text: str) -> list[str]:
    """The header of a lab file with commas, to which rows can be appended."""
    read_rows(path, "lab file", COLUMNS, OPTIONAL)
    first = next(
        line for line in text.splitlines() if line.strip() and not line.lstrip(' "').startswith("#")
    )
    names = [cell.strip().strip('"').lower() for cell in first.split(",")]
    if not set(COLUMNS) <= set(names):
        raise CalibratorError(
            f"{path} has other separators than commas; save it with commas, or give another --lab"
        )
    return names


def _cells(row: Row, header: Sequence[str], path: Path) -> list[str]:
    """The cells of a row in the columns of a file."""
    names = ("setup", "condition", *COLUMNS[1:])
    cells = dict(zip(names, row.cells(True), strict=True))
    if row.condition and "condition" not in header:
        raise CalibratorError(
            f"{path} has no column condition; add it, or give another --lab for the rows of"
            f" {row.condition}"
        )
    return [cells.get(name, "") for name in header]
