"""The lab file: measured responses as CSV, one row per observable.

Beside it a case may name a table of the errors of the metrology that several observables share.
"""

from __future__ import annotations

import csv
import fnmatch
import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from calibrator.case.problem import LARGEST, Target, known
from calibrator.case.vocabulary import EFFECTS, RESPONSES, SETUPS
from calibrator.errors import CalibratorError, shown
from calibrator.files import read_text

COLUMNS = ("setup", "response", "value", "scatter", "replicates", "unit", "role")
WITH_CONDITION = ("setup", "condition", *COLUMNS[1:])
ROLES = ("calibrate", "held_out", "diagnose")
NUISANCES = ("nuisance", "observables", "error", "unit")


@dataclass(frozen=True)
class Observable:
    """A measured bulk response of a set-up, under one of the case's conditions or under none ("").

    value and scatter (standard deviation of one replicate, 0: unknown) in the response's unit;
    replicates is how many measurements the value averages; role: used to calibrate, only to
    diagnose a gap, or held out. Raises CalibratorError for an unknown name, a value that is not
    finite, and a condition on what is to be calibrated.
    """

    setup: str
    response: str
    value: float
    scatter: float
    replicates: int
    role: str
    condition: str = ""

    def __post_init__(self) -> None:
        known(self.role, ROLES, "role")
        known(self.setup, SETUPS, "set-up")
        quantity = RESPONSES[known(self.response, RESPONSES, "response")]
        if self.setup not in quantity.setups:
            raise CalibratorError(
                f"{self.setup} does not measure {self.response}: use {' or '.join(quantity.setups)}"
            )
        if not abs(self.value) <= LARGEST or not 0 <= self.scatter <= LARGEST:
            raise CalibratorError(
                f"{self.key} = {self.value}, scatter {self.scatter}: give a finite value, and a"
                " scatter of zero or more"
            )
        if not 1 <= self.replicates <= 1_000_000:
            raise CalibratorError(
                f"{self.key}: replicates = {shown(self.replicates)}; give 1 to 1000000"
            )
        if self.condition and self.role == "calibrate":
            raise CalibratorError(
                f"{self.key}: a calibration knows no conditions; give it the role diagnose or"
                " held_out"
            )
        if self.role == "calibrate" or (self.role == "held_out" and not self.condition):
            self.target()

    @property
    def experiment(self) -> str:
        """setup, or setup@condition: what one run simulates."""
        return f"{self.setup}@{self.condition}" if self.condition else self.setup

    @property
    def key(self) -> str:
        """experiment.response."""
        return f"{self.experiment}.{self.response}"

    def target(self) -> Target:
        """As a target of a calibration."""
        return Target(self.setup, self.response, self.value, self.scatter, self.replicates)


@dataclass(frozen=True)
class Nuisance:
    """An error of the metrology that several observables share, such as that of a balance.

    observables : keys, with * and ? as wildcards; or effect:<column>, where the error is one of a
    known effect, such as the tolerance of the neck. error : standard deviation, in the observables'
    or the effect's unit, or in per cent of the value; unit : that unit, or "%".
    """

    name: str
    observables: str
    error: float
    unit: str

    @property
    def effect(self) -> str:
        """The effect's column, or ""."""
        return (
            self.observables.removeprefix("effect:")
            if self.observables.startswith("effect:")
            else ""
        )

    def touches(self, observable: Observable) -> bool:
        """Whether an observable has this error."""
        return fnmatch.fnmatchcase(observable.key, self.observables)


def read_lab(path: Path) -> list[Observable]:
    """Read a lab file; lines starting with # are notes.

    Columns: setup, condition (may be left out where no row has one), response, value (mean),
    scatter (standard deviation of one replicate; empty = unknown), replicates, unit (must be the
    vocabulary's), role (calibrate, held_out or diagnose). Raises CalibratorError with the line
    number and the remedy.
    """
    rows = _rows(path, "lab file", (COLUMNS, WITH_CONDITION))
    observables = [_observable(where, cells) for where, cells in rows]
    for key, count in Counter(one.key for one in observables).items():
        if count > 1:
            raise CalibratorError(f"{path}: {key} is given more than once; keep one row")
    return observables


