"""The section of a report on curves that are targets."""

from __future__ import annotations

import functools

from calibrator.case.experiment import parts_of
from calibrator.case.vocabulary import ACROSS
from calibrator.report.figures.curves import measured_and_simulated
from calibrator.report.findings import Findings
from calibrator.report.html import Album, mark, note, section, table
from calibrator.report.words import (
    file_name,
    in_unit,
    key_words,
    number,
    percent,
    response,
    text,
)
from calibrator.runs.setup import Curve
from calibrator.runs.setups import SETUP_ENTRIES
from calibrator.search.outcome import COMPROMISE
from calibrator.verification.curve import CurveComparison

HEAD = ("curve", "verdict", "off by, root mean square", "of its range", "band", "components", "to")
ABOUT = (
    "A curve counts as one target through its components: a few shapes by which simulated curves"
    " differ from set to set, and one by which the measured curve differs from all of these. It is"
    " met where each of them is; the band is what the curves may then differ by. Points of a curve"
    " are no measurements of their own: their errors hang together."
)


def curves(findings: Findings, album: Album) -> str:
    """Each measured curve with its band, and those of the recommended set's fresh runs."""
    found = [(one, "calibrate") for one in _of_verification(findings)]
    if findings.validation:
        found += [(one, "predict") for one in findings.validation.curves]
    if not found:
        return ""
    rows = [_row(one, use) for one, use in found]
    caption = "Measured curves against those of the recommended set"
    drawn = [_figure(one, album) for one, _ in found if one.difference is not None]
    return section("Curves", table(caption, HEAD, rows), note(ABOUT), *drawn)


def _of_verification(findings: Findings) -> tuple[CurveComparison, ...]:
    """The curves of the recommended set's verification; none where it has not been done."""
    done = findings.verification
    return done.candidates[COMPROMISE].curves if done else ()


def _row(one: CurveComparison, use: str) -> list[str]:
    """A curve's row of the table."""
    off = one.difference
    return [
        text(key_words(one.key)) + in_unit(response(one.key)),
        mark(one.verdict == "met", "met", text(one.verdict.split(",")[0].lower())),
        number(off, 2),
        percent(None if off is None else off / one.span, signed=False, digits=1),
        percent(one.band / one.span, signed=False, digits=1),
        str(one.components),
        use,
    ]


def _figure(one: CurveComparison, album: Album) -> str:
    """The figure of a curve."""
    experiment, name = one.key.split(".")
    caption = (
        f"{key_words(one.key).capitalize()}: measured, with the larger one of tolerance and two"
        f" standard errors as its band, and {len(one.simulated)} fresh runs of the recommended set."
    )
    drawn = functools.partial(measured_and_simulated, one, _axes(experiment, name))
    return album.figure(f"curve_{file_name(one.key)}", caption, drawn)


def _axes(experiment: str, name: str) -> Curve:
    """How a set-up's curve is drawn."""
    setup, _ = parts_of(experiment)
    own = SETUP_ENTRIES[setup].curves
    return next(c for c in own if (c.across, c.up) == (ACROSS[name][setup], name))
