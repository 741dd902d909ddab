"""The verdict of a diagnosis in plain words."""

from __future__ import annotations

import math

from calibrator.case.vocabulary import effect_of
from calibrator.diagnosis.gap import FEWEST_DEGREES, Gap
from calibrator.diagnosis.outcome import Amplitude, BoundedFit, Diagnosis, ExplanationRun
from calibrator.diagnosis.rule import Rule
from calibrator.diagnosis.verdict import (
    AMBIGUOUS,
    BEYOND,
    FIXED,
    MEASUREMENT,
    NO_GAP,
    NONE,
    OUT_OF_BOUNDS,
    UNKNOWN,
)

NO_EFFECTS = (NONE, UNKNOWN, MEASUREMENT, BEYOND, FIXED)
FAR = 10  # times its stated size: an error of the measurement beyond it is not worth a mention
PLAUSIBLE = 3  # plausible sizes: an effect that is seen from more on only is not worth a mention


def too_few(observables: int, parameters: int) -> str:
    """What to say where too few observables are left over for a test."""
    degrees = observables - parameters
    return (
        f"Cannot tell: {observables} observables against {parameters} parameters leave"
        f" {max(degrees, 0)} degrees of freedom, and a missing effect needs {FEWEST_DEGREES}:"
        f" measure at least {FEWEST_DEGREES - degrees} more, such as steady rate, residual mass or"
        " curvature of the runs that were made, or a second neck."
    )


def sentence(found: Diagnosis) -> str:
    """The verdict of a tested gap with its numbers.

    Raises ValueError where there was no test.
    """
    if found.detection is None:
        raise ValueError("nothing was tested")
    p = min(found.detection.p_effect, found.detection.p_chi2)
    if found.verdict == NO_GAP:
        return (
            f"No gap: the model meets the measurements within their errors (p = {p:.2g})."
            f" {at_bounds(found)}{could_have_seen(found)}{_allowed(found)}"
        )
    if found.verdict == OUT_OF_BOUNDS:
        return _out_of_bounds(found.bounded)
    worst = found.locations[0] if found.locations else None
    place = (
        f", most of all in {worst.experiment} (p = {worst.p_holm:.2g})"
        if worst and worst.p_holm < 0.05
        else ""
    )
    gap = f"Simulation and measurement disagree beyond every known error (p = {p:.2g}{place})"
    if found.explained:
        closed = shrunk(found) + errors_that_would_do(found)
        told = (_named(found), closed, refuted(found), at_bounds(found))
        return f"{gap}. {' '.join(told).strip()}"
    if found.verdict == AMBIGUOUS:
        names = " or ".join(possible(name) for name in found.effects)
        gap += f"; what explains it is ambiguous: {names}."
    else:
        gap += ", and no effect of the library explains it: unknown."
    return f"{gap}{errors_that_would_do(found)} {next_step(found)}"


def errors_that_would_do(found: Diagnosis) -> str:
    """Which errors of the measurement would explain the gap by themselves, and what was allowed."""
    would = [
        (abs(one.needed) / one.stated, one.words)
        for one in found.errors
        if one.needed is not None and one.p >= Rule().adequacy
    ]
    near, said = sorted(pair for pair in would if pair[0] < FAR), ""
    if near:
        sizes = ", or ".join(words for _, words in near)
        said = f" An error of the measurement would do it, too: {sizes}."
    elif would:
        said = f" No single error in the table of nuisances below {FAR} times its size would do it."
    elif found.errors:
        said = " No single error in the table of nuisances would do it."
    return said + _allowed(found)


def _allowed(found: Diagnosis) -> str:
    """What errors that the replicates of a day share were allowed for."""
    size = found.day_error
    if size is None:
        return ""
    if size == 0:
        return " No error is allowed for that the replicates of a day share (day_error = 0)."
    return f" An error of each day of {size:g} replicate scatters is allowed for (day_error)."


def at_bounds(found: Diagnosis) -> str:
    """A sentence where parameters are at their bounds, else nothing."""
    if found.bounded is None or not found.bounded.at_bounds:
        return ""
    places = " and ".join(found.bounded.at_bounds)
    return f"Its best fit has {places}: widen the bounds if values beyond are possible. "


