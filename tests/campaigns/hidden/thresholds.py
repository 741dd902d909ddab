"""What half and twice each threshold of a verdict would do.

    python -m tests.campaigns.hidden.thresholds    a few minutes; no run is made

The laboratories are those whose truths were known when the rules were made (pools before the last
test, sets left out in turn, and the first series of another engine), so that the last tests stay
what they are: each is judged once, with one draw of its errors of metrology, by the rule as it is
and with one threshold changed. A probability near one is changed by its distance from one. It
writes benchmarks/results/thresholds.json.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, fields, replace
from typing import Any
from unittest import mock

import numpy as np

from benchmarks.common import write
from calibrator.case.case import Case
from calibrator.case.toml import read_case
from calibrator.case.vocabulary import EFFECTS
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import explanations, observed
from calibrator.diagnosis.explanations import Measured
from calibrator.diagnosis.rule import Rule
from calibrator.diagnosis.verdict import NAMED, NO_GAP, OUT_OF_BOUNDS, TWO_EFFECTS, Verdict
from calibrator.runs.database import Database
from tests.campaigns.foreign import judge as foreign
from tests.campaigns.foreign.truths import DRAWN, series_of
from tests.campaigns.foreign.truths import OUTSIDE as FOREIGN_OUTSIDE
from tests.campaigns.hidden import matrix
from tests.campaigns.hidden.campaign import CASE, POOLS
from tests.campaigns.hidden.errors import errors_of
from tests.campaigns.hidden.laboratory import OUTSIDE, REPLICATES, SHIPPED
from tests.campaigns.hidden.left_out import without
from tests.campaigns.hidden.trials import Judged, library, measurements
from tests.campaigns.hidden.truths import CONTROL, classes

FRESH_ONLY = ("scatter", "grown")  # thresholds of fresh runs, which are not made here
FIRST_SEED = 40_000  # of the errors and the Monte Carlo
GROUPS = ("strong", "middling", "some")  # of effects that can be told
FOREIGN_SERIES = (1,)  # with which rules were made
USERS = ("verdict", "rivals", "limits")  # modules that fit explanations


@dataclass(frozen=True, eq=False)
class Known:
    """A laboratory, what it was measured to have, and the surfaces that judge it.

    strength : what is hidden there, "some" where another engine hid it, weak to strong.
    """

    maker: str
    strength: str
    hidden: tuple[str, ...]
    measured: Measured
    judged: Judged
    seed: int


def known(case: Case, shipped: Database) -> Iterator[Known]:
    """Pools before the last test, then the sets of the surfaces."""
    whole, pools = library(case, shipped), Database.read(POOLS)
    found = ex.experiments(case, case.observables)
    for one in classes(case):
        if one.index >= matrix.FIRST or one.label == CONTROL:
            continue
        pool = [
            observed.values_of(e, pools.find(own))[:REPLICATES]
            for e, own in zip(found, one.requests, strict=True)
        ]
        if min(map(len, pool)) == REPLICATES:
            hidden = tuple(n for n in one.truth["hidden"] if n not in OUTSIDE)
            yield _known(case, one.strength, hidden, pool, whole, FIRST_SEED + one.index)
    for index in range(case.diagnosis.sets):
        rest, values = without(shipped, case, index)
        if replicates := min(map(len, values)):
            runs = [own[:replicates] for own in values]
            yield _known(case, "none", (), runs, library(case, rest), FIRST_SEED + 1000 + index)
    for laboratory, _, own in foreign.complete(case):
        if series_of(laboratory.number) in FOREIGN_SERIES and min(map(len, own)) >= DRAWN:
            kind, seed = laboratory.kind, FIRST_SEED + 2000 + laboratory.number
            group = {"nothing": "none"}.get(kind, "outside" if kind in FOREIGN_OUTSIDE else "some")
            _, measured = foreign.trial(case, laboratory, own, whole, 0)
            hidden = (kind,) if group == "some" else ()
            yield Known("liggghts", group, hidden, measured, whole, seed)


def _known(
    case: Case,
    strength: str,
    hidden: tuple[str, ...],
    runs: Sequence[np.ndarray],
    judged: Judged,
    seed: int,
) -> Known:
    errors = errors_of(case.nuisances, seed)
    measured = measurements(case, runs, judged, np.random.default_rng(seed), errors)
    return Known("yade", strength, hidden, measured, judged, seed)


def settings() -> dict[str, Rule]:
    """The rule as it is, and with each threshold at half and at twice its value."""
    rule, found = Rule(), {"as it is": Rule()}
    for own in fields(Rule):
        if own.name in FRESH_ONLY:
            continue
        value = getattr(rule, own.name)
        near_one = 0.5 < value < 1
        for word, factor in (("half", 0.5), ("twice", 2.0)):
            changed = 1 - (1 - value) * factor if near_one else type(value)(value * factor)
            found[f"{own.name} {value:g}, {word}: {changed:g}"] = replace(
                rule, **{own.name: changed}
            )
    return found


class Fits:
    """Fits of explanations, each made once: rules differ in what they make of them."""

    def __init__(self) -> None:
        self.made: dict[Any, Any] = {}

    def __call__(self, surfaces, measured, effects, added=(), kept=None, unknown=0.0, box=None):
        """As explanations.explain."""
        arrays = (measured.values, measured.covariance, measured.replicates, kept, box)
        key = (added, unknown, *(b"" if a is None else np.asarray(a).tobytes() for a in arrays))
        if key not in self.made:
            self.made[key] = explanations.explain(
                surfaces, measured, effects, added, kept, unknown, box
            )
        return self.made[key]


def verdicts(one: Known, rules: dict[str, Rule]) -> dict[str, Verdict]:
    """What each rule says of a laboratory."""
    fits, said = Fits(), {}
    with ExitStack() as stack:
        for module in USERS:
            stack.enter_context(mock.patch(f"calibrator.diagnosis.{module}.explain", fits))
        for name, rule in rules.items():
            rng = np.random.default_rng(one.seed)
            said[name] = one.judged.verdict(one.measured, rng, rule)
    return said


def counted(said: Sequence[tuple[Known, Verdict]]) -> dict[str, list[int]]:
    """Laboratories by what was said of them."""

    def share(own: list[bool]) -> list[int]:
        return [sum(own), len(own)]

    printed = [
        (one, v) for one, v in said if v.kind in (NAMED, TWO_EFFECTS) and one.strength != "outside"
    ]
    single = {s: [(o, v) for o, v in said if o.strength == s] for s in GROUPS}
    return {
        "false_alarms": share([v.kind != NO_GAP for o, v in said if o.strength == "none"]),
        "out_of_bounds": share([v.kind == OUT_OF_BOUNDS for o, v in said if o.strength == "none"]),
        "names_true": share([sorted(v.effects) == sorted(o.hidden) for o, v in printed]),
        **{
            f"{strength}_named": share([v.effects == o.hidden and v.kind == NAMED for o, v in own])
            for strength, own in single.items()
            if own
        },
        "outside_named": share(
            [set(v.effects) <= set(EFFECTS) and bool(v.effects) and v.kind in (NAMED, TWO_EFFECTS)
             for o, v in said if o.strength == "outside"]
        ),
    }  # fmt: skip


def main() -> None:
    """Judge every known laboratory by every rule."""
    case, rules = read_case(CASE), settings()
    found: dict[str, list[tuple[Known, Verdict]]] = {name: [] for name in rules}
    for one in known(case, Database.read(SHIPPED)):
        own = verdicts(one, rules)
        for name, verdict in own.items():
            found[name].append((one, verdict))
        said = own["as it is"]
        print(
            one.maker,
            one.strength,
            one.hidden,
            said.kind,
            said.effects,
            file=sys.stderr,
            flush=True,
        )
    results = {
        name: {
            maker: counted([(o, v) for o, v in own if o.maker == maker])
            for maker in ("yade", "liggghts")
        }
        for name, own in found.items()
    }
    write("thresholds", results)


if __name__ == "__main__":
    main()
