"""The verdict of a diagnosis in plain words, from the outcome that is noted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from calibrator.case.vocabulary import effect_of
from calibrator.diagnosis.gap import FEWEST_DEGREES, Gap


def cannot_tell(observables: int, parameters: int, notes: Sequence[str] = ()) -> dict[str, Any]:
    """The outcome where too few observables are left over for a test."""
    degrees = observables - parameters
    text = (
        f"Cannot tell: {observables} observables against {parameters} parameters leave"
        f" {max(degrees, 0)} degrees of freedom, and a missing effect needs {FEWEST_DEGREES}:"
        f" measure at least {FEWEST_DEGREES - degrees} more, such as steady rate, residual mass or"
        " curvature of the runs that were made, or a second neck."
    )
    return {"verdict": "cannot tell", "effects": [], "sentence": text, "notes": list(notes)}


def sentence(o: dict[str, Any]) -> str:
    """The verdict in one sentence with its numbers."""
    p = min(o["detection"]["p_effect"], o["detection"]["p_chi2"])
    where = o["locations"][0] if o["locations"] else None
    place = (
        f", most of all in {where['experiment']} (p = {where['p_holm']:.2g})"
        if where and where["p_holm"] < 0.05
        else ""
    )
    gap = f"Simulation and measurement disagree beyond every known error (p = {p:.2g}{place})"
    if o["verdict"] == "no gap":
        return (
            f"No gap: the model meets the measurements within their errors (p = {p:.2g})."
            f" {_could_have_seen(o)}"
        )
    if o["verdict"] in ("named", "two effects"):
        return f"{gap}. {_named(o)} {_shrunk(o)} {_refuted(o)}"
    if o["verdict"] == "ambiguous":
        names = " or ".join(
            (
                "nothing"
                if n == "none"
                else "something unknown"
                if n == "unknown"
                else effect_of(n).called
            )
            for n in o["effects"]
        )
        return f"{gap}; what explains it is ambiguous: {names}. {_next(o)}"
    return f"{gap}, and no effect of the library explains it: unknown. {_next(o)}"


def _next(o: dict[str, Any]) -> str:
    """What to measure next: without each effect in question, else once more where the gap is."""
    if cures := _cures(o):
        return (
            f"Next: measure again after {', or after '.join(cures)}; the gap goes with the effect"
            " that is there."
        )
    where = (
        f"{o['locations'][0]['experiment']} under another condition"
        if o["locations"]
        else "under another condition"
    )
    return f"Next: measure {where}, and check the parameters that the case keeps fixed."


def _could_have_seen(o: dict[str, Any]) -> str:
    seen = [
        p
        for p in o["powers"]
        if p["smallest_detectable"] is not None and p["smallest_detectable"] < 3 * p["scale"]
    ]
    if not seen:
        return "No effect of plausible size would have been seen."
    sizes = (
        f"{p['called']} of"
        f" {p['smallest_detectable']:.2g}{'' if p['unit'] == '1' else ' ' + p['unit']}"
        for p in seen
    )
    return f"What would have been seen, with 80 % probability: {', '.join(sizes)}."


def _named(o: dict[str, Any]) -> str:
    best = o["explanations"][1]
    parts = [
        f"{effect_of(n).called} ({n} = {a['value']:.3g} +- {_digits(a['error'])})"
        for n, a in best["amplitudes"].items()
    ]
    rivals = [e for e in o["explanations"][2:] if e["effects"]]
    rival = (
        f"; next {effect_of(rivals[0]['effects'][0]).called}, deviance"
        f" {rivals[0]['deviance'] - best['deviance']:+.1f}"
        if rivals
        else ""
    )
    return (
        f"The missing effect is {' and '.join(parts)}{rival}, with posterior {_posterior(o):.2f}."
    )


def _digits(error: float | None) -> str:
    return "an unknown error" if error is None else f"{error:.2g}"


def _posterior(o: dict[str, Any]) -> float:
    return max((o["posterior"].get(n, float("nan")) for n in o["effects"]), default=float("nan"))


def _shrunk(o: dict[str, Any]) -> str:
    before, after = o["explanations"][:2]
    texts = []
    for what, words in (("used", "on the data used"), ("held_out", "on held-out data")):
        if before[f"gap_{what}"] is not None:
            gap = Gap(before[f"gap_{what}"], after[f"gap_{what}"], before[f"floor_{what}"])
            closed = "" if math.isnan(gap.closed) else f", {gap.closed:.0%} closed"
            texts.append(
                f"{gap.before:.1f} -> {gap.after:.1f} {words} (noise alone {gap.floor:.1f}{closed})"
            )
    ghosts = o["ghosts"]
    return (
        f"With it the gap, in standard errors, goes from {' and '.join(texts)}; a random effect"
        f" would remove {ghosts['ghost_median']:.0%} of chi2, this one {ghosts['effect']:.0%}."
    )


def _refuted(o: dict[str, Any]) -> str:
    return f"It would be refuted if the gap stayed after {' and '.join(_cures(o))}."


def _cures(o: dict[str, Any]) -> list[str]:
    """What removes the effects in question; some effects no laboratory can remove."""
    named = [effect_of(name).removed_by for name in o["effects"] if name not in ("none", "unknown")]
    return [cure for cure in named if cure]
