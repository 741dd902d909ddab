"""The lab file: measured responses as CSV, one row per observable.

Beside it a case may name a table of the errors of the metrology that several observables share.
"""

from __future__ import annotations

import fnmatch
import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from calibrator.case.cells import read_rows, whole
from calibrator.case.curve import MeasuredCurve, read_curve
from calibrator.case.experiment import experiment_name
from calibrator.case.problem import Target
from calibrator.case.values import LARGEST, known
from calibrator.case.vocabulary import CURVES, EFFECTS, PARAMETERS, RESPONSES, SETUPS
from calibrator.errors import CalibratorError, Mistakes, shown
from calibrator.files import named_file

COLUMNS = ("setup", "response", "value", "scatter", "replicates", "unit", "role")
OPTIONAL = ("condition", "days")
WITH_CONDITION = ("setup", "condition", *COLUMNS[1:])
ROLES = ("calibrate", "held_out", "diagnose")
NUISANCES = ("nuisance", "observables", "error", "unit")
MEASURED = {**RESPONSES, **CURVES}
"""What a row can be of: a response, or a curve as a whole."""


@dataclass(frozen=True)
class Observable:
    """A measured bulk response of a set-up, under one of the case's conditions or under none ("").

    value and scatter (standard deviation of one replicate, 0: unknown) in the response's unit;
    replicates is how many measurements the value averages, and days on how many of these something
    that they share was new (set up afresh, another operator, another day); role: used to calibrate,
    only to diagnose a gap, or held out; curve: of an observable that is a curve as a whole, its
    value the mean height. Raises CalibratorError for an unknown name, a value that is not finite,
    and what cannot be a target although its role makes it one.
    """

    setup: str
    response: str
    value: float
    scatter: float
    replicates: int
    role: str
    condition: str = ""
    days: int = 1
    curve: MeasuredCurve | None = None

    def __post_init__(self) -> None:
        known(self.role, ROLES, "role")
        known(self.setup, SETUPS, "set-up")
        quantity = MEASURED[known(self.response, MEASURED, "response")]
        if self.setup not in quantity.setups:
            raise CalibratorError(
                f"{self.setup} does not measure {self.response}: use {' or '.join(quantity.setups)}"
            )
        if not abs(self.value) <= LARGEST or not 0 <= self.scatter <= LARGEST:
            raise CalibratorError(
                f"{self.key} = {self.value}, scatter {self.scatter}: give a finite value, and a"
                " scatter of zero or more, or leave the scatter empty"
            )
        self._require_possible()
        if not 1 <= self.replicates <= 1_000_000:
            raise CalibratorError(
                f"{self.key}: replicates = {shown(self.replicates)}; give 1 to 1000000"
            )
        if not 1 <= self.days <= self.replicates:
            raise CalibratorError(
                f"{self.key}: days = {shown(self.days)}; give 1 to {self.replicates}, on how many"
                " days the replicates were made"
            )
        if self.role != "diagnose":
            self.target()
        elif self.curve:
            raise CalibratorError(
                f"{self.key}: a curve is no evidence for a diagnosis; give it the role calibrate or"
                " held_out"
            )

    def _require_possible(self) -> None:
        """Raise CalibratorError for a value that the response cannot have."""
        quantity = MEASURED[self.response]
        low = -LARGEST if quantity.low is None else quantity.low
        high = LARGEST if quantity.high is None else quantity.high
        if low <= self.value <= high:
            return
        hint = {
            "deg": "has a decimal point slipped? ",
            "1": "it is a share, divide per cents by 100; " if high == 1 else "",
        }.get(quantity.unit, "")
        bounds = f"{low:g} or more" if quantity.high is None else f"{low:g} to {high:g}"
        raise CalibratorError(
            f"{self.key} = {self.value:g}: {hint}give a value of {bounds} {quantity.unit}"
        )

    @property
    def experiment(self) -> str:
        """setup, or setup@condition: what one run simulates."""
        return experiment_name(self.setup, self.condition)

    @property
    def key(self) -> str:
        """experiment.response."""
        return f"{self.experiment}.{self.response}"

    def target(self) -> Target:
        """As a target of a calibration."""
        return Target(
            self.setup,
            self.response,
            self.value,
            self.scatter,
            self.replicates,
            condition=self.condition,
            curve=self.curve,
        )


