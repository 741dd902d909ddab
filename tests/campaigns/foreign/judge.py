"""The verdicts on the laboratories that are complete, and how often they are right.

A trial draws five of the runs of each experiment and errors of metrology, as in
tests/campaigns/hidden/trials.py, and is judged by the same rules from the same shipped runs of
YADE. Trials of a laboratory share its runs, so laboratories are counted and not trials: by their
first one, which makes them independent, and by whether it ever happens in TRIALS. Each trial is
judged with and without the allowance for the engine (allowance.py), and the first one once more
with the fresh runs by which `diagnose` can take a name back (fresh.py), where they were made.
"""

import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from benchmarks.common import rounded, write
from calibrator.case.case import Case
from calibrator.case.lab import Observable
from calibrator.case.toml import read_case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.explanations import Measured
from calibrator.diagnosis.interval import interval
from calibrator.diagnosis.verdict import NAMED, NO_GAP, TWO_EFFECTS, Verdict
from calibrator.files import read_text
from calibrator.runs.database import Database
from tests.campaigns.foreign import allowance, fresh
from tests.campaigns.foreign.laboratories import is_complete, read, values_of
from tests.campaigns.foreign.truths import (
    CASE,
    DRAWN,
    IN_A_SERIES,
    IN_LIBRARY,
    OUTSIDE,
    SERIES,
    Laboratory,
    opened,
    series_of,
)
from tests.campaigns.hidden.errors import errors_of
from tests.campaigns.hidden.laboratory import SHIPPED
from tests.campaigns.hidden.rates import smallest
from tests.campaigns.hidden.trials import Judged, disjoint, library, reports

TRIALS = 10
FIRST_SEED = 60_000  # of the errors
# in the folder of a series: what was said of it by the rules that had not seen it, and its truths
JUDGED = "judged.json"
SETTINGS = ("as it is", "with an allowance for the engine")
FRESH = "as it is, after fresh runs"  # of YADE, which can take a name back; first trials only
EVERY = (*SETTINGS, FRESH)


def main(jobs: int) -> None:
    """Judge what is complete of the last series, in so many processes, and write the results.

    Earlier series are known to the rules: what these say of them is in thresholds.json.
    """
    case = read_case(CASE)
    there = list(complete(case))
    last = max((series_of(one.number) for one, *_ in there), default=0)
    numbers = [one.number for one, *_ in there if series_of(one.number) == last]
    if not numbers:
        sys.exit("no laboratory is complete: see the commands at the top of __main__.py")
    with ProcessPoolExecutor(jobs, get_context("spawn"), _begin) as pool:
        results = []
        for result in pool.map(_result, numbers):
            results.append(result)
            said = {name: result[name]["first"] for name in EVERY if name in result}
            print(result["number"], result["kind"], f"{result['size']:.2f}", said, file=sys.stderr)
    figures = {
        **said_of(results),
        "series": last,
        "first_judged": {
            p.parent.name: _without_laboratories(p) for p in SERIES.glob(f"*/{JUDGED}")
        },
        "trials_of_each": TRIALS,
        "engine_standard_errors": {n: rounded(v) for n, v in allowance.standard_errors().items()},
        "smallest_nameable": nameable(case, library(case, Database.read(SHIPPED))),
        "by_laboratory": results,
    }
    write("foreign", json.loads(json.dumps(figures).replace("NaN", "null")))


def _without_laboratories(path: Path) -> dict[str, Any]:
    """What was said of a series as a whole."""
    kept: dict[str, Any] = json.loads(read_text(path))
    kept.pop("by_laboratory")
    return kept


_shared: dict[str, Any] = {}  # of a process: it reads case, library and laboratories once


def _begin() -> None:
    """Make a process ready to judge."""
    case = read_case(CASE)
    there = {one.number: (one, sealed, pool) for one, sealed, pool in complete(case)}
    _shared.update(case=case, whole=library(case, Database.read(SHIPPED)), there=there)


def _result(number: int) -> dict[str, Any]:
    """What is said of the laboratory of that number."""
    case, (laboratory, sealed, pool) = _shared["case"], _shared["there"][number]
    found = ex.experiments(case, case.observables)
    result: dict[str, Any] = {**vars(laboratory), "sealed": sealed}
    result["complete_runs"] = {e.name: len(v) for e, v in zip(found, pool, strict=True)}
    if min(map(len, pool)) >= DRAWN:
        result |= judged(case, laboratory, pool, _shared["whole"])
    return result