def read_nuisances(path: Path, observables: list[Observable]) -> list[Nuisance]:
    """Read a nuisance table: nuisance (a name), observables, error, unit.

    Raises CalibratorError with line and remedy.
    """
    return [
        _nuisance(where, cells, observables)
        for where, cells in _rows(path, "nuisance table", (NUISANCES,))
    ]


def _rows(
    path: Path, what: str, headers: tuple[tuple[str, ...], ...]
) -> list[tuple[str, dict[str, str]]]:
    """(place, cells by column) of every row of a CSV with one of these headers."""
    try:
        lines = read_text(path, 1).splitlines()
    except FileNotFoundError:
        raise CalibratorError(
            f"no {what} {path}: create it with the columns {','.join(headers[0])}"
        ) from None
    except OSError as error:
        raise CalibratorError(f"cannot read {path} ({error}): save it as UTF-8 text") from None
    numbered = [
        (i, line) for i, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")
    ]
    header = tuple(numbered[0][1].split(",")) if numbered else ()
    if header not in headers:
        raise CalibratorError(
            f"{path}: the header must be {','.join(headers[0])}; correct the first line"
        )
    return [
        (f"{path} line {i}", _cells(f"{path} line {i}", line, header)) for i, line in numbered[1:]
    ]


def _cells(where: str, line: str, header: tuple[str, ...]) -> dict[str, str]:
    """The cells of one line by column."""
    try:
        # line by line: an open quotation mark must not swallow the next row
        (cells,) = csv.reader([line], strict=True)
    except csv.Error as error:
        raise CalibratorError(
            f"{where}: {error}; write plain words and numbers between commas"
        ) from None
    if len(cells) != len(header):
        raise CalibratorError(
            f"{where}: {len(cells)} cells instead of {len(header)}; fill in {','.join(header)}"
        )
    return dict(zip(header, (cell.strip() for cell in cells), strict=True))


def _observable(where: str, row: dict[str, str]) -> Observable:
    """The observable of one row; where : the place that a message names."""
    quantity = RESPONSES[known(row["response"], RESPONSES, f"response ({where})")]
    if row["unit"] != quantity.unit:
        raise CalibratorError(
            f"{where}: {row['response']} in {row['unit']!r}; convert it to {quantity.unit}"
        )
    try:
        value, scatter, replicates = (
            float(row["value"]),
            float(row["scatter"] or 0.0),
            int(row["replicates"] or 1),
        )
        return Observable(
            row["setup"],
            row["response"],
            value,
            scatter,
            replicates,
            row["role"],
            row.get("condition", ""),
        )
    except ValueError as error:
        raise CalibratorError(f"{where}: {error}; write plain numbers") from None
    except CalibratorError as error:
        raise CalibratorError(f"{where}: {error}") from None


def _nuisance(where: str, row: dict[str, str], observables: list[Observable]) -> Nuisance:
    """The nuisance of one row; where : the place that a message names."""
    try:
        found = Nuisance(row["nuisance"], row["observables"], float(row["error"]), row["unit"])
    except ValueError as error:
        raise CalibratorError(f"{where}: {error}; write plain numbers") from None
    if not (math.isfinite(found.error) and 0 < found.error <= LARGEST):
        raise CalibratorError(
            f"{where}: error = {row['error']}; give a positive standard deviation"
        )
    if found.effect:
        units = {EFFECTS[known(found.effect, EFFECTS, f"effect ({where})")].unit}
    else:
        units = {RESPONSES[o.response].unit for o in observables if found.touches(o)}
        if not units:
            raise CalibratorError(
                f"{where}: {found.observables} is the key of no row in the lab file; correct it"
            )
    if (found.unit != "%" and units != {found.unit}) or (found.unit == "%" and found.effect):
        raise CalibratorError(
            f"{where}: unit {found.unit!r}; the error has to be in {' and in '.join(sorted(units))}"
        )
    return found