@dataclass(frozen=True)
class Nuisance:
    """An error of the metrology that several observables share, such as that of a balance.

    observables : keys, with * and ? as wildcards; or effect:<column>, where the error is one of a
    known effect, such as the tolerance of the neck; or fixed:<parameter> or
    fixed:<set-up>.<parameter>, where it is that of a value which the case fixes. error : standard
    deviation, in the observables', the effect's or the parameter's unit, or in per cent of the
    value; unit : that unit, or "%".
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

    @property
    def fixed(self) -> tuple[str, str] | None:
        """Set-up, or "", and name of the fixed value that is uncertain; None where it is none."""
        if not self.observables.startswith("fixed:"):
            return None
        setup, _, name = self.observables.removeprefix("fixed:").rpartition(".")
        return setup, name

    def touches(self, observable: Observable) -> bool:
        """Whether an observable's reading has this error."""
        return fnmatch.fnmatchcase(observable.key, self.observables)


def read_lab(path: Path) -> list[Observable]:
    """Read a lab file; lines starting with # are notes.

    Columns: setup, condition and days (may be left out where no row has them), response, value
    (mean; of a curve the name of its file, beside the lab file), scatter (standard deviation of one
    replicate; empty = unknown), replicates, unit (must be the vocabulary's), role (calibrate,
    held_out or diagnose). Raises CalibratorError with the number of every line that is wrong and
    the remedy.
    """
    rows = read_rows(path, "lab file", COLUMNS, OPTIONAL)
    observables, mistakes = [], Mistakes()
    for where, cells in rows:
        with mistakes.noted():
            observables.append(_observable(path, where, cells))
    mistakes.note(
        f"{path}: {key} is given more than once; keep one row"
        for key, count in Counter(one.key for one in observables).items()
        if count > 1
    )
    mistakes.raise_any()
    return observables


def read_nuisances(path: Path, observables: list[Observable]) -> list[Nuisance]:
    """Read a nuisance table: nuisance (a name), observables, error, unit.

    Raises CalibratorError with line and remedy.
    """
    found, mistakes = [], Mistakes()
    for where, cells in read_rows(path, "nuisance table", NUISANCES):
        with mistakes.noted():
            found.append(_nuisance(where, cells, observables))
    mistakes.raise_any()
    return found


def _observable(path: Path, where: str, row: dict[str, str]) -> Observable:
    """The observable of one row of the file at path; where : the place that a message names."""
    quantity = MEASURED[known(row["response"], MEASURED, f"response ({where})")]
    if row["unit"] != quantity.unit:
        raise CalibratorError(
            f"{where}: {row['response']} in {row['unit']!r}; convert it to {quantity.unit}"
        )
    curve = None
    if row["response"] in CURVES:
        if row["scatter"]:
            raise CalibratorError(
                f"{where}: the scatter of a curve is a column of its file; leave the cell empty"
            )
        curve = read_curve(named_file(path, row["value"], f"{where}: value"))
    try:
        return Observable(
            row["setup"],
            row["response"],
            curve.level if curve else float(row["value"]),
            float(row["scatter"] or 0.0),
            whole(row["replicates"] or "1"),
            row["role"],
            row.get("condition", ""),
            whole(row.get("days") or "1"),
            curve,
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
    elif found.fixed:
        units = {_fixed_unit(*found.fixed, where)}
    else:
        units = {MEASURED[o.response].unit for o in observables if found.touches(o)}
        if not units:
            raise CalibratorError(
                f"{where}: {found.observables} is the key of no row in the lab file; correct it"
            )
    if (found.unit != "%" and units != {found.unit}) or (found.unit == "%" and found.effect):
        raise CalibratorError(
            f"{where}: unit {found.unit!r}; the error has to be in {' and in '.join(sorted(units))}"
        )
    return found


def _fixed_unit(setup: str, name: str, where: str) -> str:
    """Unit of a parameter that a nuisance calls uncertain.

    Raises CalibratorError for what is none, or no number that a laboratory could be wrong about.
    """
    if setup:
        known(setup, SETUPS, f"set-up ({where})")
    quantity = PARAMETERS[known(name, PARAMETERS, f"parameter ({where})")]
    if quantity.effect:
        raise CalibratorError(f"{where}: {name} is an effect; write effect:{name}")
    if name == "seed" or isinstance(quantity.default, str):
        raise CalibratorError(f"{where}: {name} is nothing that a laboratory could be wrong about")
    return quantity.unit
