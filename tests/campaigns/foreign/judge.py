"""The verdicts on the laboratories that are complete, and how often they are right.

A trial draws five of the runs of each experiment and errors of metrology, as in
tests/campaigns/hidden/trials.py, and is judged by the same rules from the same shipped runs of
YADE; the fresh runs by which `diagnose` can take a name back are not made. Trials of a laboratory
share its runs, so laboratories are counted and not trials: by their first one, which makes them
independent, and by whether it ever happens in TRIALS. Each trial is judged with and without the
allowance for the engine (allowance.py).
"""

import json
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import binomtest

from benchmarks.common import rounded, write
from calibrator.case.case import Case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.explanations import Measured
from calibrator.diagnosis.interval import interval
from calibrator.diagnosis.verdict import NAMED, NO_GAP, TWO_EFFECTS, Verdict
from calibrator.runs.database import Database
from tests.campaigns.foreign import allowance
from tests.campaigns.foreign.laboratories import is_complete, read, values_of
from tests.campaigns.foreign.truths import DRAWN, IN_LIBRARY, OUTSIDE, Laboratory, opened
from tests.campaigns.hidden.errors import errors_of
from tests.campaigns.hidden.laboratory import SHIPPED
from tests.campaigns.hidden.rates import smallest
from tests.campaigns.hidden.trials import Judged, disjoint, library, measurements

TRIALS = 10
FIRST_SEED = 60_000  # of the errors
SETTINGS = ("as it is", "with an allowance for the engine")


def main(case: Case) -> None:
    """Judge what is complete and write the results."""
    rows, found = read(), ex.experiments(case, case.observables)
    whole, results = library(case, Database.read(SHIPPED)), []
    for number, (laboratory, sealed) in sorted(opened().items()):
        if not is_complete(rows, number, found):
            continue
        pool = [values_of(rows, number, e) for e in found]
        result: dict[str, Any] = {**vars(laboratory), "sealed": sealed}
        result["complete_runs"] = {e.name: len(v) for e, v in zip(found, pool, strict=True)}
        if min(map(len, pool)) >= DRAWN:
            result |= judged(case, laboratory, pool, whole)
        results.append(result)
        said = {name: result[name]["first"] for name in SETTINGS if name in result}
        print(number, laboratory.kind, f"{laboratory.size:.2f}", said, file=sys.stderr)
    if not results:
        sys.exit("no laboratory is complete: see the commands at the top of __main__.py")
    good = [r for r in results if SETTINGS[0] in r]
    figures = {
        "laboratories": len(results),
        "of": len(opened()),
        "without_five_complete_runs": [r["number"] for r in results if SETTINGS[0] not in r],
        "trials_of_each": TRIALS,
        "engine_standard_errors": {n: rounded(v) for n, v in allowance.standard_errors().items()},
        **{name: counts(good, name) for name in SETTINGS},
        "smallest_nameable": nameable(case, whole),
        "by_laboratory": results,
    }
    write("foreign", json.loads(json.dumps(figures).replace("NaN", "null")))


def judged(
    case: Case, laboratory: Laboratory, pool: list[np.ndarray], whole: Judged
) -> dict[str, Any]:
    """What is said of a laboratory in each setting, by trial, and the frictions of the first."""
    ordered = ex.in_order(case.observables, ex.experiments(case, case.observables))
    verdicts: dict[str, list[Verdict]] = {name: [] for name in SETTINGS}
    first: dict[str, Measured] = {}
    for i in range(TRIALS):
        rng = np.random.default_rng([laboratory.number, i])
        errors = errors_of(case.nuisances, FIRST_SEED + laboratory.number)
        measured = measurements(case, disjoint(pool, rng, DRAWN)[0], whole, rng, errors)
        more = np.diag(allowance.variances(ordered, measured.values))
        for name, extra in zip(SETTINGS, (0.0, more), strict=True):
            own = replace(measured, covariance=measured.covariance + extra)
            first.setdefault(name, own)
            rng = np.random.default_rng([laboratory.number, i, 1])
            verdicts[name].append(whole.verdict(own, rng))
    return {
        name: {
            "first": words(own[0]),
            "all": dict(Counter(map(words, own))),
            "p_of_no_gap": rounded(own[0].picture.none.adequacy(whole.surfaces.degrees)),
            "frictions": frictions(case, laboratory, whole, first[name], own[0]),
        }
        for name, own in verdicts.items()
    }


def words(verdict: Verdict) -> str:
    """The verdict in words: its kind and the effects that it has."""
    return f"{verdict.kind}: {', '.join(verdict.effects)}" if verdict.effects else verdict.kind


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
