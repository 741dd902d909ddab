"""The first screen of a diagnosis: the verdict, how sure, what is doubtful, what to do next."""

from __future__ import annotations

import re

from calibrator.case.experiment import experiment_name
from calibrator.case.vocabulary import effect_of
from calibrator.diagnosis.outcome import Amplitude, Diagnosis, ObservableRow
from calibrator.diagnosis.sentence import (
    at_bounds,
    could_have_seen,
    errors_that_would_do,
    next_step,
    possible,
    refuted,
    shrunk,
)
from calibrator.diagnosis.verdict import AMBIGUOUS, CANNOT_TELL, NO_GAP, OUT_OF_BOUNDS
from calibrator.report.html import note, paragraph, section, table
from calibrator.report.words import (
    amount,
    experiment_words,
    in_unit,
    key_words,
    listed,
    number,
    response,
    text,
    with_error,
    words,
)
from calibrator.runs.workspace import Workspace

FAR = 2.0
"""Standard errors from which a residual is stressed."""


def opening(space: Workspace, found: Diagnosis) -> str:
    """The answer, and what became of every observable."""
    sure, doubtful = (_spoken(space, said) for said in (how_sure(found), doubts(found)))
    parts = [
        f"<b>{text(verdict_of(found))}</b>",
        f"<b>How sure:</b> {text(sure)}" if sure else "",
        f"<b>Doubtful:</b> {text(doubtful)}" if doubtful else "",
        f"<b>Next:</b> {next_of(space, found)}",
    ]
    box = "".join(paragraph(part) for part in parts if part)
    return section("The answer", f'<div class="answer">{box}</div>', observables(found))


def _spoken(space: Workspace, sentence: str) -> str:
    """A sentence of the outcome with parameters in words, and numbers and signs as on a page."""
    for name in space.case.problem.names:
        sentence = sentence.replace(name, words(name))
    for condition, own in space.case.conditions.items():
        experiment = experiment_name(own.setup, condition)
        sentence = sentence.replace(experiment, experiment_words(experiment))
    plain = re.sub(r"(?<=\d)e\+?(-?)0*(?=\d)", r"e\1", sentence)
    return plain.replace(" -> ", " to ").replace("chi2", "χ²").replace("+-", "±")


def verdict_of(found: Diagnosis) -> str:
    """The verdict in one sentence."""
    if found.verdict == CANNOT_TELL:
        return "Cannot tell: too little is measured to test whether something is missing."
    if found.verdict == NO_GAP:
        return "Nothing is missing: the model meets the measurements within their errors."
    if found.verdict == OUT_OF_BOUNDS:
        return "Out of bounds: within its bounds the model does not meet the measurements."
    if found.explained:
        return f"Missing from the model: {listed([_sized(found, n) for n in found.effects])}."
    if found.verdict == AMBIGUOUS:
        names = " or ".join(possible(name) for name in found.effects)
        return f"Something is missing from the model; what, is ambiguous: {names}."
    return "Something is missing from the model, and no effect of the library explains it."


def _sized(found: Diagnosis, name: str) -> str:
    """An effect with the size that was found."""
    size = found.explanations[1].amplitudes[name]
    return f"{effect_of(name).called} ({name} = {sized(size)})"


def sized(one: Amplitude) -> str:
    """An amplitude with its 95 % interval, its standard error, or alone, as far as it is known."""
    if one.low is not None and one.high is not None:
        return f"{number(one.value, 3)}, 95 %: {number(one.low, 2)} to {number(one.high, 2)}"
    return number(one.value, 3) if one.error is None else with_error(one.value, one.error)


