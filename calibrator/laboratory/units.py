"""Units as laboratories write them, and their factors to the contract's SI units."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from calibrator.errors import CalibratorError, shown

MASS, LENGTH, TIME, ANGLE = "kg", "m", "s", "deg"

FACTORS: dict[str, dict[str, float]] = {
    "kg": {"kg": 1.0, "g": 1e-3, "mg": 1e-6, "t": 1e3},
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6},
    "s": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "kg/s": {
        "kg/s": 1.0,
        "g/s": 1e-3,
        "mg/s": 1e-6,
        "g/min": 1e-3 / 60,
        "kg/min": 1 / 60,
        "kg/h": 1 / 3600,
        "t/h": 1e3 / 3600,
    },
    "kg/m3": {
        "kg/m3": 1.0,
        "g/cm3": 1e3,
        "g/ml": 1e3,
        "kg/l": 1e3,
        "kg/dm3": 1e3,
        "t/m3": 1e3,
        "g/l": 1.0,
    },
    "deg": {"deg": 1.0, "rad": 180 / math.pi},
    "1": {"1": 1.0, "%": 0.01},
    "1/m": {"1/m": 1.0, "1/cm": 1e2, "1/mm": 1e3},
    "rpm": {"rpm": 1.0, "1/min": 1.0, "1/s": 60.0},
}
"""What one of each unit is in the SI unit that names its kind."""

_SPELLINGS = {
    "gram": "g",
    "grams": "g",
    "gramm": "g",
    "kilogram": "kg",
    "kilograms": "kg",
    "sec": "s",
    "secs": "s",
    "second": "s",
    "seconds": "s",
    "sekunden": "s",
    "minutes": "min",
    "\N{DEGREE SIGN}": "deg",
    "degree": "deg",
    "degrees": "deg",
}
_NUMBER = r"[+-]?\s*(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(\S.*?)?\s*", re.ASCII | re.DOTALL)


@dataclass(frozen=True)
class Unit:
    """A unit as it was written: the SI unit of its kind, and how many of these it is."""

    written: str
    si: str
    factor: float

    @property
    def converted(self) -> str:
        """What was converted, in words; empty where nothing was."""
        if self.factor == 1:
            return ""
        return f"{self.written} to {self.si} (x {self.factor:.6g})"


def unit_of(text: str, what: str, wanted: str | None = None) -> Unit:
    """The unit that is written.

    Parameters
    ----------
    text : as it stands in a heading, a cell or an option: g, [mm], g/cm^3.
    what : it is the unit of, for messages.
    wanted : SI unit of the kind that it has to be of; None: any.

    Raises
    ------
    CalibratorError : for an unknown unit, and for one of another kind.
    """
    plain = _plain(text)
    kinds = [si for si, known in FACTORS.items() if plain in known]
    possible = (
        sorted(FACTORS[wanted]) if wanted else sorted({u for k in FACTORS.values() for u in k})
    )
    if not kinds:
        raise CalibratorError(
            f"{what}: unknown unit {shown(text)}; write one of {', '.join(possible)}"
        )
    if wanted is not None and kinds[0] != wanted:
        raise CalibratorError(
            f"{what} in {shown(text)}: that is a unit of something else; write one of"
            f" {', '.join(possible)}"
        )
    return Unit(plain, kinds[0], FACTORS[kinds[0]][plain])


def is_unit(text: str) -> bool:
    """Whether this is a unit that is known."""
    plain = _plain(text)
    return any(plain in known for known in FACTORS.values())


def _plain(text: str) -> str:
    """The unit in the spelling of FACTORS where it has one.

    Capitals are read as small letters only where nothing else is meant by them: Mg are no mg.
    """
    plain = text.strip().strip("[]()").strip()
    for old, new in {
        "\N{SUPERSCRIPT THREE}": "3",
        "^": "",
        "**": "",
        "\N{MICRO SIGN}": "u",
        "\N{GREEK SMALL LETTER MU}": "u",
        " ": "",
    }.items():
        plain = plain.replace(old, new)
    plain = _SPELLINGS.get(plain.lower(), plain)
    lower = plain.lower()
    known = any(plain in units for units in FACTORS.values())
    return plain if known or (plain.startswith("M") and lower != "mm") else lower


def number(text: str) -> float:
    """A number with a decimal point or a decimal comma; ValueError where it is none."""
    if not re.fullmatch(_NUMBER, text.strip(), re.ASCII):
        raise ValueError(f"{shown(text)} is no number")
    return float(text.replace(",", ".").replace(" ", ""))


def parts(text: str) -> tuple[float, str]:
    """A number and what follows it; ValueError where no number comes first."""
    found = _QUANTITY.fullmatch(text)
    if not found:
        raise ValueError(f"{shown(text)} is no number")
    return number(found[1]), found[2] or ""


def quantity(text: str, si: str, what: str) -> tuple[float, str]:
    """A quantity as it is written, such as 16 g: in SI, and what was converted, in words.

    Raises CalibratorError where the number or its unit is missing, or the unit is of another kind.
    """
    try:
        value, unit = parts(text)
    except ValueError as error:
        raise CalibratorError(f"{what}: {error}; write a number and its unit") from None
    if not unit:
        raise CalibratorError(
            f"{what} = {shown(text)} has no unit; write one behind it:"
            f" {', '.join(sorted(FACTORS[si]))}"
        )
    found = unit_of(unit, what, si)
    if not math.isfinite(value * found.factor):
        raise CalibratorError(f"{what} = {shown(text)}: give a finite value")
    words = f"{what}: {found.converted}" if found.converted else ""
    return value * found.factor, words
