"""One page that says what was asked, what came out and how far to trust it. Self-contained HTML, figures embedded."""

from __future__ import annotations

import csv
import importlib.metadata
import platform
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from calibrator import __version__
from calibrator.errors import CalibratorError
from calibrator.files import read_text, write_text
from calibrator.findings import Findings
from calibrator.objectives import OBJECTIVES
from calibrator.page import (
    Album,
    amount,
    heading,
    in_unit,
    key_words,
    listed,
    mark,
    note,
    number,
    page,
    paragraph,
    percent,
    section,
    short,
    table,
    text,
    words,
)
from calibrator.problem import Target
from calibrator.quantities import PARAMETERS, STATUSES
from calibrator.records import Record
from calibrator.report_calibration import calibration, spoken
from calibrator.report_runs import pictures, validation, verification
from calibrator.workflow import (
    Workspace,
)

PACKAGES = ("numpy", "scipy", "scikit-learn", "pymoo", "matplotlib")


def write_report(space: Workspace) -> dict[str, Any]:
    """Write report.html and its figures into the folder of the results.

    The interpolant and the search are made anew from the database (they are deterministic); everything else is read from
    the summary that the verbs left. Steps that have not been done are named with the command that does them.

    Returns {"page": path, "figures": paths}. Raises CalibratorError where `calibrate` has not been done.
    """
    findings = Findings.of(space)
    folder = space.folder("figures")
    for old in folder.glob("*.png"):
        old.unlink()
    album = Album(folder)
    whole = page(f"Calibration of {space.case.name}", [make(findings, album) for make in SECTIONS])
    path = space.path / "report.html"
    write_text(path, whole)
    return space.note("report", {"page": str(path), "figures": [str(p) for p in album.paths]})


# What was asked, and the answer


def _answer(findings: Findings, album: Album) -> str:
    """The first screen: question, three sentences, warnings, and the parameters in a table."""
    case = findings.space.case
    return "\n".join(
        [
            f"<header><h1>Calibration of {text(words(case.name))}</h1>{paragraph(text(case.about), 'about')}</header>",
            section("What was asked", paragraph(_question(findings)), _targets_table(findings)),
            section("The answer", *_warnings(findings), paragraph(_sentences(findings), "answer"), _parameters_table(findings)),
        ]
    )


def _question(findings: Findings) -> str:
    problem = findings.space.case.problem
    held_out = listed([key_words(t.key) for t in problem.held_out])
    return text(
        f"Which {listed([words(n) for n in problem.names])} make YADE reproduce the measured "
        f"{listed([key_words(t.key) for t in problem.targets])}, with the least computing time?"
        + (f" Held out to test the answer: {held_out}." if held_out else "")
    )


def _targets_table(findings: Findings) -> str:
    problem = findings.space.case.problem
    rows = [_target_row(t, "calibrate") for t in problem.targets] + [_target_row(t, "held out") for t in problem.held_out]
    head = ["response", "measured", "scatter of one", "repeats", "weight", "tolerance", "role"]
    return table("Measured responses", head, rows)


def _target_row(target: Target, role: str) -> list[str]:
    numbers = [number(target.value), number(target.scatter or None), str(target.replicates), number(target.weight)]
    return [heading(target), *numbers, percent(target.tolerance, False, 1), role]


def _warnings(findings: Findings) -> list[str]:
    """What must not be overlooked: unreachable targets, and predictions that no longer belong to the database."""
    reach = findings.calibration["reachability"]
    alarms = []
    if not reach["all"]:
        missed = [s for s in reach["sentences"] if "cannot" in s]
        alarms.append("The targets are out of reach. " + " ".join(spoken(findings, s) for s in missed))
    if findings.stale:
        alarms.append("The database has changed since the calibration: run `calibrator calibrate` again before using this page.")
    return [paragraph(text(alarm), "alarm") for alarm in alarms]


def _sentences(findings: Findings) -> str:
    return " ".join(said(findings) for said in (_said_values, _said_verified, _said_pinned, _said_outside, _said_truth))


def _said_values(findings: Findings) -> str:
    chosen = findings.candidates["compromise"]["parameters"]
    said = []
    for profile in findings.calibration["identifiability"]["parameters"]:
        quantity, (low, high) = PARAMETERS[profile["name"]], profile["interval_95"]
        said.append(
            f"<b>{text(words(quantity.name))} {text(amount(chosen[quantity.name], quantity))}</b> "
            f"(95 %: {number(low, 3)} to {number(high, 3)})"
        )
    return f"Use {listed(said)}."


