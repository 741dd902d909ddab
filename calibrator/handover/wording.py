"""The head that all exported files share: what it is, how far to trust it, what it leaves out."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from calibrator import __version__
from calibrator.case.vocabulary import PARAMETERS, PLAIN_UNITS
from calibrator.handover.chosen import CONTACT, Chosen
from calibrator.handover.names import CALLED
from calibrator.handover.unmapped import unmapped

WIDTH = 98


def head(chosen: Chosen, engine: str, more: Sequence[str] = ()) -> list[str]:
    """Lines of the head, without a comment's sign: origin, standing, values, what is missing.

    more : paragraphs in between, on the engine's own matters.
    """
    yade = ", ".join(chosen.yade) or "not recorded"
    said = [
        f"{chosen.case}: {chosen.label}, for {CALLED[engine]}",
        *([chosen.about] if chosen.about else []),
        f"Calibrated with dem-calibrator {__version__} on YADE {yade}; made again by:"
        f" {chosen.command}",
        chosen.standing.sentence,
        "",
        "Values, in SI units:",
        *(f"  {line}" for line in values(chosen)),
        "",
        *more,
    ]
    missing = unmapped(chosen, engine)
    said += ["", "What of the calibration is not here, or not like this:"] if missing else []
    said += [f"- {sentence}" for sentence in missing]
    return wrapped(said)


def values(chosen: Chosen) -> list[str]:
    """A line for each parameter of the contact, and each effect that is on."""
    lines = []
    for name in (*CONTACT, *chosen.effects):
        quantity, value = PARAMETERS[name], chosen.values[name]
        unit = "" if quantity.unit in ("1", *PLAIN_UNITS) else f" {quantity.unit}"
        shown = value if isinstance(value, str) else f"{value:.8g}"
        origin = "calibrated" if name in chosen.calibrated else "fixed or default"
        lines.append(f"{name} = {shown}{unit} ({origin}): {quantity.about}")
    return lines


def wrapped(lines: Sequence[str]) -> list[str]:
    """The lines, none longer than WIDTH; what is carried over is indented."""
    found = []
    for line in lines:
        lead = " " * (len(line) - len(line.lstrip()))
        pieces = textwrap.wrap(
            line, WIDTH, subsequent_indent=lead + "  ", break_long_words=False,
            break_on_hyphens=False,
        )  # fmt: skip
        found += pieces or [""]
    return found


def commented(lines: Sequence[str], sign: str = "#") -> list[str]:
    """The lines as comments of an input file."""
    return [f"{sign} {line}".rstrip() for line in lines]
