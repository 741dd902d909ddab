"""Single readings of any response, in the units of whoever took them: the repeats of a row."""

from __future__ import annotations

from pathlib import Path

from calibrator.case.cells import read_rows
from calibrator.case.values import known
from calibrator.case.vocabulary import RESPONSES
from calibrator.errors import CalibratorError, Mistakes
from calibrator.laboratory.outcome import Reading, Value
from calibrator.laboratory.units import number, unit_of

COLUMNS = ("response", "value", "unit")


def read_readings(path: Path) -> tuple[list[Reading], list[str]]:
    """The readings of a table response,value,unit: a row each; and what was converted, in words.

    Raises CalibratorError for each line that is wrong, with what to write.
    """
    found: list[Reading] = []
    converted: dict[str, None] = {}
    mistakes = Mistakes()
    for where, row in read_rows(path, "table of readings", COLUMNS):
        with mistakes.noted():
            quantity = RESPONSES[known(row["response"], RESPONSES, f"response ({where})")]
            unit = unit_of(row["unit"], f"{where}: {quantity.name}", quantity.unit)
            try:
                value = number(row["value"]) * unit.factor
            except ValueError as error:
                raise CalibratorError(f"{where}: {error}; write a plain number") from None
            if unit.converted:
                converted[f"{path.name}: {quantity.name} from {unit.converted}"] = None
            found.append(Reading(where, {quantity.name: Value(value, None, quantity.unit)}))
    mistakes.raise_any()
    if not found:
        raise CalibratorError(f"{path} has no readings; write response,value,unit in each line")
    return found, list(converted)
