"""Words and numbers as people read them."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

from calibrator.case.problem import Target
from calibrator.case.vocabulary import RESPONSES, Quantity

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


# Words and numbers


def text(words: object) -> str:
    return html.escape(str(words))


def number(value: float | None, digits: int = 4) -> str:
    """A number for people: 0.2314, 1590, 2.9×10⁶; a dash where there is none."""
    if value is None:
        return "–"
    if value == 0 or 1e-3 <= abs(value) < 1e5:
        rounded = f"{value:.{digits}g}"
        return (f"{value:.0f}" if "e" in rounded else rounded).replace("-", "−")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"{mantissa.replace('-', '−')}×10{str(int(exponent)).translate(SUPERSCRIPT)}"


def percent(share: float | None, signed: bool = True, digits: int = 2) -> str:
    if share is None:
        return "–"
    rounded = round(100 * share, digits) + 0.0  # the sum turns -0.0 into 0.0
    return f"{rounded:{'+' if signed and rounded else ''}.{digits}f}\u00a0%".replace(
        "-", "−"
    )  # never broken between number and sign


def with_error(value: float, error: float) -> str:
    """1577 ± 3, 53.5 ± 1.4: the error with one digit, two where the first is 1 or 2, and the value
    with as many decimals.
    """
    if error <= 0:
        return number(value)
    exponent = math.floor(math.log10(error))
    decimals = max(0, (1 if error < 3 * 10**exponent else 0) - exponent)
    return f"{value:.{decimals}f} ± {error:.{decimals}f}".replace("-", "−")


def unit(quantity: Quantity) -> str:
    return {"1": "", "deg": "°", "kg/m3": "kg/m³"}.get(quantity.unit, quantity.unit)


def amount(value: float, quantity: Quantity, digits: int = 3) -> str:
    symbol = unit(quantity)
    return f"{number(value, digits)}{'' if symbol in ('', '°') else ' '}{symbol}"


def axis_label(quantity: Quantity) -> str:
    """Axis label with the unit as it is printed."""
    return quantity.label.replace("[kg/m3]", "[kg/m³]").replace("[deg]", "[°]")


def words(name: str) -> str:
    return name.removesuffix("_deg").replace("_", " ")


def response(key: str) -> Quantity:
    return RESPONSES[key.split(".")[1]]


def key_words(key: str) -> str:
    setup, response = key.split(".")
    return f"{words(response)} ({words(setup)})"


def listed(words: Sequence[str]) -> str:
    """a, b and c."""
    return (
        words[0]
        if len(words) == 1
        else ", ".join(words[:-1]) + " and " + words[-1]
        if words
        else ""
    )


def in_unit(quantity: Quantity) -> str:
    return f" [{text(unit(quantity))}]" if unit(quantity) else ""


def heading(target: Target) -> str:
    return text(key_words(target.key)) + in_unit(response(target.key))


def short(candidate: str) -> str:
    return text(candidate.removeprefix("individual "))