def complete(case: Case) -> Iterator[tuple[Laboratory, str, list[np.ndarray]]]:
    """The complete laboratories, their seals, and the runs (runs, n) of each experiment."""
    rows, found = read(), ex.experiments(case, case.observables)
    for number, (laboratory, sealed) in sorted(opened().items()):
        if is_complete(rows, number, found):
            yield laboratory, sealed, [values_of(rows, number, e) for e in found]


def said_of(results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The figures of one series."""
    good = [r for r in results if SETTINGS[0] in r]
    return {
        "laboratories": len(results),
        "of": IN_A_SERIES,
        "without_five_complete_runs": [r["number"] for r in results if SETTINGS[0] not in r],
        "without_fresh_runs": [r["number"] for r in good if FRESH not in r],
        **{name: counts([r for r in good if name in r], name) for name in EVERY},
    }


def trial(
    case: Case, laboratory: Laboratory, pool: list[np.ndarray], whole: Judged, index: int
) -> tuple[list[Observable], Measured]:
    """What a laboratory reports in one of its trials, the first of which counts."""
    rng = np.random.default_rng([laboratory.number, index])
    errors = errors_of(case.nuisances, FIRST_SEED + laboratory.number)
    return reports(case, disjoint(pool, rng, DRAWN)[0], whole, rng, errors)


def verdict_on(laboratory: Laboratory, whole: Judged, measured: Measured, index: int) -> Verdict:
    """What is said of a trial before any fresh run."""
    return whole.verdict(measured, np.random.default_rng([laboratory.number, index, 1]))


def judged(
    case: Case, laboratory: Laboratory, pool: list[np.ndarray], whole: Judged
) -> dict[str, Any]:
    """What is said of a laboratory in each setting, by trial, and the frictions of the first."""
    ordered = ex.in_order(case.observables, ex.experiments(case, case.observables))
    verdicts: dict[str, list[Verdict]] = {name: [] for name in SETTINGS}
    first: dict[str, Measured] = {}
    for i in range(TRIALS):
        reported, measured = trial(case, laboratory, pool, whole, i)
        more = np.diag(allowance.variances(ordered, measured.values))
        for name, extra in zip(SETTINGS, (0.0, more), strict=True):
            own = replace(measured, covariance=measured.covariance + extra)
            first.setdefault(name, own)
            verdicts[name].append(verdict_on(laboratory, whole, own, i))
        if not i:
            outlived = fresh.outlived(
                case, whole, reported, measured, verdicts[SETTINGS[0]][0], dry=True
            )
    found = {
        name: {
            "first": words(own[0].kind, own[0].effects),
            "all": dict(Counter(words(v.kind, v.effects) for v in own)),
            "p_of_no_gap": rounded(own[0].picture.none.adequacy(whole.surfaces.degrees)),
            "frictions": frictions(case, laboratory, whole, first[name], own[0]),
        }
        for name, own in verdicts.items()
    }
    if outlived is not None:
        said = words(*outlived[:2])
        found[FRESH] = {**found[SETTINGS[0]], "first": said, "all": {said: 1}}
    return found


def confirm(case: Case) -> None:
    """Make the fresh runs that may take the names of first trials back, last series first; resumes.

    The verdicts on a laboratory rest on shipped runs alone, so that the order changes none.
    """
    whole = library(case, Database.read(SHIPPED))
    newest_first = sorted(complete(case), key=lambda one: -series_of(one[0].number))
    for laboratory, _, pool in newest_first:
        if min(map(len, pool)) < DRAWN:
            continue
        reported, measured = trial(case, laboratory, pool, whole, 0)
        verdict = verdict_on(laboratory, whole, measured, 0)
        outlived = fresh.outlived(case, whole, reported, measured, verdict, dry=False)
        assert outlived is not None
        kind, effects, records = outlived
        if records:
            fresh.keep(records)
        if verdict.best is not None:
            was = words(verdict.kind, verdict.effects)
            print(laboratory.number, f"{was} -> {words(kind, effects)}", flush=True)


def words(kind: str, effects: Sequence[str]) -> str:
    """A verdict in words: its kind and the effects that it has."""
    return f"{kind}: {', '.join(effects)}" if effects else kind


def frictions(
    case: Case, laboratory: Laboratory, whole: Judged, measured: Measured, verdict: Verdict
) -> dict[str, list[float]]:
    """Truth, best fit and the ends of its 95 % interval by profile likelihood, of each friction.

    The fit is that with the named effect, or of the model as it is.
    """
    fit, used = verdict.best or verdict.picture.none, measured.only(whole.used)
    found = {}
    for i, (name, own) in enumerate(zip(case.problem.names, case.problem.parameters, strict=True)):
        ends = interval(whole.surfaces, used, whole.effects, fit, whole.used, i)
        best, low, high = own.values_at(np.array([fit.unit[i], *ends]))
        found[name] = [rounded(float(v)) for v in (laboratory.parameters[name], best, low, high)]
    return found


def counts(results: Sequence[dict[str, Any]], name: str) -> dict[str, Any]:
    """Laboratories of each kind by what was said of them."""
    nothing = [r for r in results if r["kind"] == "nothing"]
    single = [r for r in results if r["kind"] in IN_LIBRARY]
    outside = [r for r in results if r["kind"] in OUTSIDE]

    def said(own, test):
        """By the first trial, and in any trial."""
        return {
            "first_trial": share([test(r, r[name]["first"]) for r in own]),
            "any_trial": share([any(test(r, s) for s in r[name]["all"]) for r in own]),
        }

    fitted = nothing + [r for r in single if r[name]["first"] == true_name(r)]
    return {
        "false_alarms": said(nothing, lambda r, s: s != NO_GAP),
        "false_names": said(nothing, lambda r, s: prints(s)),
        "names_true": said(single, lambda r, s: s == true_name(r)),
        "names_wrong": said(single, lambda r, s: prints(s) and s != true_name(r)),
        "gap_seen": said(single, lambda r, s: s != NO_GAP),
        "outside_named": said(outside, lambda r, s: prints(s)),
        "outside_gap_seen": said(outside, lambda r, s: s != NO_GAP),
        "frictions_in_interval": {
            p: share([inside(r[name]["frictions"][p]) for r in fitted])
            for p in (results[0]["parameters"] if results else ())
        },
        "by_kind": {
            kind: dict(Counter(r[name]["first"] for r in results if r["kind"] == kind))
            for kind in sorted({r["kind"] for r in results})
        },
    }


def true_name(result: dict[str, Any]) -> str:
    """The words of the right verdict on an effect of the library."""
    return f"{NAMED}: {result['kind']}"


def prints(said: str) -> bool:
    """Whether a verdict in words gives a name, or two."""
    return said.startswith((f"{NAMED}:", f"{TWO_EFFECTS}:"))


def inside(row: Sequence[float]) -> bool:
    """Whether the truth lies in the interval; see `frictions`."""
    return row[2] <= row[0] <= row[3]


def share(found: Sequence[bool]) -> dict[str, Any]:
    """Count, total, and the exact 95 % interval of the share (Clopper and Pearson).

    Biometrika 26 (1934) 404-413.
    """
    if not found:
        return {"count": 0, "of": 0, "interval": None}
    ends = binomtest(sum(found), len(found)).proportion_ci(0.95, "exact")
    interval = [rounded(float(ends.low), 3), rounded(float(ends.high), 3)]
    return {"count": int(sum(found)), "of": len(found), "interval": interval}


def nameable(case: Case, whole: Judged) -> dict[str, Any]:
    """The size from which each effect is named at the centre of the box, in either setting."""
    ordered = ex.in_order(case.observables, ex.experiments(case, case.observables))
    centre = np.full(whole.surfaces.dimensions, 0.5)
    values = whole.surfaces.mean(centre, np.zeros(len(whole.effects)))[0]
    extra = np.diag(allowance.variances(ordered, values))
    found = [smallest(case, whole, more) for more in (0.0, extra)]
    return {
        one["effect"]: {
            setting: rounded(own["smallest_nameable"], 3)
            for setting, own in zip(SETTINGS, (one, other), strict=True)
        }
        for one, other in zip(*found, strict=True)
    }
