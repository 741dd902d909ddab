"""The first part of a report: the answer, its warnings, the targets and the candidates."""

from __future__ import annotations

from calibrator.case.problem import Target
from calibrator.case.vocabulary import PARAMETERS
from calibrator.report.calibration import spoken
from calibrator.report.findings import Findings
from calibrator.report.html import Album, mark, note, paragraph, section, table
from calibrator.report.words import (
    amount,
    heading,
    in_unit,
    key_words,
    listed,
    number,
    percent,
    short,
    text,
    words,
)
from calibrator.responses.objectives import OBJECTIVES
from calibrator.search.outcome import COMPROMISE
from calibrator.search.parts import Candidate


def answer(findings: Findings, album: Album) -> str:
    """The first screen: question, three sentences, warnings, and the parameters in a table."""
    case = findings.space.case
    return "\n".join(
        [
            f"<header><h1>Calibration of {text(words(case.name))}</h1>"
            f"{paragraph(text(case.about), 'about')}</header>",
            section("What was asked", paragraph(question(findings)), _targets_table(findings)),
            section(
                "The answer",
                *_warnings(findings),
                paragraph(_sentences(findings), "answer"),
                _parameters_table(findings),
            ),
        ]
    )


def question(findings: Findings) -> str:
    """What the case asks, in one sentence."""
    problem = findings.space.case.problem
    held_out = listed([key_words(t.key) for t in problem.held_out])
    return text(
        f"Which {listed([words(n) for n in problem.names])} make YADE reproduce the measured "
        f"{listed([key_words(t.key) for t in problem.targets])}, with the least computing time?"
        + (f" Held out to test the answer: {held_out}." if held_out else "")
    )


def _targets_table(findings: Findings) -> str:
    problem = findings.space.case.problem
    used = [_target_row(t, "calibrate") for t in problem.targets]
    rows = used + [_target_row(t, "held out") for t in problem.held_out]
    head = ["response", "measured", "scatter of one", "repeats", "weight", "tolerance", "role"]
    return table("Measured responses", head, rows)


def _target_row(target: Target, role: str) -> list[str]:
    numbers = [
        number(target.value),
        number(target.scatter or None),
        str(target.replicates),
        number(target.weight),
    ]
    return [heading(target), *numbers, percent(target.tolerance, False, 1), role]


def _warnings(findings: Findings) -> list[str]:
    """What must not be overlooked: targets out of reach."""
    if not (alarms := findings.calibration.reachability.alarms):
        return []
    said = " ".join(spoken(findings, s) for s in alarms)
    return [paragraph(text(f"The targets are out of reach. {said}"), "alarm")]


def _sentences(findings: Findings) -> str:
    """The answer: values, verification, and what is doubtful."""
    return " ".join(
        said(findings)
        for said in (_said_values, _said_verified, _said_pinned, _said_outside, _said_truth)
    )


def _said_values(findings: Findings) -> str:
    chosen = findings.calibration.compromise.parameters
    said = []
    for profile in findings.calibration.identifiability.parameters:
        quantity, (low, high) = PARAMETERS[profile.name], profile.interval_95
        said.append(
            f"<b>{text(words(quantity.name))} {text(amount(chosen[quantity.name], quantity))}</b> "
            f"(95 %: {number(low, 3)} to {number(high, 3)})"
        )
    return f"Use {listed(said)}."


def _said_verified(findings: Findings) -> str:
    outcome = findings.verification
    if outcome is None:
        return (
            "This is a promise of the interpolant, <b>not verified yet</b>: run"
            f" {findings.command('verify')}."
        )
    verdict = outcome.candidates[COMPROMISE]
    runs = f"{verdict.good} of {verdict.total} fresh YADE runs"
    if not verdict.good:
        return f"<b>Not verified:</b> no fresh run was good ({text(verdict.endings)})."
    if outcome.passed:
        which = f"{verdict.total} fresh YADE runs" if verdict.good == verdict.total else runs
        return f"<b>Verified:</b> the mean of {which} meets every target."
    if verdict.unreliable:
        return f"<b>Not verified:</b> too many fresh runs failed ({text(verdict.endings)})."
    missed = [
        key_words(key) + (" (not measured)" if key in verdict.unmeasured else "")
        for key in verdict.missed
    ]
    more = (
        "An adaptive design that starts from a copy of database.csv (run.shipped) adds runs where"
        " they decide."
    )
    return f"<b>Not verified:</b> fresh YADE runs miss {text(listed(missed))}. {more}"


