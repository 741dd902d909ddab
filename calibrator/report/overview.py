"""The table that a report opens with: what became of every target."""

from __future__ import annotations

import math

from calibrator.case.problem import Target
from calibrator.report.findings import Findings
from calibrator.report.html import mark, note, table
from calibrator.report.words import heading, number, percent, with_error
from calibrator.search.outcome import COMPROMISE
from calibrator.search.parts import Promise
from calibrator.verification.outcome import Comparison

HEAD = (
    "response",
    "verdict",
    "measured",
    "simulated",
    "off by",
    "in standard errors",
    "good runs",
    "used to",
)


def overview(findings: Findings) -> str:
    """Every target: measured, simulated, deviation over its error, met or not, good runs of all.

    Where fresh runs have not been made it says what the interpolant promises instead.
    """
    problem, rows = findings.space.case.problem, []
    promised = findings.calibration.compromise.predicted
    verified = findings.verification and findings.verification.candidates[COMPROMISE].responses
    for i, target in enumerate(problem.targets):
        if verified:
            rows.append(_compared(target, verified[i], "calibrate"))
        else:
            rows.append(_promised(target, promised[target.key]))
    for i, target in enumerate(problem.held_out):
        if findings.validation is None:
            rows.append([heading(target), "–", _measured(target), *"––––", "predict"])
        else:
            rows.append(_compared(target, findings.validation.responses[i], "predict"))
    caption = "Measured, and simulated at the recommended set"
    words = (
        "Means and their standard errors. A target is met within its tolerance or two standard"
        " errors of the difference, whichever is more."
    )
    if not verified:
        words = f"Simulated: promised by the interpolant, not yet by fresh runs. {words}"
    return table(caption, HEAD, rows) + note(words)


def _measured(target: Target) -> str:
    if not target.standard_error:
        return number(target.value)
    return with_error(target.value, target.standard_error)


def _compared(target: Target, found: Comparison, use: str) -> list[str]:
    """The row of a target that fresh runs were made for."""
    runs = f"{found.runs} of {found.attempted}"
    if found.simulated is None:
        verdict = mark(False, "met", "not measured")
        return [heading(target), verdict, _measured(target), "–", "–", "–", runs, use]
    error = found.standard_error
    shown = number(found.simulated) if error is None else with_error(found.simulated, error)
    if found.reported_only:
        verdict = "reported only"
    else:
        word = "cannot tell" if found.undecided else "missed"
        verdict = mark(found.passed, "met", word, found.undecided)
    return [
        heading(target),
        verdict,
        _measured(target),
        shown,
        percent(found.relative_error, digits=1),
        _in_errors(found.simulated - found.target, found.target_error, error),
        runs,
        use,
    ]


def _promised(target: Target, promise: Promise) -> list[str]:
    """The row of a target that the interpolant alone speaks of."""
    return [
        heading(target),
        "–",
        _measured(target),
        with_error(promise.mean, promise.error),
        percent((promise.mean - target.value) / target.scale, digits=1),
        _in_errors(promise.mean - target.value, target.standard_error, promise.error),
        "–",
        "calibrate",
    ]


def _in_errors(difference: float, *errors: float | None) -> str:
    """A difference over its standard error; a dash where one of the errors is unknown."""
    both = math.hypot(*(e or 0.0 for e in errors))
    return "–" if not both or None in errors else f"{difference / both:+.1f}"
