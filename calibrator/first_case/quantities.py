"""Single answers: numbers with units, sieve fractions, repeats, in SI."""

from __future__ import annotations

import math
import re
from typing import Any

from calibrator.case.toml import PLAIN_WORD
from calibrator.case.vocabulary import PARAMETERS
from calibrator.errors import CalibratorError, Mistakes, shown
from calibrator.laboratory.units import parts, quantity, unit_of


class Reader:
    """Reads quantities, and keeps what was converted and what was assumed."""

    def __init__(self) -> None:
        self.converted: dict[str, None] = {}
        self.assumed: list[str] = []
        self.mistakes = Mistakes()

    def si(self, value: Any, unit: str, what: str) -> float:
        """A quantity in SI; plain numbers are allowed only for what has no unit."""
        if unit == "1" and isinstance(value, (int, float)) and not isinstance(value, bool):
            return float(value)
        found, words = quantity(as_text(value), unit, what)
        if words:
            self.converted[words] = None
        return found


def speed_of(value: Any) -> float:
    """A speed [m/s]."""
    found = re.fullmatch(r"\s*([^/]+)/\s*s\s*", as_text(value))
    if not found:
        raise CalibratorError(f"lift_speed = {shown(as_text(value))}: write it as '20 mm/s'")
    return quantity(found[1], "m", "lift_speed")[0]


def repeats_of(text: str) -> list[str]:
    """Repeats between semicolons or commas and spaces; the last one's unit serves for all."""
    cells = [cell for cell in re.split(r";\s*|,\s+", text) if cell.strip()]
    try:
        _, unit = parts(cells[-1]) if cells else (0.0, "")
    except ValueError:
        unit = ""
    return [c if _has_unit(c) else f"{c} {unit}" for c in cells] or [text]


def _has_unit(text: str) -> bool:
    try:
        return bool(parts(text)[1])
    except ValueError:
        return True


def plain_word(text: str) -> str:
    """A name that can be one of a file."""
    if not re.fullmatch(PLAIN_WORD, text):
        raise CalibratorError(
            f"name = {shown(text)}: give a plain word of letters, digits and _, such as my_sand"
        )
    return text


def sizes_of(reader: Reader, text: str) -> tuple[float, float]:
    """Mean diameter and coefficient of variation of one size or of a sieve fraction `1.6-2.0 mm`.

    Within a fraction all diameters count as equally frequent.
    """
    ends = re.fullmatch(r"\s*([\d.,]+)\s*(?:-|\N{EN DASH}|to)\s*([\d.,]+)\s*(\D.*)", text)
    if not ends:
        return positive(reader.si(text, "m", "grain_diameter"), "grain_diameter"), 0.0
    unit_of(ends[3], "grain_diameter", "m")
    low, high = (reader.si(f"{e} {ends[3]}", "m", "grain_diameter") for e in ends.groups()[:2])
    if not 0 < low <= high:
        raise CalibratorError(f"grain_diameter = {shown(text)}: give the smaller size first")
    mean = 0.5 * (low + high)
    return mean, float((high - low) / math.sqrt(12) / mean)


def restitution_of(reader: Reader, value: Any) -> float | None:
    """A coefficient of restitution that the scripts take; None where none is given."""
    if value in (None, ""):
        return None
    quantity_of = PARAMETERS["restitution"]
    found = reader.si(plain_number(value, "restitution"), "1", "restitution")
    if not quantity_of.low <= found <= quantity_of.high:  # type: ignore[operator]
        raise CalibratorError(
            f"restitution = {found:g}: give {quantity_of.low:g} to {quantity_of.high:g}"
        )
    return found


def budget_of(value: Any) -> float:
    """Core-hours."""
    found = plain_number(value, "budget")
    if not 0 < found <= 1e6:
        raise CalibratorError(f"budget = {found:g}: give a positive number of core-hours")
    return found


def rate_of(value: Any) -> float | None:
    """Particle-steps a second and core; None where none is given."""
    if value in (None, ""):
        return None
    found = plain_number(value, "particle_steps_per_second")
    if not 1e3 <= found <= 1e9:
        raise CalibratorError(f"particle_steps_per_second = {found:g}: give 1e3 to 1e9")
    return found


def plain_number(value: Any, what: str) -> float:
    """A number without a unit."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise CalibratorError(f"{what} = {shown(str(value))}: give a plain number") from None


def positive(value: float, what: str) -> float:
    """The value, if it is positive."""
    if value <= 0:
        raise CalibratorError(f"{what} = {value:g}: give a positive value")
    return value


def as_text(value: Any) -> str:
    """An answer as text."""
    return str(value).strip()
