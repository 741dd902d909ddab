"""What full and cheap runs said, as the report shows it."""

from __future__ import annotations

from calibrator.report.figures.fidelity import Pairs, both_kinds
from calibrator.report.findings import Findings
from calibrator.report.html import Album, paragraph, table
from calibrator.report.words import axis_label, in_unit, key_words, number, percent, response, text
from calibrator.responses.fidelities import both_ways
from calibrator.responses.fit import cheap_runs
from calibrator.responses.table import response_table
from calibrator.search.two_kinds import TwoKinds

HEAD = (
    "target",
    "full runs",
    "cheap runs",
    "slope",
    "full less cheap",
    "discrepancy",
    "error with cheap",
    "and without",
)


def two_kinds(findings: Findings, album: Album) -> str:
    """Full against cheap runs for each target; empty where the case has no cheap ones."""
    kinds = findings.calibration.fidelity
    if not kinds:
        return ""
    return (
        paragraph(text(_said(kinds)))
        + table("Full and cheap runs", HEAD, [_row(one) for one in kinds])
        + album.figure(
            "fidelity",
            "Mean responses of full runs over those of cheap ones, at the sets that were run both"
            " ways. The line has the slope of the model; what strays from it is discrepancy and"
            " noise.",
            lambda: both_kinds(_pairs(findings)),
            _seen(kinds),
        )
    )


def _said(kinds: tuple[TwoKinds, ...]) -> str:
    cost = percent(kinds[0].cost, signed=False, digits=0)
    said = (
        f"Full runs lean on cheap ones, each of which costs {cost} of a full one: a response is"
        " modelled as slope times the cheap one plus a discrepancy. The errors are those at full"
        " sets that were left out, with the cheap runs and without."
    )
    if misleading := [key_words(one.key) for one in kinds if one.misleads]:
        said += (
            f" The cheap runs mislead about {' and '.join(misleading)}: full runs are better"
            " predicted without them, and they are not used there."
        )
    return said


def _row(kinds: TwoKinds) -> list[str]:
    quantity = response(kinds.key)
    strays = None if kinds.misleads else kinds.discrepancy
    lengths = (kinds.difference, strays, kinds.error_with, kinds.error_without)
    slope = "not used" if kinds.misleads else f"{kinds.slope:.2f}"
    cells = [str(kinds.full), str(kinds.cheap), slope, *(number(one, 3) for one in lengths)]
    return [text(key_words(kinds.key)) + in_unit(quantity), *map(text, cells)]


def _seen(kinds: tuple[TwoKinds, ...]) -> str:
    """The finding in a sentence, for who cannot see the figure."""
    said = [
        f"{key_words(one.key)}: cheap runs not used"
        if one.misleads
        else f"{key_words(one.key)}: slope {one.slope:.2f}"
        for one in kinds
    ]
    return f"{'; '.join(said)}."


def _pairs(findings: Findings) -> list[Pairs]:
    """Cheap and full means of each response at the sets that were run both ways."""
    case, keys = findings.space.case, findings.interpolant.responses
    cheap = cheap_runs(case, findings.cheap)
    assert cheap is not None
    full = response_table(case.problem, findings.records, keys)
    low, high = both_ways(*full, cheap.points, cheap.values)
    slopes = {one.key: one.slope for one in findings.calibration.fidelity}
    return [
        Pairs(axis_label(response(key)), low[:, i], high[:, i], slopes[key])
        for i, key in enumerate(keys)
    ]
