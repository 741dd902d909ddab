"""Single values and names: of the right type, within their range, spelt as the vocabulary does."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable
from typing import Any

from calibrator.case.vocabulary import PARAMETERS
from calibrator.errors import CalibratorError, shown

Value = float | int | str
LARGEST, SMALLEST = 1e30, 1e-30
"""Magnitudes of a measured value: no bulk response lies outside, and its square is a float."""


def known(name: str, names: Iterable[str], what: str) -> str:
    """Return name if it is one of names, else raise CalibratorError with the nearest spelling."""
    names = list(names)
    if name in names:
        return name
    close = (
        difflib.get_close_matches(name, names, 1)
        if isinstance(name, str) and len(name) < 100
        else []
    )
    hint = f"did you mean {close[0]}?" if close else "use one of " + ", ".join(names)
    raise CalibratorError(f"unknown {what} {shown(name)}: {hint}")


def is_number(value: Any) -> bool:
    """Whether a value is an integer or a finite float.

    True and False are not, though Python counts them as integers.
    """
    return (isinstance(value, int) and not isinstance(value, bool)) or (
        isinstance(value, float) and math.isfinite(value)
    )


_NUMBER = r"[0-9]{1,12}(?:\.[0-9]{1,12})?(?:e-?[0-9]{1,2})?"
SIZES = re.compile(r"%s:%s(?:\|%s:%s){0,49}" % ((_NUMBER,) * 4), re.ASCII)
"""A size distribution as it stands in a table's cell, which YADE evaluates as Python."""


def checked_sizes(name: str, value: Any) -> str:
    """A size distribution, "" where grains have one size.

    Positive diameters that rise within a factor of ten, and positive shares of the number; else
    CalibratorError.
    """
    text = value if isinstance(value, str) else ""
    if value == "":
        return ""
    if SIZES.fullmatch(text):
        pairs = [[float(number) for number in part.split(":")] for part in text.split("|")]
        diameters = [diameter for diameter, _ in pairs]
        rising = diameters == sorted(set(diameters)) and diameters[-1] <= 10 * diameters[0]
        if rising and 0 < diameters[0] < math.inf and min(share for _, share in pairs) > 0:
            return text
    raise CalibratorError(
        f"{name} = {shown(value)}: give up to 50 rising diameters within a factor of ten, each with"
        ' its share of the number, such as "1.05:0.2|1.1:0.5|1.2:0.3"'
    )


def checked_value(name: str, value: Any) -> Value:
    """A parameter value of the right type within the contract's range, else CalibratorError."""
    quantity = PARAMETERS[known(name, PARAMETERS, "parameter")]
    if quantity.unit == "sizes":
        return checked_sizes(name, value)
    if quantity.choices is not None:
        if value not in quantity.choices:
            raise CalibratorError(
                f"{name} = {shown(value)}: choose one of {', '.join(quantity.choices)}"
            )
        return str(value)
    if not is_number(value):
        raise CalibratorError(f"{name} = {shown(value)}: give a finite number in {quantity.unit}")
    assert quantity.low is not None and quantity.high is not None
    if not quantity.low <= value <= quantity.high:
        raise CalibratorError(
            f"{name} = {shown(value)}: give a value from {quantity.low:g} to {quantity.high:g}"
            f" {quantity.unit}"
        )
    if quantity.unit == "integer" and value != int(value):
        raise CalibratorError(f"{name} = {value!r}: give a whole number")
    return int(value) if quantity.unit == "integer" else float(value)
