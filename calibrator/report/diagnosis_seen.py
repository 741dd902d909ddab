"""What the figures of a diagnosis show, in a sentence each that states the finding."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calibrator.case.vocabulary import effect_of
from calibrator.diagnosis.gap import Location
from calibrator.diagnosis.outcome import (
    Diagnosis,
    ExplanationRun,
    FingerprintTable,
    Ghosts,
    Power,
)
from calibrator.report.verdict import worst_of
from calibrator.report.words import experiment_words, number

SURPRISING = 0.05


def residuals(found: Diagnosis) -> str:
    """How many observables are far off, without and with the named effect."""
    said = f"In standard errors, {worst_of(found, 0)}, for the model as it is"
    if found.explained and len(found.explanations) > 1:
        said += f"; with {found.explanations[1].called}, {worst_of(found, 1)}"
    return f"{said}."


def locations(places: Sequence[Location]) -> str:
    """Which experiment disagrees with the others."""
    surprising = sum(place.p_holm < SURPRISING for place in places)
    return (
        f"{surprising} of {len(places)} experiments disagree with the others (p below"
        f" {SURPRISING}); the worst is {experiment_words(places[0].experiment)}, p ="
        f" {number(places[0].p_holm, 2)}."
    )


def fingerprints(prints: FingerprintTable, labels: Sequence[str]) -> str:
    """Which effect shows most, and where."""
    shifts = np.array(prints.shifts)
    row, column = np.unravel_index(int(np.argmax(np.abs(shifts))), shifts.shape)
    return (
        f"The largest change is {shifts[row, column]:+.1f} standard errors, of"
        f" {labels[int(row)]} by {effect_of(prints.effects[column]).called}."
    )


def confusability(prints: FingerprintTable) -> str:
    """Which two effects are most alike."""
    likeness = np.triu(np.abs(np.array(prints.confusability)), 1)
    if len(likeness) < 2:
        return "There is only one effect, and nothing that it could be taken for."
    i, j = np.unravel_index(int(np.argmax(likeness)), likeness.shape)
    first, second = (effect_of(prints.effects[k]).called for k in (i, j))
    return f"Most alike are {first} and {second}, with {number(float(likeness[i, j]), 2)} of 1."


def posterior(weights: Mapping[str, float]) -> str:
    """Which explanation is the most probable, and which the next."""
    ranked = sorted(weights, key=weights.__getitem__, reverse=True)[:2]
    said = [f"{name} with probability {number(weights[name], 2)}" for name in ranked]
    return f"The most probable explanation is {', then '.join(said)}."


def ghosts(found: Ghosts) -> str:
    """What the best effect removes beside what random ones do."""
    return (
        f"The best effect alone removes {100 * found.effect:.0f} % of the disagreement, random"
        f" directions {100 * found.ghost_median:.0f} % (median) and at most"
        f" {100 * found.ghost_95:.0f} % (95 %)."
    )


def gap(tried: Sequence[ExplanationRun]) -> str:
    """How large the gap is with each explanation."""
    said = [f"{number(one.gap_used, 2)} with {one.called}" for one in tried[1:]]
    return (
        f"The gap is {number(tried[0].gap_used, 2)} standard errors with the model as it is, and"
        f" {', '.join(said)}; noise alone would leave {number(tried[0].floor_used, 2)}."
    )


def powers(found: Sequence[Power]) -> str:
    """Which effects of plausible size would be seen, and which named."""
    seen = sum(power.sizes[0] <= 1 for power in found)
    named = sum(power.sizes[1] <= 1 for power in found)
    return f"Of {len(found)} effects of plausible size, {seen} would be seen and {named} be named."
