"""What a method needed over all seeds, and ours beside each peer, with intervals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import beta

from benchmarks.common import rounded
from benchmarks.peers.methods import OURS, Outcome

WAYS = ("oracle", "verified", "by_itself")
BOOTSTRAPS = 10_000


def needed(runs: Sequence[int], met: Sequence[bool]) -> dict[str, Any]:
    """Runs spent, whether they led to a set that meets the targets or not, and failures apart.

    A failure has spent what it has spent: it is no infinite number of runs, and its count has an
    interval of its own (Clopper and Pearson, Biometrika 26 (1934) 404-413).
    """
    failures, seeds = list(met).count(False), len(met)
    low = float(beta.ppf(0.025, failures, seeds - failures + 1)) if failures else 0.0
    high = float(beta.ppf(0.975, failures + 1, seeds - failures)) if failures < seeds else 1.0
    return {
        "median_runs": float(np.median(runs)),
        "median_interval": interval(runs),
        "failures": failures,
        "failure_interval": [rounded(low, 3), rounded(high, 3)],
        "runs": list(runs),
        "met": list(met),
    }


def interval(runs: Sequence[int]) -> list[float]:
    """95 % interval of the median, by resampling seeds."""
    drawn = np.random.default_rng(1).integers(len(runs), size=(BOOTSTRAPS, len(runs)))
    medians = np.median(np.array(runs, float)[drawn], axis=1)
    return [float(q) for q in np.quantile(medians, (0.025, 0.975))]


def ratio(theirs: Sequence[int], ours: Sequence[int]) -> dict[str, Any]:
    """Ratio of the medians with its 95 % interval, resampling seeds, which both have in common."""
    drawn = np.random.default_rng(1).integers(len(ours), size=(BOOTSTRAPS, len(ours)))
    medians = [np.median(np.array(own, float)[drawn], axis=1) for own in (theirs, ours)]
    low, high = np.quantile(medians[0] / medians[1], (0.025, 0.975))
    fewer = "ours" if low > 1 else "theirs" if high < 1 else "no claim"
    return {
        "times_ours": rounded(float(np.median(theirs) / np.median(ours)), 3),
        "interval": [rounded(float(low), 3), rounded(float(high), 3)],
        "fewer": fewer,
    }


def reachable_row(outcomes: list[Outcome]) -> dict[str, Any]:
    """What a method needed over all seeds."""
    row: dict[str, Any] = {
        **needed([o.runs for o in outcomes], [o.met for o in outcomes]),
        "seeds": len(outcomes),
        "worst_relative_error_median": rounded(float(np.median([o.worst for o in outcomes])), 3),
    }
    for way in WAYS:
        pairs = [pair for o in outcomes if (pair := getattr(o, way))]
        if pairs:
            row[way] = needed([r for r, _ in pairs], [m for _, m in pairs])
    return row | words(outcomes)


def unreachable_row(outcomes: list[Outcome]) -> dict[str, Any]:
    """How a method ended where no set meets the targets.

    Its words are those of the first seed.
    """
    verdicts = [o.flagged for o in outcomes if o.flagged is not None]
    runs = [o.by_itself[0] if o.by_itself else o.runs for o in outcomes]
    return {
        "flagged": sum(verdicts) if verdicts else None,
        "seeds": len(outcomes),
        "median_runs": float(np.median(runs)),
        "worst_relative_error_median": rounded(float(np.median([o.worst for o in outcomes])), 3),
        **words(outcomes),
        "said": outcomes[0].said,
    }


def words(outcomes: list[Outcome]) -> dict[str, Any]:
    """By what a peer ended, how often a line could speak of reach, and its own error."""
    if not outcomes[0].ended:
        return {}
    lines = Counter(line for o in outcomes for line in set(o.spoken))
    errors = [o.own_error for o in outcomes if o.own_error is not None]
    return {
        "ended": dict(Counter(o.ended for o in outcomes)),
        "could_speak_of_reach": sum(bool(o.spoken) for o in outcomes),
        "such_lines": [line[:200] for line, _ in lines.most_common(3)],
        "own_error_median": rounded(float(np.median(errors)), 3) if errors else None,
    }


def verdicts(reachable: dict[str, Any]) -> dict[str, Any]:
    """Ours beside every peer, in each of the three ways to count."""
    found: dict[str, Any] = {}
    for task, rows in reachable.items():
        ours, oracle = rows[OURS], rows[OURS]["oracle"]
        found[task] = {"ours": ours["median_runs"], "ours_by_oracle": oracle["median_runs"]}
        for way in WAYS:
            found[task][way] = {
                name: ratio(
                    (row if way == "oracle" else row[way])["runs"],
                    (oracle if way == "oracle" else ours)["runs"],
                )
                for name, row in rows.items()
                if "by_itself" in row
            }
    return found