def _said_verified(findings: Findings) -> str:
    outcome = findings.outcome("verify")
    if outcome is None:
        return f"This is a promise of the interpolant, <b>not verified yet</b>: run {findings.command('verify')}."
    rows = outcome["candidates"]["compromise"]["responses"]
    missed = [key_words(r["key"]) for r in rows if not r["passed"]]
    if not rows:
        return "The verification <b>failed</b>: no fresh run of the compromise was good."
    if outcome["passed"]:
        return f"<b>Verified:</b> the mean of {rows[0]['runs']} fresh YADE runs meets every target."
    more = "An adaptive design that starts from a copy of database.csv (run.shipped) adds runs where they decide."
    return f"<b>Not verified:</b> fresh YADE runs miss {text(listed(missed))}. {more}"


def _said_pinned(findings: Findings) -> str:
    profiles = findings.calibration["identifiability"]["parameters"]
    loose = [words(p["name"]) for p in profiles if not p["pinned"]]
    if not loose:
        return "The measurements pin down every parameter."
    return f"The measurements <b>do not pin down</b> {text(listed(loose))}: other values are about as good."


def _said_outside(findings: Findings) -> str:
    """Which parameters of the compromise the measurements would refuse: it may trade agreement for computing time."""
    chosen = findings.candidates["compromise"]["parameters"]
    profiles = findings.calibration["identifiability"]["parameters"]
    outside = [p["name"] for p in profiles if not p["interval_95"][0] <= chosen[p["name"]] <= p["interval_95"][1]]
    names = text(listed([words(name) for name in outside]))
    return f"To save computing time the compromise leaves the 95 % interval of {names}." if outside else ""


def _said_truth(findings: Findings) -> str:
    """How far the compromise is from the parameters behind a synthetic lab; empty for a real one."""
    chosen = findings.candidates["compromise"]["parameters"]
    off = [
        f"{words(p['name'])} {percent(chosen[p['name']] / p['truth'] - 1, digits=1)}"
        for p in findings.calibration["identifiability"]["parameters"]
        if p["truth"]
    ]
    return f"The lab is synthetic; from the truth behind it the compromise is off by {text(listed(off))}." if off else ""


def _parameters_table(findings: Findings) -> str:
    problem, chosen = findings.space.case.problem, findings.candidates["compromise"]["parameters"]
    truth_known = any(p["truth"] is not None for p in findings.calibration["identifiability"]["parameters"])
    rows = []
    for parameter, profile in zip(problem.parameters, findings.calibration["identifiability"]["parameters"], strict=True):
        quantity = PARAMETERS[parameter.name]
        row = [
            text(words(parameter.name)) + in_unit(quantity),
            number(chosen[parameter.name]),
            _range(*profile["interval_95"]),
            number(profile["best"]),
            _range(parameter.low, parameter.high),
            mark(profile["pinned"], "yes", "no"),
        ]
        rows.append(row + [number(profile["truth"])] * truth_known)
    head = ["parameter", "compromise", "95 % interval", "best fit", "searched", "pinned down"] + ["truth"] * truth_known
    return table("Calibrated parameters", head, rows, 1) + paragraph(text(_reason(findings)), "small")


def _range(low: float, high: float) -> str:
    return f"{number(low, 3)} to {number(high, 3)}"


def _reason(findings: Findings) -> str:
    return (
        f"How the compromise was chosen: {findings.calibration['compromise_reason']}. Intervals come from the profile "
        "likelihood; one that ends where the search ended is set by the bounds, not by the measurements. The best fit "
        "ignores the computing time."
    )


# Tables of the candidates


def _candidates_table(findings: Findings, album: Album) -> str:
    """Like the paper's Table 6."""
    found, problem = findings.candidates, findings.space.case.problem
    rows = [
        [text(words(n)) + in_unit(PARAMETERS[n]), *(number(c["parameters"][n]) for c in found.values())] for n in problem.names
    ]
    rows += [[f"error of {text(key_words(t.key))}", *(_promised_error(t, c) for c in found.values())] for t in problem.targets]
    for name in found["compromise"]["objectives"]:
        symbol = OBJECTIVES[name].symbol
        rows.append([f"{text(symbol)} ({text(words(name))})", *(number(c["objectives"][name]) for c in found.values())])
    caption = "Calibration: compromise and individuals, with the errors and objectives that the interpolant promises"
    meaning = "Errors are (predicted − target) / target ± one standard error of the interpolant."
    return section("Candidates on the front", table(caption, ["", *map(short, found)], rows, 1), note(meaning))