def _out_of_bounds(fit: BoundedFit | None) -> str:
    """What to do where the box is too small for the measurements."""
    if fit is None:
        raise ValueError("no fit was noted")
    places = " and ".join(fit.at_bounds)
    beyond = (
        f" It would with {' and '.join(fit.beyond)} (p = {fit.p_wider:.2g}, on surfaces that"
        " extrapolate)."
        if fit.beyond and fit.p_wider is not None and fit.p_wider > fit.p
        else ""
    )
    return (
        f"Out of bounds: within its bounds the model does not meet the measurements (p ="
        f" {fit.p:.2g}), with {places}.{beyond} Nothing can be said of a missing effect: widen the"
        " bounds, calibrate and diagnose again; where values beyond are impossible, check the"
        " measurements and the parameters that the case keeps fixed."
    )


def possible(name: str) -> str:
    """An explanation in words."""
    others = {
        NONE: "nothing",
        UNKNOWN: "something unknown",
        MEASUREMENT: "errors of the measurement twice as large as stated",
        BEYOND: "parameters beyond their bounds",
        FIXED: "another value of what the case keeps fixed",
    }
    return others.get(name) or effect_of(name).called


def next_step(found: Diagnosis) -> str:
    """What to measure next: without each effect in question, else once more where the gap is."""
    if cures := _cures(found):
        return (
            f"Next: measure again after {', or after '.join(cures)}; the gap goes with the effect"
            " that is there."
        )
    where = f"{found.locations[0].experiment} " if found.locations else ""
    return (
        f"Next: measure {where}under another condition, and check the parameters that the case"
        " keeps fixed."
    )


def could_have_seen(found: Diagnosis) -> str:
    """What would have been seen, had it been there."""
    seen = [
        p.detectable
        for p in found.powers
        if p.smallest_detectable is not None and p.smallest_detectable < PLAUSIBLE * p.scale
    ]
    if not seen:
        return "No effect of plausible size would have been seen."
    return f"What would have been seen, with 80 % probability: {', '.join(seen)}."


def _named(found: Diagnosis) -> str:
    best = found.explanations[1]
    parts = [
        f"{effect_of(name).called} ({name} = {size.value:.3g}{_within(size)})"
        for name, size in best.amplitudes.items()
    ]
    rivals = [one for one in found.explanations[2:] if one.effects]
    rival = (
        f"; next {effect_of(rivals[0].effects[0]).called}, deviance"
        f" {rivals[0].deviance - best.deviance:+.1f}"
        if rivals
        else ""
    )
    posterior = max((found.posterior.get(n, math.nan) for n in found.effects), default=math.nan)
    return f"The missing effect is {' and '.join(parts)}{rival}, with posterior {posterior:.2f}."


def _within(size: Amplitude) -> str:
    """The interval of an amplitude, or where there is none its standard error."""
    if size.low is not None and size.high is not None:
        return f", 95 % {size.low:.2g} to {size.high:.2g}"
    return " +- an unknown error" if size.error is None else f" +- {size.error:.2g}"


def shrunk(found: Diagnosis) -> str:
    """By how much the gap shrinks with the named effect, and beside random ones."""
    texts = []
    for gap, words in _gaps(*found.explanations[:2]):
        closed = f", {gap.closed:.0%} closed" if gap.closed >= 0 else ""
        texts.append(
            f"{gap.before:.1f} -> {gap.after:.1f} {words} (noise alone {gap.floor:.1f}{closed})"
        )
    text = f"With it the gap, in standard errors, goes from {' and '.join(texts)}"
    if (ghosts := found.ghosts) is None:
        return f"{text}."
    return (
        f"{text}; a random effect would remove {ghosts.ghost_median:.0%} of chi2, this one"
        f" {ghosts.effect:.0%}."
    )


def _gaps(before: ExplanationRun, after: ExplanationRun) -> list[tuple[Gap, str]]:
    """The gap on the data used and, where there are some, held out, with words for which it is."""
    gaps = [(Gap(before.gap_used, after.gap_used, before.floor_used), "on the data used")]
    if before.gap_held_out is not None and after.gap_held_out is not None:
        held = Gap(before.gap_held_out, after.gap_held_out, before.floor_held_out)
        gaps.append((held, "on held-out data"))
    return gaps


def refuted(found: Diagnosis) -> str:
    """What would refute the named effect."""
    return f"It would be refuted if the gap stayed after {' and '.join(_cures(found))}."


def _cures(found: Diagnosis) -> list[str]:
    """What removes the effects in question; some effects no laboratory can remove."""
    named = [effect_of(n).removed_by for n in found.effects if n not in NO_EFFECTS]
    return [cure for cure in named if cure]
