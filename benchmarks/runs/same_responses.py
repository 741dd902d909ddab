"""Are the responses still what they were when a run cost twice as much?

    python -m benchmarks.runs.same_responses [coarse_sand] [quartz]     resumable

Parameter sets with three seeds each, by old and new scripts; about 35 core-minutes each hourglass.

The demo's own plan, 24 other sets of two seeds, is compared too: as shipped then and now.

Writes benchmarks/results/same_responses.json and .png. "shift" is the mean change of a response
over the sets with its standard error, "z" the change of each set over the error that the seeds
leave it; the p values are of permutation tests, of a shift of all sets and of a change of any.
"""

import os
import subprocess
import sys
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import matplotlib
import numpy as np
from scipy.stats import qmc

from benchmarks.common import RESULTS, rounded, write
from benchmarks.runs.dem import (
    HOURGLASSES,
    REPO,
    START,
    START_NUMERICS,
    WORK,
    run_hourglass,
    scripts_at,
)
from calibrator.runs.database import Database

matplotlib.use("Agg")
import matplotlib.pyplot as plt

MODULUS = {"coarse_sand": (0.5e6, 4e6), "quartz": (5e6, 5e7)}
RESPONSES = (
    "bulk_density",
    "drained_equivalent_angle_deg",
    "residual_fraction",
    "mass_flow_rate",
    "emptying_time",
)
SETS, SEEDS = {"coarse_sand": 10, "quartz": 4}, (71_001, 71_002, 71_003)
WORKERS = int(os.environ.get("WORKERS", 2))


def sets(case: str) -> list[dict]:
    """Parameter sets over frictions and Young's modulus."""
    box = {
        "rolling_friction": (0.05, 0.45),
        "sliding_friction": (0.2, 0.7),
        "young_modulus": MODULUS[case],
    }
    points = qmc.scale(qmc.Halton(3, seed=1).random(SETS[case]), *zip(*box.values(), strict=True))
    return [{**HOURGLASSES[case], **dict(zip(box, map(float, p), strict=True))} for p in points]


def responses(case: str) -> dict[str, np.ndarray]:
    """Values (sets, seeds, responses) by "start" and "now", and "statuses" (2, runs).

    A value is NaN where a run clogged.
    """
    scripts_at(START)
    jobs = [
        (c, {**p, **n, "seed": s})
        for p in sets(case)
        for s in SEEDS
        for c, n in ((START, START_NUMERICS), ("", {}))
    ]
    with ThreadPoolExecutor(WORKERS) as pool:
        records = list(pool.map(lambda job: run_hourglass(*job), jobs))
    values = np.array([[r["responses"].get(name, np.nan) for name in RESPONSES] for r in records])
    values = values.reshape(SETS[case], len(SEEDS), 2, len(RESPONSES))
    statuses = np.array([r["status"] for r in records]).reshape(-1, 2).T
    return {"start": values[:, :, 0], "now": values[:, :, 1], "statuses": statuses}


def permutation_p(
    old: np.ndarray, new: np.ndarray, statistic: Callable[[np.ndarray], float], times: int = 4000
) -> float:
    """Chance of so large a statistic of the sets' changes if it does not matter which is new.

    Unlike a chi-square test it does not take the seed noise to be the same in all sets, which it is
    not.
    """
    rng, runs = np.random.default_rng(1), np.concatenate([old, new], axis=1)

    def value(both: np.ndarray) -> float:
        return statistic(
            np.nanmean(both[:, old.shape[1] :], 1) - np.nanmean(both[:, : old.shape[1]], 1)
        )

    with warnings.catch_warnings():
        # a shuffle may leave one side of a set without a run
        warnings.simplefilter("ignore", RuntimeWarning)
        drawn = np.array([value(rng.permuted(runs, axis=1)) for _ in range(times)])
    return float((1 + (drawn >= value(runs) * (1 - 1e-12)).sum()) / (1 + np.isfinite(drawn).sum()))


