"""Runs until the recommended set, verified, meets every target: ours, other designs, two peers.

    python -m benchmarks.peers.runs_needed                    40 minutes; pip fetches the peers
    python -m benchmarks.peers.runs_needed --quick            two seeds, prints only: a smoke test
    python -m benchmarks.peers.runs_needed --seeds 8          fewer seeds than 20
    python -m benchmarks.peers.runs_needed --kept O.jsonl     goes on from the outcomes in a file
    python -m benchmarks.peers.runs_needed --database D.csv   another database of the same case
    python -m benchmarks.peers.runs_needed --methods "a;b"    only these, nothing written

Writes benchmarks/results/runs_needed.json and .png. No simulation: a run is a quadratic surface
through the real runs of cases/quartz_sand_reduced.toml, with the shifts by which real pairs depart
from similarity (truth.py), plus normal noise of the size that its replicates show; no method fits
that family. Every seed draws a true set from the central 80 % of each range; its mean responses are
the targets, so they can be met. A set meets them where each noise-free response lies within the
tolerance or, where that is more, two standard errors of the mean of three runs. Three tasks: two
frictions within 2 %, which any method finds soon, as a large share of the box meets them; rolling
friction and particle density within 0.4 %, which less than 5 % of the box meets; and all five
parameters within 2 %.

Who counts what. Ours and the Sobol design stop by their own verification and are judged by the
noise-free surface, which they never see: a confirmed set that misses is a failure. The peers have
no verification, and are counted in three ways. Oracle, their `median_runs`: after each of their
rounds whatever they would recommend is judged by the noise-free surface, and the first hit counts,
plus three runs to verify it; nobody has such an oracle, so this is a lower bound, given for ours as
well. Verified: what they report is verified by three runs after each round, as the Sobol design's
is, and the first that passes counts. By itself: they stop by their own rule, and three runs verify
what they report. Parameters on a log scale reach them as logarithms. Medians are over all seeds of
what was spent, failures are counted apart. Where a target is out of reach nothing is taken for
granted: all that a peer prints, warnings too, is searched for words that could say so, and what it
returns is judged.
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import RESULTS, rounded, write
from benchmarks.peers.client import REQUIRED
from benchmarks.peers.methods import ONLY, Outcome, Peers, methods
from benchmarks.peers.picture import plot
from benchmarks.peers.rows import reachable_row, unreachable_row, verdicts
from benchmarks.peers.trial import (
    MOST_RUNS,
    TASKS,
    Task,
    Trial,
    reachable_trial,
    unreachable_trial,
)
from benchmarks.peers.truth import RESPONSES, Surface
from calibrator.case.toml import read_case

SCENARIOS: dict[str, tuple[Callable[[Surface, Task, int], Trial], Callable[..., Any]]] = {
    "reachable": (reachable_trial, reachable_row),
    "unreachable": (unreachable_trial, unreachable_row),
}
CASE = Path(__file__).resolve().parents[2] / "cases" / "quartz_sand_reduced.toml"


def measure(
    surface: Surface, seeds: int, chosen: list[str], kept: Path | None = None
) -> dict[str, Any]:
    """All results, by scenario, task and method.

    Seed after seed, so that what is kept in a file of outcomes, a line each, goes on where it was,
    with more seeds too.
    """
    peers, done = Peers(), outcomes_in(kept)
    try:
        for seed, (scenario, label, name) in itertools.product(range(1, seeds + 1), cells(chosen)):
            if (key := f"{scenario}, {label}, {name}, {seed}") in done:
                continue
            begin = time.perf_counter()
            trial = SCENARIOS[scenario][0](surface, TASKS[label], seed)
            done[key] = methods(peers)[name](trial)
            print(key, done[key], f"{time.perf_counter() - begin:.0f} s", flush=True)
            if kept:
                with kept.open("a") as file:
                    file.write(json.dumps({"key": key, **asdict(done[key])}) + "\n")
    finally:
        peers.close()
    results: dict[str, Any] = {}
    for scenario, label, name in cells(chosen):
        own = [done[f"{scenario}, {label}, {name}, {seed}"] for seed in range(1, seeds + 1)]
        rows = results.setdefault(scenario, {}).setdefault(label, {})
        rows[name] = SCENARIOS[scenario][1](own)
    return results


def cells(chosen: list[str]) -> list[tuple[str, str, str]]:
    """Scenario, task and method of everything that is measured."""
    return [
        (scenario, label, name)
        for scenario, (label, task) in itertools.product(SCENARIOS, TASKS.items())
        for name in methods(Peers())
        if (not chosen or name in chosen) and ONLY.get(name, len(task.grid)) == len(task.grid)
    ]


def outcomes_in(kept: Path | None) -> dict[str, Outcome]:
    """Outcomes of a file by key; none where there is no file."""
    lines = kept.read_text().splitlines() if kept and kept.exists() else []
    rows = [json.loads(line) for line in lines]
    return {row.pop("key"): Outcome(**row) for row in rows}


def share(surface: Surface, task: Task, seeds: int) -> float:
    """Share of the box that meets the targets, the median over the seeds."""
    found = [reachable_trial(surface, task, seed).share() for seed in range(1, seeds + 1)]
    return rounded(float(np.median(found)), 3)


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="two seeds, nothing written")
    parser.add_argument(
        "--database", type=Path, help="runs of the case, if not those that it ships with"
    )
    parser.add_argument(
        "--methods",
        type=lambda s: s.split(";"),
        default=[],
        help="names separated by semicolons; nothing written",
    )
    parser.add_argument("--kept", type=Path, help="file of outcomes to go on from")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder to write to")
    return parser.parse_args()


def main() -> None:
    """Measure, write, draw."""
    given = arguments()
    case = read_case(CASE)
    database = given.database or case.shipped
    if database is None:
        raise SystemExit(f"{CASE.name} ships no database: give one with --database")
    surface = Surface.of(case, database)
    seeds = 2 if given.quick else given.seeds
    measured = measure(surface, seeds, given.methods, given.kept)
    if given.quick or given.methods:
        return
    about = (__doc__ or "").split("\n\n")
    results: dict[str, Any] = {
        "about": " ".join(" ".join(about[2:]).split()),
        "data": {
            "share_of_the_box_that_meets_the_targets": {
                label: share(surface, task, given.seeds) for label, task in TASKS.items()
            },
            "seeds": given.seeds,
            "sets": surface.sets,
            "shifts": dict(
                zip(
                    RESPONSES, map(partial(rounded, digits=3), surface.shifts.tolist()), strict=True
                )
            ),
            "noise": dict(
                zip(RESPONSES, map(partial(rounded, digits=3), surface.noise.tolist()), strict=True)
            ),
            "peers": REQUIRED,
            "most_runs": MOST_RUNS,
        },
        "verdict": verdicts(measured["reachable"]),
        **measured["reachable"],
        "unreachable": measured["unreachable"],
    }
    write("runs_needed", results, given.results)
    plot(measured["reachable"], given.results)


if __name__ == "__main__":
    main()
