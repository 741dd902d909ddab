"""Words and numbers as people read them."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

from calibrator.case.experiment import parts_of
from calibrator.case.problem import Target
from calibrator.case.vocabulary import QUANTITIES, Quantity
from calibrator.runs.record import Record

PEOPLE = {
    "young modulus": "Young's modulus",
    "poisson ratio": "Poisson's ratio",
    "rayleigh fraction": "Rayleigh fraction",
}
"""Names of people, who write themselves with a capital."""


def text(words: object) -> str:
    """Words with the characters that HTML takes for itself escaped."""
    return html.escape(str(words))


def number(value: float | None, digits: int = 4) -> str:
    """A number that stays one when it is copied: 0.2314, 1590, 2.9e6; a dash where there is none.

    >>> number(0.23138), number(-2.9e6, 2), number(None)
    ('0.2314', '-2.9e6', '–')
    """
    if value is None:
        return "–"
    if value == 0 or 1e-3 <= abs(value) < 1e5:
        rounded = f"{value:.{digits}g}"
        return f"{value:.0f}" if "e" in rounded else rounded
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"{mantissa}e{int(exponent)}"


def percent(share: float | None, signed: bool = True, digits: int = 2) -> str:
    """A share in per cent, with its sign where that is asked for; a dash where there is none."""
    if share is None:
        return "–"
    rounded = round(100 * share, digits) + 0.0  # the sum turns -0.0 into 0.0
    sign = "+" if signed and rounded else ""
    # a space at which no line is broken
    return f"{rounded:{sign}.{digits}f}\u00a0%"


def with_error(value: float, error: float) -> str:
    """A value and its error as people write them.

    The error has one digit, two where the first is 1 or 2, and the value as many decimals.

    >>> with_error(1577.2, 3.4), with_error(53.51, 1.42)
    ('1577 ± 3', '53.5 ± 1.4')
    """
    if error <= 0:
        return number(value)
    exponent = math.floor(math.log10(error))
    decimals = max(0, (1 if error < 3 * 10**exponent else 0) - exponent)
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


def unit(quantity: Quantity) -> str:
    """The unit as it is printed; empty for a plain number."""
    return {"1": "", "deg": "°", "kg/m3": "kg/m³"}.get(quantity.unit, quantity.unit)


def amount(value: float, quantity: Quantity, digits: int = 3) -> str:
    """A value with its unit."""
    symbol = unit(quantity)
    return f"{number(value, digits)}{'' if symbol in ('', '°') else ' '}{symbol}"


def axis_label(quantity: Quantity) -> str:
    """Axis label with the unit as it is printed."""
    label = quantity.label.replace("[kg/m3]", "[kg/m³]").replace("[deg]", "[°]")
    for plain, named in PEOPLE.items():
        label = label.replace(plain, named)
    return label


def words(name: str) -> str:
    """A name of the vocabulary in words.

    >>> words("pile_angle_of_repose_deg"), words("young_modulus")
    ('pile angle of repose', "Young's modulus")
    """
    plain = name.removesuffix("_deg").replace("_", " ")
    return PEOPLE.get(plain, plain)


def response(key: str) -> Quantity:
    """What the vocabulary says of a response; key : experiment.response."""
    return QUANTITIES[key.split(".")[1]]


def experiment_words(experiment: str) -> str:
    """An experiment in words.

    >>> experiment_words("hourglass@wide_neck")
    'hourglass, wide neck'
    """
    setup, condition = parts_of(experiment)
    return f"{words(setup)}, {condition.replace('_', ' ')}" if condition else words(setup)


def key_words(key: str) -> str:
    """A key in words: response (set-up), or response (set-up, condition)."""
    experiment, response = key.split(".")
    return f"{words(response)} ({experiment_words(experiment)})"


def file_name(key: str) -> str:
    """A key, or an experiment, in the name of a file: without a dot or an at sign."""
    return key.replace(".", "_").replace("@", "_")


def listed(words: Sequence[str]) -> str:
    """Words as a list in a sentence.

    >>> listed(["a", "b", "c"])
    'a, b and c'
    """
    if len(words) < 2:
        return "".join(words)
    return ", ".join(words[:-1]) + " and " + words[-1]


def in_unit(quantity: Quantity) -> str:
    """The unit in brackets, as HTML; empty for a plain number."""
    return f" [{text(unit(quantity))}]" if unit(quantity) else ""


def heading(target: Target) -> str:
    """A target's response in words with its unit, as HTML."""
    return text(key_words(target.key)) + in_unit(response(target.key))


def distinct(records: Sequence[Record], key: str) -> str:
    """All values that the runs' records have for a key of their provenance."""
    found = {str(r.provenance[key]) for r in records if r.provenance.get(key)}
    return ", ".join(sorted(found)) or "not recorded"


def called(candidate: str) -> str:
    """A candidate in words, as HTML."""
    return "recommended set" if candidate == "compromise" else text(candidate)


def short(candidate: str) -> str:
    """A candidate's label in a narrow column, as HTML.

    >>> short("compromise"), short("individual A")
    ('recommended (compromise)', 'A')
    """
    if candidate == "compromise":
        return "recommended (compromise)"
    return text(candidate.removeprefix("individual "))
