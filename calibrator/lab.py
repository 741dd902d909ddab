"""The lab file: measured responses as CSV, one row per observable."""

from __future__ import annotations

import csv
from pathlib import Path

from calibrator.errors import CalibratorError
from calibrator.files import read_text
from calibrator.problem import Target, known
from calibrator.quantities import RESPONSES

COLUMNS = ("setup", "response", "value", "scatter", "replicates", "unit", "role")
ROLES = ("calibrate", "held_out", "diagnose")


def read_lab(path: Path) -> list[tuple[str, Target]]:
    """Read a lab file; lines starting with # are notes.

    Columns: setup, response, value (mean), scatter (standard deviation of one replicate; empty = unknown),
    replicates, unit (must be the vocabulary's), role (calibrate, held_out or diagnose).
    Returns (role, Target) pairs. Raises CalibratorError with the line number and the remedy.
    """
    try:
        lines = read_text(path, 1).splitlines()
    except FileNotFoundError:
        raise CalibratorError(f"no lab file {path}: create it with the columns {','.join(COLUMNS)}") from None
    except OSError as error:
        raise CalibratorError(f"cannot read {path} ({error}): save it as UTF-8 text") from None
    numbered = [(i, line) for i, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if not numbered or tuple(numbered[0][1].split(",")) != COLUMNS:
        raise CalibratorError(f"{path}: the header must be {','.join(COLUMNS)}; correct the first line")
    targets = [_row(f"{path} line {i}", line) for i, line in numbered[1:]]
    keys = [target.key for _, target in targets]
    for key in keys:
        if keys.count(key) > 1:
            raise CalibratorError(f"{path}: {key} is given more than once; keep one row")
    return targets


def _row(where: str, line: str) -> tuple[str, Target]:
    try:
        (cells,) = csv.reader([line], strict=True)  # line by line: an open quotation mark must not swallow the next row
    except csv.Error as error:
        raise CalibratorError(f"{where}: {error}; write plain words and numbers between commas") from None
    if len(cells) != len(COLUMNS):
        raise CalibratorError(f"{where}: {len(cells)} cells instead of {len(COLUMNS)}; fill in {','.join(COLUMNS)}")
    setup, response, value, scatter, replicates, unit, role = (cell.strip() for cell in cells)
    known(role, ROLES, f"role ({where})")
    quantity = RESPONSES[known(response, RESPONSES, f"response ({where})")]
    if unit != quantity.unit:
        raise CalibratorError(f"{where}: {response} in {unit!r}; convert it to {quantity.unit}")
    try:
        return role, Target(setup, response, float(value), float(scatter or 0.0), int(replicates or 1))
    except ValueError as error:
        raise CalibratorError(f"{where}: {error}; write plain numbers") from None
    except CalibratorError as error:
        raise CalibratorError(f"{where}: {error}") from None
