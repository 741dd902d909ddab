"""How often verdicts are right, with intervals."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import norm

from calibrator.case.case import Case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.preflight import powers
from calibrator.diagnosis.verdict import linear
from tests.campaigns.hidden.laboratory import REPLICATES
from tests.campaigns.hidden.trials import Judged, Trial
from tests.campaigns.hidden.truths import AMPLITUDES, CONTROL

BOOTSTRAPS = 1000


def wilson(count: int, total: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson, J. Am. Stat. Assoc. 22 (1927) 209-212)."""
    if total == 0:
        return float("nan"), float("nan")
    z, p = float(norm.ppf(0.975)), count / total
    centre = (p + z**2 / (2 * total)) / (1 + z**2 / total)
    half = z / (1 + z**2 / total) * np.sqrt(p * (1 - p) / total + z**2 / (4 * total**2))
    return centre - half, centre + half


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


def rates(trials: Sequence[Trial]) -> dict[str, Any]:
    """The figures that the project promises."""
    whole = [t for t in trials if not t.withheld]
    nothing = [t for t in whole if t.strength == "none"]
    single = [t for t in whole if t.strength in AMPLITUDES and t.label != CONTROL]
    outside = [t for t in trials if t.strength == "outside" or t.withheld]
    return {
        **_alarms(nothing),
        **_names(whole, single, outside),
        **_gaps([t for t in single if is_right(t)]),
        **_simpler_rules(nothing, single, outside),
        "trials": len(trials),
    }


def _alarms(nothing: Sequence[Trial]) -> dict[str, Any]:
    """How often something is reported where nothing is hidden."""
    alarms = sum(t.verdict.kind != "no gap" for t in nothing)
    return {
        "false_alarm_rate": alarms / max(len(nothing), 1),
        "false_alarm_upper95": wilson(alarms, len(nothing))[1],
        "false_alarm_interval_by_pool": by_pool(
            nothing, lambda own: float(np.mean([t.verdict.kind != "no gap" for t in own]))
        ),
    }


def _names(
    whole: Sequence[Trial], single: Sequence[Trial], outside: Sequence[Trial]
) -> dict[str, Any]:
    """How often the names that are printed are right, and how often there is one."""
    strong = [t for t in single if t.strength == "strong"]
    printed = [t for t in whole if t.strength != "outside" and prints_names(t)]
    detected = [t for t in single if t.verdict.kind not in ("no gap", "cannot tell")]
    true_names, wrong_names = sum(map(is_right, printed)), sum(map(prints_names, outside))
    return {
        "name_precision_in_library": true_names / max(len(printed), 1),
        "name_precision_interval": wilson(true_names, len(printed)),
        "name_precision_if_part_counts": share(printed, is_part, lambda t: True),
        "strong_named_rate": share(strong, is_right, lambda t: True),
        "strong_named_interval": wilson(sum(map(is_right, strong)), len(strong)),
        "strong_named_interval_by_pool": by_pool(
            strong, lambda own: float(np.mean([is_right(t) for t in own]))
        ),
        "pairs_named_rate": share(
            [t for t in whole if t.strength == "pair"], is_right, lambda t: True
        ),
        "outside_wrongly_named_rate": wrong_names / max(len(outside), 1),
        "outside_wrongly_named_interval": wilson(wrong_names, len(outside)),
        "set_coverage": sum(covered(t) for t in detected) / max(len(detected), 1),
        "set_coverage_interval": wilson(sum(map(covered, detected)), len(detected)),
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
        "bic_false_alarm_rate": share(nothing, lambda t: t.bic != "none", lambda t: True),
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
        }
        for t in trials
        if t.amplitude is not None and is_right(t)
    ]


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
    slopes = judged.surfaces.jacobian(centre, none)[:, judged.surfaces.dimensions :]
    measured = observed.measured(imagined, case.nuisances, judged.surfaces, slopes, judged.effects)
    measured = replace(measured, covariance=measured.covariance + more).only(judged.used)
    picture = linear(judged.surfaces, measured, judged.effects, judged.used)
    return [
        {**vars(own), "strong": AMPLITUDES["strong"] * own.scale}
        for own in powers(judged.effects, picture)
    ]


def figures(trials: Sequence[Trial]) -> dict[str, Any]:
    """Rates, what was said by what was hidden, and amplitudes."""
    pools = len({t.pool for t in trials})
    return {
        **rates(trials),
        "confusion": matrix(trials),
        "amplitudes": amplitudes(trials),
        "pools": pools,
    }
