"""Answers on cases that nobody made by hand: how often is what the calibrator says right?

    python -m tests.campaigns.answers                writes benchmarks/results/answers.json
    python -m tests.campaigns.answers --first 5000 --cases 40 --to FILE     other ones, elsewhere

Four hundred made-up laboratories go from case file to page, on a world in place of YADE whose true
responses are known (worlds.py): one to eight parameters on linear and log scales, grid, Sobol and
adaptive designs, one to ten targets in one to three set-ups, regions where runs clog, crash or do
not settle, noise from 0 to 20 %, the laboratory's own errors, one to ten replicates, repeated and
near-zero targets, targets out of reach or in another unit, constraints, and inputs that are edited
between two verbs. Each ends in a judgement (judge.py), counted over laboratories with its 95 %
interval (Clopper and Pearson 1934); intervals of parameters are counted over parameters, with an
interval from resampling laboratories.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import shutil
import tempfile
import warnings
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from benchmarks.common import write
from tests.campaigns.answers.judge import judged
from tests.campaigns.answers.trial import trial

CASES, FIRST = 400, 100_001  # seeds that no rule was made with
WORKERS = 2


def one(seed: int) -> dict[str, Any]:
    """Judgement of the trial of a seed, in a folder of its own."""
    folder = Path(tempfile.mkdtemp(prefix="answers-"))
    warnings.simplefilter("ignore")
    try:
        return judged(trial(seed, folder))
    finally:
        shutil.rmtree(folder)


def share(wrong: int, of: int) -> dict[str, Any]:
    """A count with the 95 % interval of its share."""
    if of == 0:
        return {"count": wrong, "of": 0}
    low, high = binomtest(wrong, of).proportion_ci(method="exact")
    bounds = [round(float(low), 4), round(float(high), 4)]
    return {"count": wrong, "of": of, "share": round(wrong / of, 4), "interval_95": bounds}


def held(cases: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """How many intervals that do not end at a bound hold the truth; resampled by laboratory."""
    pairs = [
        (sum(i["holds"] for i in own), len(own))
        for c in cases
        if (own := [i for i in c.get("intervals", []) if i["inside_box"]])
    ]
    if not pairs:
        return {"count": 0, "of": 0}
    counts = np.array(pairs, float)
    drawn = counts[np.random.default_rng(1).integers(0, len(counts), (2000, len(counts)))]
    shares = drawn[:, :, 0].sum(1) / drawn[:, :, 1].sum(1)
    return {
        "count": int(counts[:, 0].sum()), "of": int(counts[:, 1].sum()), "laboratories": len(pairs),
        "share": round(float(counts[:, 0].sum() / counts[:, 1].sum()), 4),
        "interval_95": np.quantile(shares, [0.025, 0.975]).round(4).tolist(),
    }  # fmt: skip


def counted(cases: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The counts over all trials."""
    total = len(cases)
    verified = [c for c in cases if "passed" in c]
    reachable = [c for c in cases if c.get("truly_reachable") is True]
    unreachable = [c for c in cases if c.get("truly_reachable") is False]
    edited = [c for c in cases if c["ended"] == "edited"]
    return {
        "cases": total,
        "ended": dict(Counter(c["ended"] for c in cases)),
        "tracebacks": share(sum(bool(c["traceback"]) for c in cases), total),
        "stale_answers": share(sum(bool(c["stale"]) for c in edited), len(edited)),
        "statuses_against_words": share(sum(bool(c["status_against_words"]) for c in cases), total),
        "contradictions": share(sum(bool(c["contradictions"]) for c in cases), total),
        "over_the_ceiling": share(sum(c["over_ceiling"] for c in cases), total),
        "wrong_passed": share(sum(c["wrong_passed"] for c in verified), len(verified)),
        "wrong_missed": share(sum(c["wrong_missed"] for c in verified), len(verified)),
        "verdicts_that_cannot_tell": share(sum(c["cannot_tell"] for c in verified), len(verified)),
        "passed": share(sum(c["passed"] for c in verified), len(verified)),
        "reachable_called_unreachable": share(
            sum(c["called_reachable"] is False for c in reachable), len(reachable)
        ),
        "unreachable_called_reachable": share(
            sum(c["called_reachable"] is True for c in unreachable), len(unreachable)
        ),
        "intervals_that_hold_the_truth": held(cases),
        "intervals_at_a_bound": sum(
            not i["inside_box"] for c in cases for i in c.get("intervals", [])
        ),
    }


def main() -> None:
    """Carry out the campaign, print its counts and write them."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--cases", type=int, default=CASES, help="how many laboratories")
    parser.add_argument("--first", type=int, default=FIRST, help="seed of the first")
    parser.add_argument("--to", type=Path, metavar="FILE", help="where the results go")
    options = parser.parse_args()
    cases = []
    with multiprocessing.get_context("spawn").Pool(WORKERS, maxtasksperchild=20) as pool:
        for found in pool.imap(one, range(options.first, options.first + options.cases)):
            cases.append(found)
            print(found["seed"], found["ended"], notable(found), flush=True)
    results = {**counted(cases), "first_seed": options.first, "trials": cases}
    print(json.dumps({k: v for k, v in results.items() if k != "trials"}, indent=1))
    if options.to:
        options.to.write_text(json.dumps(results, indent=1) + "\n")
    else:
        write("answers", results)


def notable(found: dict[str, Any]) -> str:
    """What went wrong in a trial, in a few words."""
    words = [k for k in ("wrong_passed", "wrong_missed", "over_ceiling") if found.get(k)]
    words += [f"{k}: {found[k]}" for k in ("stale", "status_against_words", "contradictions",
                                           "refusal") if found[k]]  # fmt: skip
    if found["traceback"]:
        words.append(found["traceback"].strip().splitlines()[-1][:200])
    reach = found.get("truly_reachable"), found.get("called_reachable")
    if reach in ((True, False), (False, True)):
        words.append(f"reach {found['closest']:.2g} bands, called {reach[1]}")
    return "; ".join(words)