def _promised_error(target: Target, candidate: Mapping[str, Any]) -> str:
    promised, size = candidate["predicted"][target.key], abs(target.value)
    error = percent((promised["mean"] - target.value) / size).removesuffix("\u00a0%")
    return f"{error} ± {100 * promised['error'] / size:.2f} %"


# Failures and provenance


def _failures(findings: Findings, album: Album) -> str:
    """How many runs of each stage ended how, and why the bad ones did."""
    stages = {
        "plan": findings.records,
        "verification": [r for own in findings.verified.values() for r in own],
        "validation": [r for own in findings.validated.values() for r in own],
    }
    kinds = [k for k in STATUSES if k == "ok" or any(r.status == k for own in stages.values() for r in own)]
    rows = [[stage, *(str(sum(r.status == k for r in own)) for k in kinds)] for stage, own in stages.items() if own]
    meanings = [paragraph(f"<b>{text(k)}</b>: {text(STATUSES[k])}.", "small") for k in kinds if k != "ok"]
    bad = [
        [r.run_id, stage, text(r.status), text(r.error or STATUSES[r.status])]
        for stage, own in stages.items()
        for r in own
        if r.status != "ok"
    ]
    reasons = table("Runs without a full set of responses", ["run", "stage", "status", "reason"], bad) if bad else ""
    words = "" if bad else paragraph("Every run that was started ended well.")
    return section(
        "Failed and clogged runs", table("Runs by outcome", ["stage", *map(text, kinds)], rows), words, *meanings, reasons
    )


def _provenance(findings: Findings, album: Album) -> str:
    """What would be needed to do it again."""
    case = findings.space.case
    verified = [r for own in findings.verified.values() for r in own]
    validated = [r for own in findings.validated.values() for r in own]
    runs = [*findings.records, *verified, *validated]
    shipped = findings.summary.get("run", {}).get("from_shipped_database", 0)
    rows = [
        ["calibrator", text(__version__)],
        ["YADE", text(_distinct(runs, "yade"))],
        ["scripts (hash)", text(_distinct(runs, "scripts"))],
        ["Python", text(platform.python_version())],
        *([name, text(importlib.metadata.version(name))] for name in PACKAGES),
        ["runs", f"{len(findings.records)} of the plan, {len(verified)} to verify, {len(validated)} to validate"],
        ["from the shipped database", str(shipped)],
        ["core-seconds of the plan", text(_spent_on_plan(findings))],
        ["core-seconds to verify and validate", number(_core_seconds([*verified, *validated]))],
    ]
    return section(
        "Provenance",
        table("Versions, runs and cost", ["", ""], rows),
        f"<h3>Case file {text(case.path.name)}</h3><pre>{text(_case_text(case.path))}</pre>",
    )


def _distinct(records: Sequence[Record], key: str) -> str:
    return ", ".join(sorted({str(r.provenance[key]) for r in records if r.provenance.get(key)})) or "not recorded"


def _case_text(path: Path) -> str:
    try:
        return read_text(path)
    except OSError as error:
        return f"(the case file cannot be read any more: {error})"


def _spent_on_plan(findings: Findings) -> str:
    """Core-seconds from timings.csv, which knows the runs made here but not those that were shipped."""
    try:
        rows = list(csv.DictReader(read_text(findings.space.path / "timings.csv", links=False).splitlines()))
        spent = sum(float(row["filling_cpu"]) + float(row["release_cpu"]) for row in rows)
    except FileNotFoundError:
        return "timings.csv is missing: run `calibrator collect`"
    except (OSError, KeyError, TypeError, ValueError, csv.Error) as error:
        raise CalibratorError(f"{findings.space.path}/timings.csv is damaged ({error}): run `calibrator collect` again") from None
    return f"{number(spent)} in {len(rows)} runs made here"


def _core_seconds(records: Sequence[Record]) -> float:
    return sum(float(r.diagnostics.get(k, 0.0)) for r in records for k in ("filling_cpu", "release_cpu"))


SECTIONS: tuple[Callable[[Findings, Album], str], ...] = (
    _answer,
    pictures,
    calibration,
    _candidates_table,
    verification,
    validation,
    _failures,
    _provenance,
)