def compared(found: dict[str, np.ndarray]) -> dict:
    """Per response: seed noise then and now, mean change, and its chance by seeds alone."""
    out: dict = {
        "statuses": {
            when: Counter(map(str, s))
            for when, s in zip(("start", "now"), found["statuses"], strict=True)
        }
    }
    for i, name in enumerate(RESPONSES):
        old, new = found["start"][..., i], found["now"][..., i]
        counts = np.array([(~np.isnan(v)).sum(1) for v in (old, new)])
        use = (counts >= 2).all(0)
        noise = [float(np.sqrt(np.nanmean(np.nanvar(v[use], axis=1, ddof=1)))) for v in (old, new)]
        error = np.sqrt(noise[0] ** 2 / counts[0] + noise[1] ** 2 / counts[1])[use]
        change = (np.nanmean(new, 1) - np.nanmean(old, 1))[use]
        shift, shift_error = change.mean(), np.sqrt((error**2).sum()) / use.sum()
        out[name] = {
            "sets": int(use.sum()),
            "mean": rounded(np.nanmean(old)),
            "seed_noise_start": rounded(noise[0]),
            "seed_noise_now": rounded(noise[1]),
            "shift": rounded(shift),
            "shift_standard_error": rounded(shift_error),
            "shift_relative": rounded(shift / np.nanmean(old)),
            "z": [rounded(z, 3) for z in change / error],
            "p_value_any_set": rounded(permutation_p(old[use], new[use], lambda d: (d**2).sum())),
            "p_value_shift": rounded(permutation_p(old[use], new[use], lambda d: abs(d.sum()))),
        }
    return out


def shipped() -> dict[str, np.ndarray]:
    """The demo's 24 sets of two seeds each, as shipped at the start and now."""
    then = WORK / f"coarse_sand_{START}.csv"
    text = subprocess.run(
        ["git", "show", f"{START}:grid/coarse_sand.csv"], cwd=REPO, capture_output=True, check=True
    ).stdout
    then.write_bytes(text)
    names = ("rolling_friction", "sliding_friction", "young_modulus")
    by_set: dict = {}
    for when, path in (("start", then), ("now", REPO / "grid" / "coarse_sand.csv")):
        for record in Database.read(path).records.values():
            key = tuple(record.request.parameters[n] for n in names)
            by_set.setdefault(key, {"start": [], "now": []})[when].append(record)
    most = max(len(r) for runs in by_set.values() for r in runs.values())
    values = {
        when: np.full((len(by_set), most, len(RESPONSES)), np.nan) for when in ("start", "now")
    }
    for i, key in enumerate(sorted(by_set)):
        for when, records in by_set[key].items():
            for j, record in enumerate(records):
                values[when][i, j] = [record.responses.get(name, np.nan) for name in RESPONSES]
    statuses = [
        [r.status for runs in by_set.values() for r in runs[when]] for when in ("start", "now")
    ]
    return {**values, "statuses": statuses}


def figure(found: dict[str, dict[str, np.ndarray]]) -> None:
    """Every set's mean now against its mean then, with the seeds' standard deviation."""
    fig, axes = plt.subplots(
        len(found), 4, figsize=(13, 3.2 * len(found)), squeeze=False, layout="constrained"
    )
    for row, (case, values) in zip(axes, found.items(), strict=True):
        for axis, i in zip(row, (0, 1, 3, 4), strict=True):
            old, new = values["start"][..., i], values["now"][..., i]
            axis.errorbar(
                np.nanmean(old, 1),
                np.nanmean(new, 1),
                np.nanstd(new, 1, ddof=1),
                np.nanstd(old, 1, ddof=1),
                fmt="o",
                ms=4,
                lw=1,
            )
            ends = [np.nanmin([old, new]), np.nanmax([old, new])]
            axis.plot(ends, ends, color="0.6", lw=1, zorder=0)
            axis.set(title=f"{case}: {RESPONSES[i]}", xlabel="start", ylabel="now")
            axis.title.set_size(9)
    fig.savefig(RESULTS / "same_responses.png", dpi=110)


def main() -> None:
    """Run what is missing and compare."""
    found = {case: responses(case) for case in sys.argv[1:] or HOURGLASSES} | {
        "demo's plan": shipped()
    }
    write("same_responses", {case: compared(values) for case, values in found.items()})
    figure(found)


if __name__ == "__main__":
    main()
