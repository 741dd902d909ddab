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
    for task, share in found["data"]["share_of_the_box_that_meets_the_targets"].items():
        for name, own in found[task].items():
            peer = "by_itself" in own
            ways = [
                own["verified"] if peer else own,
                own.get("by_itself"),
                own if peer else own.get("oracle"),
            ]
            error = f"{own['worst_relative_error_median']:.1%}"
            cells = [_needed(way, own["seeds"]) if way else "" for way in ways]
            rows.append([f"{task}, {share:.1%} of the box", name, *cells, error])
    head = [
        "parameters",
        "method",
        "verified: runs, median, 95 % (failures)",
        "by its own rule",
        "by an oracle",
        "worst error, median",
    ]
    return table(head, rows)


def ratios_block(sources: Sources) -> str:
    """Runs of the peers over ours, where each peer's set is verified after every round."""
    rows = []
    for task, own in sources.measured("runs_needed")["verdict"].items():
        for way in ("verified", "by_itself", "oracle"):
            for name, one in own[way].items():
                low, high = one["interval"]
                said = f"{one['times_ours']:g} ({low:g} to {high:g})"
                rows.append([task, name, way.replace("_", " "), said, one["fewer"]])
    return table(["parameters", "peer", "way", "its runs over ours, 95 %", "fewer"], rows)


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
    low, high = own["median_interval"]
    return f"{own['median_runs']:g}, {low:g} to {high:g} ({own['failures']} of {seeds})"


def unreachable_block(sources: Sources) -> str:
    """What each method says and returns of a density 7 % beyond the box."""
    rows = []
    measured = sources.measured("runs_needed")
    for task, methods in measured["unreachable"].items():
        for name, own in methods.items():
            said = " ".join(re.sub("={4,}", "", own["said"]).split()).replace("|", "/")
            if own["flagged"] is None:
                speaks = f"a line that could: {own['could_speak_of_reach']} of {own['seeds']}"
            else:
                speaks = f"{own['flagged']} of {own['seeds']}"
            ended = ", ".join(f"{kind} {count}" for kind, count in own.get("ended", {}).items())
            errors = [
                "" if one.get("own_error_median") is None else f"{one['own_error_median']:g}"
                for one in (own, measured[task][name])
            ]
            error = f"{own['worst_relative_error_median']:.1%}"
            cells = [speaks, ended, f"{own['median_runs']:g}", error]
            rows.append([task, name, *cells, " / ".join(filter(None, errors)), said[:160]])
    head = ["parameters", "method", "says so", "ended by", "runs", "worst error of what it returns"]
    return table([*head, "own error, here / where in reach", "last words"], rows)
