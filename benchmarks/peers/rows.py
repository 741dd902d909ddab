"""What a method needed over all seeds, and ours beside the best peer."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from benchmarks.common import rounded
from benchmarks.peers.methods import OURS, Outcome
from benchmarks.peers.trial import BAR


def median_runs(runs: list[int], met: list[bool]) -> float | None:
    """Median in which a failure counts as infinitely many runs; None where that is the median."""
    found = float(np.median([r if m else np.inf for r, m in zip(runs, met, strict=True)]))
    return found if math.isfinite(found) else None


def reachable_row(outcomes: list[Outcome]) -> dict[str, Any]:
    """What a method needed over all seeds."""
    runs, met = [o.runs for o in outcomes], [o.met for o in outcomes]
    row: dict[str, Any] = {
        "median_runs": median_runs(runs, met),
        "failures": met.count(False),
        "seeds": len(outcomes),
        "worst_relative_error_median": rounded(float(np.median([o.worst for o in outcomes])), 3),
        "runs": runs,
        "met": met,
    }
    for way in ("oracle", "verified", "by_itself"):
        pairs = [pair for o in outcomes if (pair := getattr(o, way))]
        if pairs:
            runs, met = [r for r, _ in pairs], [m for _, m in pairs]
            row[way] = {
                "median_runs": median_runs(runs, met),
                "failures": met.count(False),
                "runs": runs,
                "met": met,
            }
    return row


def unreachable_row(outcomes: list[Outcome]) -> dict[str, Any]:
    """How a method ended where no set meets the targets; its words are those of the first seed."""
    return {
        "flagged": sum(o.flagged for o in outcomes),
        "seeds": len(outcomes),
        "median_runs": float(
            np.median([o.by_itself[0] if o.by_itself else o.runs for o in outcomes])
        ),
        "worst_relative_error_median": rounded(float(np.median([o.worst for o in outcomes])), 3),
        "said": outcomes[0].said,
    }


def verdicts(reachable: dict[str, Any]) -> dict[str, Any]:
    """Ours against the bar and, in each of the three ways to count, the best peer."""
    found = {}
    for count, rows in reachable.items():
        by_oracle = rows[OURS]["oracle"]["median_runs"]
        found[count] = {
            "bar": BAR[int(count)],
            "ours": rows[OURS]["median_runs"],
            "ours_by_oracle": by_oracle,
        }
        for way in ("oracle", "verified", "by_itself"):
            ours = by_oracle if way == "oracle" else rows[OURS]["median_runs"]
            medians = {
                p: (rows[p] if way == "oracle" else rows[p][way])["median_runs"]
                for p in rows
                if "by_itself" in rows[p]
            }
            best = min(medians, key=lambda p: medians[p] or math.inf)
            fewer = rounded(medians[best] / ours, 3) if ours and medians[best] else None
            found[count][f"best_peer_{way}"] = {
                "method": best,
                "median_runs": medians[best],
                "times_ours": fewer,
            }
    return found
