"""The truths of the campaign: nothing, every effect at three strengths, what is outside, pairs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calibrator.case.case import Case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.explanations import Effect
from calibrator.runs.request import Request
from tests.campaigns.hidden import matrix
from tests.campaigns.hidden.laboratory import OUTSIDE, laboratory_requests, truth_of

AMPLITUDES = {"weak": 0.4, "middling": 0.8, "strong": 1.5}
CONTROL = "twisting_stiffness"  # not expected to be identifiable: one class only
PAIRS = (("bond_number", "neck_error"), ("clump_aspect", "tilt_deg"))
NOTHING, MORE_NOTHING = 20, 20  # classes with nothing hidden, each with its own parameters
# wall friction ratio above the grains' own, which the case does not look for: the grains then slip
# on each other
ROUGH = 2.0
# of each strong effect, beside the first; one more of what is outside and of the pairs
MORE_TRUTHS = 2
# strong effects all of whose truths had been judged: two more of each
LATEST = ("bond_number", "neck_error", "clump_aspect")
POOL = 10  # runs of every experiment in a pool, at most
FIRST_SEED = 1_100_000_000


@dataclass(frozen=True)
class Class:
    """A truth and the runs of its pool, a list per experiment."""

    label: str
    strength: str
    index: int
    truth: dict[str, Any]
    requests: list[list[Request]]


def classes(case: Case) -> list[Class]:
    """All truths, each with its own parameters and seeds."""
    found = ex.experiments(case, case.observables)
    made = []
    for index, (label, strength, hidden) in enumerate([*_first(case), *_further(case)]):
        truth = truth_of(case, hidden, np.random.default_rng(index))
        asked = laboratory_requests(case, truth, found, FIRST_SEED + 100_000 * index, POOL)
        made.append(Class(label, strength, index, truth, asked))
    return made + last_test(case, found)


def last_test(case: Case, found: Sequence[ex.Experiment]) -> list[Class]:
    """The laboratories of matrix.py."""
    effects = [e for e in ex.library(case) if e.name != CONTROL]
    made = []
    drawn = matrix.truths(case, effects, AMPLITUDES, PAIRS, list(OUTSIDE))
    for index, (label, strength, hidden, unit) in enumerate(drawn, matrix.FIRST):
        values = map(float, ex.point(case, unit))
        at = dict(zip(case.problem.names, values, strict=True))
        truth = {"parameters": at, "hidden": hidden}
        asked = laboratory_requests(case, truth, found, FIRST_SEED + 100_000 * index, POOL)
        made.append(Class(label, strength, index, truth, asked))
    return made


def _first(case: Case) -> list[tuple[str, str, dict[str, float]]]:
    """Label, strength and what is hidden: one truth of everything, many of nothing."""
    effects = ex.library(case)
    wanted: list[tuple[str, str, dict[str, float]]] = [
        (f"nothing {i + 1}", "none", {}) for i in range(NOTHING)
    ]
    for i, effect in enumerate(effects):
        for j, strength in enumerate(AMPLITUDES):
            if effect.name != CONTROL or strength == "strong":
                wanted.append((effect.name, strength, _hidden(effect, strength, i + j)))
    return wanted + _outside_and_pairs(effects, [name for name in OUTSIDE if name != "vibration"])


def _further(case: Case) -> list[tuple[str, str, dict[str, float]]]:
    """Further truths: an order apart, so that they leave the seeds of the first ones alone."""
    effects = ex.library(case)
    named = [e for e in effects if e.name != CONTROL]
    wanted: list[tuple[str, str, dict[str, float]]] = []
    for turn in range(MORE_TRUTHS):
        wanted += [
            (e.name, "strong", _hidden(e, "strong", i + turn + 3)) for i, e in enumerate(named)
        ]
    wanted += _outside_and_pairs(effects, [*OUTSIDE, "vibration"])
    wanted += [(f"nothing {NOTHING + i + 1}", "none", {}) for i in range(MORE_NOTHING)]
    wanted.append(("wall_friction_ratio", "rough", {"wall_friction_ratio": ROUGH}))
    for turn in range(MORE_TRUTHS):
        wanted += [
            (e.name, "strong", _hidden(e, "strong", turn)) for e in effects if e.name in LATEST
        ]
    wanted += _outside_and_pairs(effects, list(OUTSIDE))
    for j, strength in enumerate(("strong", "weak", "middling")):
        wanted += [(e.name, strength, _hidden(e, strength, i + j)) for i, e in enumerate(named)]
    wanted += _outside_and_pairs(effects, [])
    for j, strength in enumerate(("strong", "strong", "weak", "middling")):
        wanted += [(e.name, strength, _hidden(e, strength, i + j)) for i, e in enumerate(named)]
    return wanted + _outside_and_pairs(effects, list(OUTSIDE))


def _hidden(effect: Effect, strength: str, parity: int) -> dict[str, float]:
    """An effect at a strength; negative where parity is odd and the effect can be."""
    size = AMPLITUDES[strength]
    return {
        effect.name: ex.column_value(
            effect, -size if parity % 2 and effect.bounds[0] <= -size else size
        )
    }


def _outside_and_pairs(
    effects: Sequence[Effect], outside: Sequence[str]
) -> list[tuple[str, str, dict[str, float]]]:
    by_name = {e.name: e for e in effects}
    pairs = [
        (
            " and ".join(two),
            "pair",
            {n: ex.column_value(by_name[n], AMPLITUDES["strong"]) for n in two},
        )
        for two in PAIRS
    ]
    return [*((name, "outside", {name: 1.0}) for name in outside), *pairs]


def true_size(case: Case, one: Class) -> float:
    """Amplitude of the hidden effect in plausible scales; nan unless exactly one is hidden."""
    sizes = [
        (value, e)
        for name, value in one.truth["hidden"].items()
        for e in ex.library(case)
        if e.name == name
    ]
    return (
        (sizes[0][0] - ex.column_value(sizes[0][1], 0.0)) / sizes[0][1].scale
        if len(sizes) == 1
        else float("nan")
    )
