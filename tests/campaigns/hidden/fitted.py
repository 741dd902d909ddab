"""How often the intervals of frictions, and of the sizes of effects, hold the truth.

    python -m tests.campaigns.hidden.fitted

judges the laboratories of grid/missing_effect_pools.csv in minutes and writes
benchmarks/results/fitted_intervals.json. Frictions are judged where nothing is hidden, the size of
an effect wherever one of the library's is hidden alone, named or not: the model is fitted with it.
A value is held where the deviance has risen from the best fit to the truth by no more than to the
ends of its interval. Each laboratory is judged TRIALS times, with other runs of its pool and other
errors of metrology, and counts as one in the intervals of the shares. Beside these are those that
chi-square alone would give, without regard to how far fits to sets left out of the surfaces go
astray (calibrator/diagnosis/left_out.py). Laboratories of the last test, which fill the whole box,
had shown that intervals were too narrow; no constant was set by them.
"""

import sys
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from benchmarks.common import rounded, write
from calibrator.case.case import Case
from calibrator.case.toml import read_case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.explanations import Measured, explain
from calibrator.diagnosis.interval import RISE, rises
from calibrator.runs.database import Database
from tests.campaigns.hidden import matrix
from tests.campaigns.hidden.campaign import CASE, POOLS
from tests.campaigns.hidden.errors import errors_of
from tests.campaigns.hidden.intervals import interval
from tests.campaigns.hidden.laboratory import REPLICATES, SHIPPED
from tests.campaigns.hidden.trials import Judged, disjoint, library, measurements
from tests.campaigns.hidden.truths import Class, classes, true_size

ENDS = ("by chi-square", "stated")
TRIALS = 5


def main() -> None:
    """Judge the laboratories, and write how many are held."""
    case = read_case(CASE)
    pools, whole = Database.read(POOLS), library(case, Database.read(SHIPPED))
    rows = list(judged(case, pools, whole))
    last = [r for r in rows if r["laboratory"] >= matrix.FIRST]
    earlier = [r for r in rows if r["laboratory"] < matrix.FIRST]
    write(
        "fitted_intervals",
        {"last_test": counts(last), "earlier": counts(earlier), "by_laboratory": together(rows)},
    )


def judged(case: Case, pools: Database, whole: Judged) -> Iterator[dict[str, Any]]:
    """A row for each value of each laboratory that has enough runs."""
    found = ex.experiments(case, case.observables)
    names = [e.name for e in whole.effects]
    for one in classes(case):
        hidden = list(one.truth["hidden"])
        if len(hidden) > 1 or any(n not in names for n in hidden):
            continue
        pool = [
            observed.values_of(e, pools.find(own))
            for e, own in zip(found, one.requests, strict=True)
        ]
        if min(map(len, pool)) < REPLICATES:
            continue
        errors = errors_of(case.nuisances, one.index)
        added = tuple(names.index(n) for n in hidden)
        for number in range(TRIALS):
            rng = np.random.default_rng([one.index, 1, number])
            measured = measurements(case, disjoint(pool, rng)[0], whole, rng, errors)
            for value, truth, index in wanted(case, one):
                row = held(whole, measured.only(whole.used), added, index, truth)
                print(one.index, value, row, file=sys.stderr)
                yield {"laboratory": one.index, "value": value, "truth": truth, **row}


def wanted(case: Case, one: Class) -> list[tuple[str, float, int]]:
    """Name, truth and index of what is judged, as shares of ranges and in plausible sizes."""
    if one.truth["hidden"]:
        (effect,) = one.truth["hidden"]
        return [(effect, true_size(case, one), len(case.problem.parameters))]
    truth = one.truth["parameters"]
    return [
        (p.name, float(p.shares_of(np.array([truth[p.name]]))[0]), i)
        for i, p in enumerate(case.problem.parameters)
    ]


def held(
    whole: Judged, measured: Measured, added: tuple[int, ...], index: int, truth: float
) -> dict[str, Any]:
    """The best value, and whether each kind of interval holds the truth."""
    rest = (whole.surfaces, measured, whole.effects, added, whole.used)
    best = explain(*rest)
    fitted = np.concatenate([best.unit, best.amplitude[list(added)]])
    low, high = (0.0, 1.0) if not added else whole.effects[added[0]].bounds
    at = explain(*rest, pinned=(index, float(np.clip(truth, low, high))), near=fitted)
    risen = at.deviance - best.deviance
    enough = rises(whole.surfaces, measured, added, best, whole.used)[index]
    return {
        "best": float(fitted[index]),
        "risen": risen,
        **{name: bool(risen <= most) for name, most in zip(ENDS, (RISE, enough), strict=True)},
    }


def counts(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Held, of how many laboratories, and the exact interval of the share."""
    frictions = sorted({r["value"] for r in rows if r["value"].endswith("_friction")})
    groups = {name: [r for r in rows if r["value"] == name] for name in frictions}
    groups["size of an effect"] = [r for r in rows if r["value"] not in frictions]
    found: dict[str, Any] = {}
    for name, own in groups.items():
        where = [r["laboratory"] for r in own]
        found[name] = {"laboratories": len(set(where)), "trials": len(own)}
        for end in ENDS:
            hits = [r[end] for r in own]
            found[name][end] = {"held": sum(hits), "interval_by_laboratory": interval(hits, where)}
    return found


def together(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The trials of a value of a laboratory in one row: best values, rises, how many are held."""
    groups: dict[tuple[int, str, float], list[dict[str, Any]]] = {}
    for r in rows:
        groups.setdefault((r["laboratory"], r["value"], r["truth"]), []).append(r)
    return [
        {
            "laboratory": laboratory,
            "value": value,
            "truth": rounded(truth),
            "best": [rounded(r["best"]) for r in own],
            "risen": [rounded(r["risen"]) for r in own],
            **{end: sum(r[end] for r in own) for end in ENDS},
        }
        for (laboratory, value, truth), own in groups.items()
    ]


if __name__ == "__main__":
    main()
