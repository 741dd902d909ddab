"""How often is the verdict right, where an effect is hidden in pools of real YADE runs?

    calibrator preflight cases/missing_effect.toml --yes        runs of the surfaces
    python -m tests.campaigns.hidden.campaign run [N [CLASS]]   carry out the pools, for hours
    python -m tests.campaigns.hidden.campaign                   judge them

The first leaves diagnosis.csv, which is shipped as grid/missing_effect.csv; the second can be
resumed and writes grid/missing_effect_pools.csv, with N runs of each instead of three, of classes
whose label begins with CLASS or whose number it is, or of those of matrix.py where it is "last";
the third writes benchmarks/results/hidden_effect.json.

A class is a truth: parameters, and nothing hidden, an effect at a weak, middling or strong
amplitude, an effect outside the library, or a pair. Its pool holds a few runs of every experiment,
spare ones where some clog. It is one laboratory and is judged once: three runs of each experiment
are its replicates, made on three days that have errors of their own, and its shared errors are
within a factor of two of what its table states (errors.py); a neck or a level that is slightly off
shifts them along the surfaces' slopes. Each class of a single effect is judged once more without
that effect in the library. The sets that the surfaces are made from are laboratories too, with
nothing hidden, each left out of the surfaces in turn (left_out.py). The figures that count are
those of the last test (matrix.py), whose truths were set down before any of them was run, and
seen by no rule; `all_truths` has the earlier ones as well, which rules were made with. The fresh
YADE runs by which `diagnose` can take a name back are not made here, so live it names less.
"""

import json
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import write
from calibrator.case.case import Case
from calibrator.case.toml import read_case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.terminal import ProgressBar
from tests.campaigns.hidden import matrix
from tests.campaigns.hidden.intervals import exact
from tests.campaigns.hidden.laboratory import REPLICATES, SHIPPED
from tests.campaigns.hidden.left_out import left_out, said_of_left_out
from tests.campaigns.hidden.rates import figures, smallest
from tests.campaigns.hidden.trials import Trial, disjoint, library, trial
from tests.campaigns.hidden.truths import CONTROL, POOL, Class, classes

REPO = Path(__file__).resolve().parents[3]
CASE = REPO / "cases" / "missing_effect.toml"
FOLDER = RunFolder(REPO / "results" / "missing_effect_pools")
POOLS = REPO / "grid" / "missing_effect_pools.csv"
EARLIER = Path(__file__).with_name("earlier_last_tests.json")


def chosen_of(everything: Sequence[Class], label: str) -> list[Class]:
    """Classes whose label begins so or whose number it is; those of matrix.py for "last"."""
    if label == "last":
        return [c for c in everything if c.index >= matrix.FIRST]
    return [c for c in everything if c.label.startswith(label) or str(c.index) == label]


def carry_out(case: Case, one: Class, most: int, there: Database) -> None:
    """The first runs of a pool that are not there yet, then spare ones where some clog."""
    found = ex.experiments(case, case.observables)
    counts, before = [most] * len(found), [0] * len(found)
    while counts != before:
        asked = [own[:n] for own, n in zip(one.requests, counts, strict=True)]
        todo = [r for own in asked for r in own if not there.find([r])]
        have = Database(
            [
                *there.find([r for own in asked for r in own]),
                *run(FOLDER, todo, report=ProgressBar(sys.stderr)),
            ]
        )
        good = [
            len(observed.values_of(e, have.find(own))) for e, own in zip(found, asked, strict=True)
        ]
        spare = [max(min(most, REPLICATES) - n, 0) for n in good]
        before, counts = (
            counts,
            [min(n + more, POOL) for n, more in zip(counts, spare, strict=True)],
        )


def main() -> None:
    """Carry out the pools, or judge them."""
    case = read_case(CASE)
    everything = classes(case)
    asked = [r for c in everything for own in c.requests for r in own]
    what, *some = sys.argv[1:] or ["judge"]
    there = Database.read(POOLS) if POOLS.exists() else Database()
    if what == "run":
        most, label = int(some[0]) if some else REPLICATES, some[1] if some[1:] else ""
        chosen = chosen_of(everything, label)
        if not chosen:
            labels = ", ".join(sorted({c.label for c in everything}))
            sys.exit(
                f"no class has the number {label} or a label that begins so: give one of {labels}"
            )
        for one in chosen:
            carry_out(case, one, most, there)
    pools = Database(
        {r.run_id: r for r in [*there.records.values(), *gather(FOLDER, asked)]}.values()
    )
    if not len(pools) or (what != "run" and not SHIPPED.exists()):
        sys.exit("no runs to judge: see the commands at the top of this file")
    pools.write(POOLS, "python -m tests.campaigns.hidden.campaign run")
    if what == "run":
        return
    shipped = Database.read(SHIPPED)
    trials = judged_trials(case, everything, pools, shipped)
    last = [t for t in trials if t.pool >= matrix.FIRST]
    outer = left_out(case, shipped)
    results = {
        **figures(last),
        "left_out_sets": said_of_left_out(outer, [t for t in last if t.strength == "none"]),
        "earlier_last_tests": earlier_last_tests(),
        "all_truths": figures(trials),
        "smallest": smallest(case, library(case, shipped)),
    }
    # a median over no trial is none, and JSON has no NaN
    write("hidden_effect", json.loads(json.dumps(results).replace("NaN", "null")))


def earlier_last_tests() -> list[dict[str, Any]]:
    """Counts of last tests that others have followed, with intervals of the laboratories' shares.

    They cannot be judged again, as the case has had experiments added since.
    """
    stem = "_laboratories"
    return [
        {
            **one,
            **{
                key.removesuffix(stem) + "_interval_by_pool": exact(*own)
                for key, own in one.items()
                if key.endswith(stem)
            },
        }
        for one in json.loads(EARLIER.read_text())
    ]


def judged_trials(
    case: Case, everything: Sequence[Class], pools: Database, database: Database
) -> list[Trial]:
    """All trials; a class whose pool is too small is left out and said so."""
    whole, trials = library(case, database), []
    found = ex.experiments(case, case.observables)
    for index, one in enumerate(everything):
        pool = [
            observed.values_of(e, pools.find(own))
            for e, own in zip(found, one.requests, strict=True)
        ]
        if min(map(len, pool)) < REPLICATES:
            print(
                f"{one.label}, {one.strength}: only {min(map(len, pool))} complete runs of an"
                " experiment, left out",
                file=sys.stderr,
            )
            continue
        rng = np.random.default_rng(10_000 + index)
        runs = disjoint(pool, rng)[0]
        trials.append(trial(case, one, runs, whole, False, rng))
        if one.strength in ("middling", "strong") and one.label != CONTROL:
            trials.append(trial(case, one, runs, library(case, database, one.label), True, rng))
        print(
            one.label,
            one.strength,
            dict(Counter(t.verdict.said for t in trials if t.label == one.label)),
            file=sys.stderr,
        )
    return trials


if __name__ == "__main__":
    main()
