"""Blocks on how many runs are needed, and on what is said of targets out of reach."""

import re
from typing import Any

import numpy as np

from benchmarks.paper.sources import ADAPTIVE, Sources, table, with_error, workspace
from calibrator.plan.run import database_records


def runs_block(sources: Sources) -> str:
    """Runs that each method needs, peers counted in three ways."""
    rows = []
    found = sources.measured("runs_needed")
    for parameters in ("2", "5"):
        for name, own in found[parameters].items():
            peer = "by_itself" in own
            ways = [
                own["verified"] if peer else own,
                own.get("by_itself"),
                own if peer else own.get("oracle"),
            ]
            error = f"{own['worst_relative_error_median']:.1%}"
            rows.append(
                [
                    parameters,
                    name,
                    *(_needed(way, own["seeds"]) if way else "" for way in ways),
                    error,
                ]
            )
    head = [
        "parameters",
        "method",
        "verified: runs, median (failures)",
        "by its own rule",
        "by an oracle",
        "worst error, median",
    ]
    return table(head, rows)


def adaptive_block(sources: Sources) -> str:
    """The adaptive design on YADE itself: targets, and the runs that confirm its set."""
    space = workspace(ADAPTIVE)
    outcome, records = space.summary()["run"], database_records(space)
    at = [
        r
        for r in records
        if all(r.request.value(n) == v for n, v in outcome["recommended"].items())
    ]
    rows = []
    for target in space.case.problem.targets:
        values = np.array([r.responses[target.response] for r in at])
        error = values.std(ddof=1) / np.sqrt(len(values))
        cells = [
            f"{target.value:.4g}",
            with_error(values.mean(), error),
            f"{values.mean() / target.value - 1:+.1%}",
        ]
        rows.append([target.response.replace("_", " "), *cells])
    found = ", ".join(f"{n.replace('_', ' ')} {v:.4g}" for n, v in outcome["recommended"].items())
    head = ["response", "target", f"mean of {len(at)} fresh runs", "difference"]
    return f"{outcome['runs']} runs in all; {outcome['sentence']}: {found}.\n\n{table(head, rows)}"


def _needed(own: dict[str, Any], seeds: int) -> str:
    median = own["median_runs"]
    return f"{'never' if median is None else format(median, 'g')} ({own['failures']} of {seeds})"


def unreachable_block(sources: Sources) -> str:
    """What each method says of a density 7 % beyond the box."""
    rows = []
    for parameters, methods in sources.measured("runs_needed")["unreachable"].items():
        for name, own in methods.items():
            said = " ".join(re.sub("={4,}", "", own["said"]).split()).replace("|", "/")
            flagged = f"{own['flagged']} of {own['seeds']}"
            cells = [
                f"{own['median_runs']:g}",
                f"{own['worst_relative_error_median']:.1%}",
                said[:230],
            ]
            rows.append([parameters, name, flagged, *cells])
    return table(["parameters", "method", "says so", "runs", "worst error", "last words"], rows)