def how_sure(found: Diagnosis) -> str:
    """What speaks for the verdict, with its numbers; empty where nothing was tested."""
    if found.detection is None:
        return f"{found.sentence.split(': ')[1]}." if found.sentence.count(": ") > 1 else ""
    p = number(min(found.detection.p_effect, found.detection.p_chi2), 2)
    if found.verdict == NO_GAP:
        return f"A disagreement as large comes by chance with p = {p}. {could_have_seen(found)}"
    if found.verdict == OUT_OF_BOUNDS and found.bounded is not None:
        places = listed(found.bounded.at_bounds)
        return f"Within the bounds p = {number(found.bounded.p, 2)}, with {places}."
    said = f"A disagreement as large comes by chance with p = {p}."
    if found.explained:
        weight = max((found.posterior.get(n, 0.0) for n in found.effects), default=0.0)
        said += f" Probability among all explanations: {weight:.2f}. {shrunk(found)}"
    return said


def doubts(found: Diagnosis) -> str:
    """What could take the verdict back, and where its details stand."""
    said = [] if found.verdict == OUT_OF_BOUNDS else [at_bounds(found).strip()]
    if found.detection is not None and found.verdict not in (NO_GAP, OUT_OF_BOUNDS):
        said.append(errors_that_would_do(found).strip())
    if found.notes:
        many = f"{len(found.notes)} notes stand" if len(found.notes) > 1 else "A note stands"
        said.append(f"{many} at the end of the page.")
    return " ".join(one for one in said if one)


def next_of(space: Workspace, found: Diagnosis) -> str:
    """What to do, as HTML."""
    if found.following:
        return f"calibrate with it, by <code>{text(found.following)}</code>. {text(refuted(found))}"
    if found.explained:
        return text(refuted(found))
    if found.verdict == NO_GAP:
        return f"calibrate the model as it is, by <code>{text(space.command('all'))}</code>."
    if found.verdict == CANNOT_TELL:
        return text(found.sentence.rpartition(": ")[2])
    if found.verdict == OUT_OF_BOUNDS:
        return (
            "widen the bounds, calibrate and diagnose again; where values beyond are impossible,"
            " check the measurements and what the case keeps fixed."
        )
    return text(_spoken(space, next_step(found)).removeprefix("Next: "))


def observables(found: Diagnosis) -> str:
    """Every observable: measured, and simulated without and with the named effect."""
    if not found.observables:
        return ""
    runs = found.explanations[: 2 if found.explained else 1]
    head = ["observable", "used to", "measured"]
    for one in runs:
        called = one.called if not one.effects else f"with {one.called}"
        head += [text(called), "off by, in standard errors"]
    rows = [_row(row, len(runs)) for row in found.observables]
    meaning = (
        "Simulated: means of fresh YADE runs at the best parameters of each model. Off by:"
        f" (measured − simulated) over the standard error of the difference; red beyond {FAR:g}."
    )
    return table("Every observable, measured and simulated", head, rows) + note(meaning)


def _row(row: ObservableRow, models: int) -> list[str]:
    use = "fit" if row.used else "check" if row.held_out else "not used"
    cells = [
        text(key_words(row.key)) + in_unit(response(row.key)),
        use,
        with_error(row.measured, row.error),
    ]
    for simulated, z in zip(row.simulated[:models], row.z[:models], strict=True):
        far = ' class="no"' if abs(z) > FAR else ""
        cells += [number(simulated), f"<span{far}>{z:+.1f}</span>"]
    return cells


def worst_of(found: Diagnosis, model: int) -> str:
    """Which observables are far off in a model, in words."""
    far = [row for row in found.observables if abs(row.z[model]) > FAR]
    if not far:
        return f"none of {len(found.observables)} observables is more than {FAR:g} off"
    worst = max(far, key=lambda row: abs(row.z[model]))
    return (
        f"{len(far)} of {len(found.observables)} observables are more than {FAR:g} off, most of all"
        f" {key_words(worst.key)} by {worst.z[model]:+.1f} (measured"
        f" {amount(worst.measured, response(worst.key))}, simulated"
        f" {amount(worst.simulated[model], response(worst.key))})"
    )