def _said_pinned(findings: Findings) -> str:
    profiles = findings.calibration.identifiability.parameters
    loose = [words(p.name) for p in profiles if not p.pinned]
    if not loose:
        return "The measurements pin down every parameter."
    return (
        f"The measurements <b>do not pin down</b> {text(listed(loose))}: other values are about as"
        " good."
    )


def _said_outside(findings: Findings) -> str:
    """Which parameters of the compromise the measurements would refuse; empty for none.

    A compromise may trade agreement for computing time.
    """
    outside = findings.calibration.outside
    if not outside:
        return ""
    names = text(listed([words(name) for name in outside]))
    return f"To save computing time the compromise leaves the 95 % interval of {names}."


def _said_truth(findings: Findings) -> str:
    """How far the compromise is from the truth of a synthetic lab; empty for a real one."""
    chosen = findings.calibration.compromise.parameters
    off = [
        f"{words(p.name)} {percent(chosen[p.name] / p.truth - 1, digits=1)}"
        for p in findings.calibration.identifiability.parameters
        if p.truth
    ]
    if not off:
        return ""
    return (
        "The lab is synthetic; from the truth behind it the compromise is off by"
        f" {text(listed(off))}."
    )


def _parameters_table(findings: Findings) -> str:
    chosen = findings.calibration.compromise.parameters
    profiles = findings.calibration.identifiability.parameters
    truth_known = any(p.truth is not None for p in profiles)
    rows = []
    for profile in profiles:
        row = [
            text(words(profile.name)) + in_unit(PARAMETERS[profile.name]),
            number(chosen[profile.name]),
            _range(*profile.interval_95),
            number(profile.best),
            _range(profile.low, profile.high),
            mark(profile.pinned, "yes", "no"),
        ]
        rows.append(row + [number(profile.truth)] * truth_known)
    head = ["parameter", "compromise", "95 % interval", "best fit", "searched", "pinned down"]
    head += ["truth"] * truth_known
    reason = paragraph(text(_reason(findings)), "small")
    return table("Calibrated parameters", head, rows, 1) + reason


def _range(low: float, high: float) -> str:
    return f"{number(low, 3)} to {number(high, 3)}"


def _reason(findings: Findings) -> str:
    return (
        f"How the compromise was chosen: {findings.calibration.compromise_reason}. Intervals"
        " come from the profile likelihood; one that ends where the search ended is set by the"
        " bounds, not by the measurements. The best fit ignores the computing time."
    )


# Tables of the candidates


def candidates_table(findings: Findings, album: Album) -> str:
    """Compromise and individuals with what they promise, like the paper's Table 6."""
    found, problem = findings.candidates, findings.space.case.problem
    rows = [
        [
            text(words(n)) + in_unit(PARAMETERS[n]),
            *(number(c.parameters[n]) for c in found.values()),
        ]
        for n in problem.names
    ]
    rows += [
        [f"error of {text(key_words(t.key))}", *(_promised_error(t, c) for c in found.values())]
        for t in problem.targets
    ]
    for name in findings.calibration.compromise.objectives:
        symbol = OBJECTIVES[name].symbol
        rows.append(
            [
                f"{text(symbol)} ({text(words(name))})",
                *(number(c.objectives[name]) for c in found.values()),
            ]
        )
    caption = (
        "Calibration: compromise and individuals, with the errors and objectives that the"
        " interpolant promises"
    )
    meaning = "Errors are (predicted − target) / target ± one standard error of the interpolant."
    return section(
        "Candidates on the front", table(caption, ["", *map(short, found)], rows, 1), note(meaning)
    )


def _promised_error(target: Target, candidate: Candidate) -> str:
    promised = candidate.predicted[target.key]
    error = percent((promised.mean - target.value) / target.scale).removesuffix("\u00a0%")
    return f"{error} ± {100 * promised.error / target.scale:.2f} %"
