"""The first part of a report: the answer, its warnings, the targets and the candidates."""

from __future__ import annotations

from calibrator.case.problem import Target
from calibrator.case.vocabulary import PARAMETERS
from calibrator.report.calibration import spoken
from calibrator.report.findings import Findings
from calibrator.report.html import Album, mark, note, paragraph, section, table
from calibrator.report.opening import opening
from calibrator.report.overview import overview
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
from calibrator.responses.objectives import OBJECTIVES, costly
from calibrator.search.outcome import COMPROMISE
from calibrator.search.parts import Candidate, ParameterProfile
from calibrator.verification.outcome import Verdict


def answer(findings: Findings, album: Album) -> str:
    """The first screen: what to use, how sure, what is doubtful, and what became of each target."""
    case = findings.space.case
    return "\n".join(
        [
            f"<header><h1>Calibration of {text(words(case.name))}</h1>"
            f"{paragraph(text(case.about), 'about')}</header>",
            section(
                "The answer",
                *_warnings(findings),
                paragraph(_sentences(findings), "answer"),
                opening(findings, album),
                overview(findings),
                _parameters_table(findings),
            ),
            section(
                "What was asked",
                paragraph(question(findings)),
                paragraph(text(objectives(findings)), "small"),
                _targets_table(findings),
            ),
        ]
    )


def question(findings: Findings) -> str:
    """What the case asks, in one sentence."""
    problem = findings.space.case.problem
    held_out = listed([key_words(t.key) for t in problem.held_out])
    return text(
        f"Which {listed([words(n) for n in problem.names])} make YADE reproduce the measured "
        f"{listed([key_words(t.key) for t in problem.targets if t.weight > 0])}"
        + (", with the least computing time?" if _costs(findings) else "?")
        + (f" Held out to test the answer: {held_out}." if held_out else "")
    )


def objectives(findings: Findings) -> str:
    """What the search made small, in a sentence."""
    said = [OBJECTIVES[name] for name in findings.space.case.search.objectives]
    return f"Made small: {listed([f'{one.symbol}, the {one.about}' for one in said])}."


def _costs(findings: Findings) -> bool:
    """Whether the search weighed a cost against the error at all."""
    case = findings.space.case
    return costly(case.problem, case.search.objectives)


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
        number(target.weight) if target.weight else "0 (reported only)",
    ]
    return [heading(target), *numbers, percent(target.tolerance, False, 1), role]


def _warnings(findings: Findings) -> list[str]:
    """What must not be overlooked: targets out of reach, and numbers that are not to be trusted."""
    found = []
    if alarms := findings.calibration.reachability.alarms:
        said = " ".join(spoken(findings, s) for s in alarms)
        found.append(paragraph(text(f"The targets are out of reach. {said}"), "alarm"))
    doubts = [spoken(findings, s) for s in findings.calibration.doubts]
    return [*found, *(paragraph(text(said), "alarm") for said in doubts)]


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
        quantity = PARAMETERS[profile.name]
        said.append(
            f"<b>{text(words(quantity.name))} {text(amount(chosen[quantity.name], quantity))}</b> "
            f"({_interval(profile)})"
        )
    if findings.verification is not None and findings.verification.passed:
        return f"Use {listed(said)}."
    return f"The recommended set is {listed(said)}, <b>not verified</b>."


def _said_verified(findings: Findings) -> str:
    outcome = findings.verification
    if outcome is None:
        return f"It is a promise of the interpolant so far: run {findings.command('verify')}."
    verdict = outcome.candidates[COMPROMISE]
    runs = f"{verdict.good} of {verdict.total} fresh YADE runs"
    if not verdict.good:
        return f"<b>Not verified:</b> no fresh run was good ({text(verdict.endings)})."
    if outcome.passed:
        which = f"{verdict.total} fresh YADE runs" if verdict.good == verdict.total else runs
        return f"<b>Verified:</b> the mean of {which} meets every target."
    if verdict.unreliable:
        return f"<b>Not verified:</b> too many fresh runs failed ({text(verdict.endings)})."
    missed = [key_words(key) + _why_missed(verdict, key) for key in verdict.missed]
    more = (
        "An adaptive design that starts from a copy of database.csv (run.shipped) adds runs where"
        " they decide."
    )
    return f"<b>Not verified:</b> fresh YADE runs miss {text(listed(missed))}. {more}"


def _why_missed(verdict: Verdict, key: str) -> str:
    """What the fresh runs lack where they do not simply miss; empty where they do."""
    if key in verdict.unmeasured:
        return " (not measured)"
    return " (too uncertain to tell: more replicates)" if key in verdict.undecided else ""


def _said_pinned(findings: Findings) -> str:
    found = findings.calibration.identifiability
    if found.refused:
        return (
            "<b>No interval can be given</b>: no parameter set agrees with all targets within the"
            " errors of the measurements."
        )
    profiles = found.parameters
    loose = [words(p.name) for p in profiles if not p.pinned]
    if not loose:
        return "The measurements pin down every parameter."
    return (
        f"The measurements <b>do not pin down</b> {text(listed(loose))} from both sides: other"
        " values are about as good."
    )


def _said_outside(findings: Findings) -> str:
    """Which parameters of the compromise the measurements would refuse; empty for none.

    A compromise may trade agreement for computing time, within the tolerances.
    """
    outside = findings.calibration.outside
    if not outside:
        return ""
    names = text(listed([words(name) for name in outside]))
    why = "To save computing time the" if _costs(findings) else "The"
    return f"{why} recommended set leaves the 95 % interval of {names}."


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
        "The lab is synthetic; from the truth behind it the recommended set is off by"
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
            text(_ends(profile)),
            number(profile.best),
            _range(profile.low, profile.high),
            mark(profile.pinned, "yes", "no"),
        ]
        rows.append(row + [number(profile.truth)] * truth_known)
    head = ["parameter", short(COMPROMISE), "95 % interval", "best fit", "searched", "pinned down"]
    head += ["truth"] * truth_known
    reason = paragraph(text(_reason(findings)), "small")
    return table("Calibrated parameters", head, rows, 1) + reason


def _ends(profile: ParameterProfile) -> str:
    """The 95 % interval, one-sided where a bound of the search ends it."""
    return profile.interval(lambda end: number(end, 3))


def _interval(profile: ParameterProfile) -> str:
    """The same in a sentence."""
    return "no interval" if profile.refused else f"95 %: {_ends(profile)}"


def _range(low: float, high: float) -> str:
    return f"{number(low, 3)} to {number(high, 3)}"


def _reason(findings: Findings) -> str:
    why = findings.in_words(findings.calibration.compromise_reason)
    return (
        f"How the recommended set, the compromise of the front, was chosen: {why}. Intervals come"
        " from the profile likelihood; one that ends where the search ended is one-sided, and pins"
        " nothing down. The best fit ignores the computing time."
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
        "Calibration: the recommended set and individuals, with the errors and objectives that the"
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
