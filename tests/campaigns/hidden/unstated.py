"""Verdicts on laboratories whose errors are larger than they say.

    python -m tests.campaigns.hidden.unstated    half an hour; no run is made

Replicates that share the error of a day, and shared errors of twice the table's sizes, in the
laboratories of the campaign in which nothing is hidden (pools, and sets left out in turn) and in
those with a strong effect. It writes benchmarks/results/unstated_errors.json, by laboratory.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.common import write
from calibrator.case.case import Case
from calibrator.case.toml import read_case
from calibrator.case.vocabulary import EFFECTS
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.verdict import NO_GAP
from calibrator.runs.database import Database
from tests.campaigns.hidden.campaign import CASE, POOLS
from tests.campaigns.hidden.errors import Errors
from tests.campaigns.hidden.intervals import exact, laboratories_with
from tests.campaigns.hidden.laboratory import REPLICATES, SHIPPED
from tests.campaigns.hidden.left_out import without
from tests.campaigns.hidden.trials import Judged, library, measurements
from tests.campaigns.hidden.truths import CONTROL, classes

TRIALS = 2  # of a laboratory
FIRST_SEED = 30_000  # of the errors


@dataclass(frozen=True)
class Setting:
    """Errors that a laboratory has, and the error of a day that the diagnosis allows for.

    day, allowed : in scatters of one replicate; days : of the replicates; times : shared errors
    over those stated.
    """

    day: float
    days: int
    times: float
    allowed: float


SETTINGS = (
    Setting(1, 1, 1, 0),
    Setting(0, 1, 1, 1),
    Setting(0.5, 1, 1, 1),
    Setting(1, 1, 1, 1),
    Setting(1, 3, 1, 1),
    Setting(1, 1, 2, 1),
    Setting(1, 3, 2, 1),
)


@dataclass(frozen=True, eq=False)
class Laboratory:
    """Runs (replicates, n) of every experiment, the surfaces that judge them, what is hidden."""

    name: str
    hidden: str
    runs: Sequence[np.ndarray]
    judged: Judged


def laboratories(case: Case, shipped: Database) -> Iterator[Laboratory]:
    """Pools with nothing or a strong effect hidden, then the sets of the surfaces."""
    whole, pools = library(case, shipped), Database.read(POOLS)
    found = ex.experiments(case, case.observables)
    for one in classes(case):
        strong = one.strength == "strong" and one.label != CONTROL
        if not (strong or one.strength == "none"):
            continue
        pool = [
            observed.values_of(e, pools.find(own))[:REPLICATES]
            for e, own in zip(found, one.requests, strict=True)
        ]
        if min(map(len, pool)) == REPLICATES:
            hidden = one.label if strong else ""
            yield Laboratory(f"pool {one.index}", hidden, pool, whole)
    for index in range(case.diagnosis.sets):
        rest, values = without(shipped, case, index)
        if replicates := min(map(len, values)):
            runs = [own[:replicates] for own in values]
            yield Laboratory(f"set {index}", "", runs, library(case, rest))


def said(case: Case, one: Laboratory, setting: Setting, seed: int) -> list[str]:
    """What is printed in each trial of a laboratory."""
    told = replace(case, diagnosis=replace(case.diagnosis, day_error=setting.allowed))
    errors = Errors(setting.day, setting.days, {n.name: setting.times for n in case.nuisances})
    rng, found = np.random.default_rng(seed), []
    for _ in range(TRIALS):
        measured = measurements(told, one.runs, one.judged, rng, errors)
        verdict = one.judged.verdict(measured, rng)
        found.append(verdict.said)
    return found


def rates(words: Sequence[tuple[Laboratory, list[str]]]) -> dict[str, Any]:
    """False alarms and names by laboratory, under errors of one kind."""
    quiet = [(one, own) for one, own in words if not one.hidden]
    loud = [(one, own) for one, own in words if one.hidden]
    alarms = _count([[w != NO_GAP for w in own] for _, own in quiet], whole=False)
    wrong = _count([[w in EFFECTS for w in own] for _, own in quiet], whole=False)
    named = _count([[w == one.hidden for w in own] for one, own in loud], whole=True)
    other = _count(
        [[w in EFFECTS and w != one.hidden for w in own] for one, own in loud], whole=False
    )
    return {
        "nothing_hidden": {"false_alarms": alarms, "names": wrong},
        "strong": {"named": named, "another_name": other},
    }


def _count(hits: Sequence[Sequence[bool]], whole: bool) -> dict[str, Any]:
    """Laboratories with a hit in all of their trials, or in any, and the share of trials."""
    flat = [hit for own in hits for hit in own]
    some, number = laboratories_with(flat, [i for i, own in enumerate(hits) for _ in own], whole)
    return {
        "laboratories": [some, number],
        "interval_by_laboratory": exact(some, number),
        "trials": [sum(flat), len(flat)],
    }


def main() -> None:
    """Judge every laboratory under each kind of errors."""
    case, shipped = read_case(CASE), Database.read(SHIPPED)
    found: list[list[tuple[Laboratory, list[str]]]] = [[] for _ in SETTINGS]
    for number, one in enumerate(laboratories(case, shipped)):
        for index, setting in enumerate(SETTINGS):
            words = said(case, one, setting, FIRST_SEED + 10 * number + index)
            found[index].append((one, words))
        print(one.name, one.hidden, [own[-1][1] for own in found], file=sys.stderr, flush=True)
    results = [{**vars(e), **rates(own)} for e, own in zip(SETTINGS, found, strict=True)]
    write("unstated_errors", {"trials_of_a_laboratory": TRIALS, "errors": results})


if __name__ == "__main__":
    main()
