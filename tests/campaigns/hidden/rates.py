"""How often verdicts are right, by laboratory, with intervals."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from calibrator.case.case import Case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.preflight import powers
from calibrator.diagnosis.verdict import linear
from tests.campaigns.hidden.intervals import exact, interval, laboratories_with, upper
from tests.campaigns.hidden.laboratory import REPLICATES
from tests.campaigns.hidden.trials import Judged, Trial
from tests.campaigns.hidden.truths import AMPLITUDES, CONTROL

BOOTSTRAPS = 1000


def prints_names(t: Trial) -> bool:
    """Whether a name was given, or two."""
    return t.verdict.kind in ("named", "two effects")


def is_right(t: Trial) -> bool:
    """Whether the names that were printed are what was hidden."""
    return prints_names(t) and sorted(t.verdict.effects) == sorted(t.hidden)


def is_part(t: Trial) -> bool:
    """Whether the names that were printed are among what was hidden, if perhaps not all of it."""
    return prints_names(t) and set(t.verdict.effects) <= set(t.hidden)


def by_pool(
    trials: Sequence[Trial], value: Callable[[Sequence[Trial]], float]
) -> tuple[float, float]:
    """95 % interval of a statistic, resampling whole pools."""
    rng, pools = np.random.default_rng(1), {}
    for t in trials:
        pools.setdefault(t.pool, []).append(t)
    groups = list(pools.values())
    drawn = [
        value([t for i in rng.integers(len(groups), size=len(groups)) for t in groups[i]])
        for _ in range(BOOTSTRAPS)
    ]
    return float(np.nanquantile(drawn, 0.025)), float(np.nanquantile(drawn, 0.975))


def counted(
    trials: Sequence[Trial], good: Callable[[Trial], bool], name: str, stem: str, whole: bool = True
) -> dict[str, Any]:
    """A share of trials under its name, with its intervals by laboratory under a stem.

    `_interval` is that of the share of trials, from as many as they are worth; `_laboratories`
    counts those of whose trials all are good (any, unless `whole`), and `_interval_by_pool` is the
    exact one of that share.
    """
    hits, pools = [good(t) for t in trials], [t.pool for t in trials]
    some, number = laboratories_with(hits, pools, whole)
    return {
        name: sum(hits) / max(len(hits), 1),
        f"{stem}_trials": [sum(hits), len(hits)],
        f"{stem}_interval": interval(hits, pools),
        f"{stem}_laboratories": [some, number],
        f"{stem}_interval_by_pool": exact(some, number),
    }


def rates(trials: Sequence[Trial]) -> dict[str, Any]:
    """The figures that the project promises."""
    whole = [t for t in trials if not t.withheld]
    nothing = [t for t in whole if t.strength == "none"]
    single = [t for t in whole if t.strength in AMPLITUDES and t.label != CONTROL]
    outside = [t for t in trials if t.strength == "outside" or t.withheld]
    return {
        "laboratories": len({t.pool for t in trials}),
        **alarms(nothing),
        **_names(whole, single, outside),
        **_gaps([t for t in single if is_right(t)]),
        **_simpler_rules(nothing, single, outside),
        "trials": len(trials),
    }


def is_alarm(t: Trial) -> bool:
    """Whether anything was reported."""
    return t.verdict.kind != "no gap"


def alarms(nothing: Sequence[Trial]) -> dict[str, Any]:
    """How often something is reported where nothing is hidden; the bound is one-sided."""
    found = counted(nothing, is_alarm, "false_alarm_rate", "false_alarm", whole=False)
    return {**found, "false_alarm_upper95": upper(*found["false_alarm_laboratories"])}


def _names(
    whole: Sequence[Trial], single: Sequence[Trial], outside: Sequence[Trial]
) -> dict[str, Any]:
    """How often the names that are printed are right, and how often there is one."""
    printed = [t for t in whole if t.strength != "outside" and prints_names(t)]
    detected = [t for t in single if t.verdict.kind not in ("no gap", "cannot tell")]
    pairs = [t for t in whole if t.strength == "pair"]
    found = {
        **counted(printed, is_right, "name_precision_in_library", "name_precision"),
        "name_precision_if_part_counts": share(printed, is_part, lambda t: True),
    }
    for strength in AMPLITUDES:
        own = [t for t in single if t.strength == strength]
        found |= counted(own, is_right, f"{strength}_named_rate", f"{strength}_named")
    return {
        **found,
        **counted(pairs, is_right, "pairs_named_rate", "pairs_named"),
        **counted(
            outside, prints_names, "outside_wrongly_named_rate", "outside_wrongly_named", False
        ),
        **counted(detected, covered, "set_coverage", "set_coverage"),
        **counted(
            [t for t in single if t.ends is not None and is_right(t)],
            lambda t: t.ends is not None and t.ends[0] <= t.size <= t.ends[1],
            "amplitude_in_interval_rate",
            "amplitude_in_interval",
        ),
    }


def _gaps(correct: Sequence[Trial]) -> dict[str, Any]:
    """How much of the gap a right name closes."""
    return {
        "heldout_gap_trials": len(correct),
        "heldout_gap_trials_without_gap": sum(
            not np.isfinite(t.gaps["held_out_closed"]) for t in correct
        ),
        "heldout_gap_closed_median": median(correct, "held_out_closed"),
        "heldout_gap_closed_ci95": by_pool(correct, lambda own: median(own, "held_out_closed")),
        "heldout_gap_closed_ghost_median": median(correct, "held_out_ghost"),
        "heldout_gap_closed_runner_up_median": median(correct, "held_out_runner_up"),
        "used_gap_closed_median": median(correct, "used_closed"),
        "used_gap_closed_ci95": by_pool(correct, lambda own: median(own, "used_closed")),
    }


def _simpler_rules(
    nothing: Sequence[Trial], single: Sequence[Trial], outside: Sequence[Trial]
) -> dict[str, Any]:
    """The same by rules that look at the lowest chi2 only."""
    return {
        "best_chi2_precision": share(single, lambda t: t.best_chi2 == t.label, lambda t: True),
        "naive_best_chi2_precision": share(
            single, lambda t: t.naive == t.label, lambda t: t.naive != "none"
        ),
        "naive_best_chi2_false_alarm_rate": share(
            nothing, lambda t: t.naive != "none", lambda t: True
        ),
        "bic_precision": share(single, lambda t: t.bic == t.label, lambda t: t.bic != "none"),
        **counted(
            nothing, lambda t: t.bic != "none", "bic_false_alarm_rate", "bic_false_alarm", False
        ),
        "bic_outside_named_rate": share(outside, lambda t: t.bic != "none", lambda t: True),
    }


def covered(t: Trial) -> bool:
    """Whether the truth is in what was printed;

    `unknown` prints no effect of the library, so it leaves the truth out.
    """
    return t.label in t.verdict.effects


def share(
    trials: Sequence[Trial], good: Callable[[Trial], bool], among: Callable[[Trial], bool]
) -> float:
    """Share of good ones among those that count."""
    counted = [t for t in trials if among(t)]
    return sum(map(good, counted)) / max(len(counted), 1)


def median(trials: Sequence[Trial], key: str) -> float:
    """Median of a closed share over the trials that have a gap there."""
    values = [t.gaps[key] for t in trials if np.isfinite(t.gaps.get(key, np.nan))]
    return float(np.median(values)) if values else float("nan")


def matrix(trials: Sequence[Trial]) -> dict[str, dict[str, int]]:
    """What was said by what was hidden."""
    table: dict[str, Counter[str]] = {}
    for t in trials:
        row = f"{t.label}, {t.strength}" + (", withheld" if t.withheld else "")
        table.setdefault(row, Counter())[t.verdict.said] += 1
    return {row: dict(counts) for row, counts in table.items()}


def amplitudes(trials: Sequence[Trial]) -> list[dict[str, Any]]:
    """True and recovered amplitudes of the effects named rightly, in plausible scales."""
    return [
        {
            "effect": t.label,
            "strength": t.strength,
            "true": t.size,
            "found": t.amplitude[0],
            "error": t.amplitude[1],
            "interval": t.ends,
        }
        for t in trials
        if t.amplitude is not None and is_right(t)
    ]


def amplitude_ratios(trials: Sequence[Trial]) -> list[dict[str, Any]]:
    """Recovered over true amplitudes of the effects named rightly, by effect and strength.

    `errors_off_by` is the root mean square of found less true in units of the printed error, which
    is 1 where that error is right.
    """
    found = []
    named = [t for t in trials if t.amplitude is not None and is_right(t)]
    for key in dict.fromkeys((t.label, t.strength) for t in named):
        own = [t for t in named if (t.label, t.strength) == key]
        sizes = np.array([t.amplitude for t in own])
        true = np.array([t.size for t in own])
        off = (sizes[:, 0] - true) / sizes[:, 1]
        found.append(
            {
                "effect": key[0],
                "strength": key[1],
                "laboratories": len({t.pool for t in own}),
                "trials": len(own),
                "ratio_median": float(np.median(sizes[:, 0] / true)),
                "errors_off_by": float(np.sqrt(np.mean(off**2))),
            }
        )
    return found


def seen(trials: Sequence[Trial]) -> list[dict[str, Any]]:
    """How often an effect shows as a gap, by its true size in plausible scales."""
    single = [t for t in trials if not t.withheld and t.strength in AMPLITUDES]
    found = []
    for key in dict.fromkeys((t.label, t.strength) for t in single):
        own = [t for t in single if (t.label, t.strength) == key]
        some, number = laboratories_with([is_alarm(t) for t in own], [t.pool for t in own], False)
        found.append(
            {
                "effect": key[0],
                "size": abs(own[0].size),
                "seen_trials": [sum(map(is_alarm, own)), len(own)],
                "seen_laboratories": [some, number],
            }
        )
    return found


def smallest(case: Case, judged: Judged, more: np.ndarray | float = 0.0) -> list[dict[str, Any]]:
    """What each effect must be to be seen and named, at the centre of the box.

    more : covariance (n, n) that is added to the observables'.
    """
    centre, none = np.full(judged.surfaces.dimensions, 0.5), np.zeros(len(judged.effects))
    values = judged.surfaces.mean(centre, none)[0]
    ordered = ex.in_order(case.observables, ex.experiments(case, case.observables))
    imagined = [
        replace(o, value=float(v), scatter=0.0, replicates=REPLICATES)
        for o, v in zip(ordered, values, strict=True)
    ]
    measured = observed.measured(
        imagined,
        case.nuisances,
        judged.surfaces,
        [*judged.effects, *judged.uncertain],
        case.diagnosis.day_error,
        centre,
    )
    measured = replace(measured, covariance=measured.covariance + more).only(judged.used)
    picture = linear(judged.surfaces, measured, judged.effects, judged.used)
    return [
        {**vars(own), "strong": AMPLITUDES["strong"] * own.scale}
        for own in powers(judged.effects, picture, judged.surfaces, judged.used)
    ]


def figures(trials: Sequence[Trial]) -> dict[str, Any]:
    """Rates, what was said by what was hidden, amplitudes, and what was seen."""
    return {
        **rates(trials),
        "confusion": matrix(trials),
        "amplitude_ratios": amplitude_ratios(trials),
        "seen": seen(trials),
        "amplitudes": amplitudes(trials),
        "pools": len({t.pool for t in trials}),
    }
