"""Did leaving out the few grains that started inside the round wall shift any response?

    python -m benchmarks.runs.cloud      about 10 core-minutes, resumable

Writes benchmarks/results/cloud.json. 22 seeds of the demo's hourglass at one set of its front, by
the scripts that made the shipped databases and by today's. The clouds differ in where they stand by
a thousandth of the cylinder, so seeds do not pair. "shift" is the difference of the means with its
standard error.
"""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from benchmarks.common import rounded, write
from benchmarks.runs.dem import HOURGLASSES, run_hourglass, scripts_at

SHIPPED = "eb0f1aa"  # the last commit with the scripts behind the shipped databases
SET = {
    **HOURGLASSES["coarse_sand"],
    "rolling_friction": 0.275,
    "sliding_friction": 0.418,
    "young_modulus": 1e6,
}
SEEDS = range(91_001, 91_023)
RESPONSES = ("bulk_density", "drained_equivalent_angle_deg", "mass_flow_rate")


def values(commit: str) -> np.ndarray:
    """Responses (seeds, 3) of the scripts of a commit; NaN where a run has none."""
    scripts_at(commit)
    with ThreadPoolExecutor(int(os.environ.get("WORKERS", 2))) as pool:
        records = list(pool.map(lambda seed: run_hourglass(commit, {**SET, "seed": seed}), SEEDS))
    return np.array([[r["responses"].get(name, np.nan) for name in RESPONSES] for r in records])


def main() -> None:
    """Run what is missing and compare."""
    old, new = values(SHIPPED), values("")
    out: dict = {
        "seeds": len(SEEDS),
        "missing": int(np.isnan(np.concatenate([old, new])).any(1).sum()),
    }
    for name, a, b in zip(RESPONSES, old.T, new.T, strict=True):
        mean, (va, vb) = (
            np.nanmean(a),
            (np.nanvar(v, ddof=1) / np.isfinite(v).sum() for v in (a, b)),
        )
        out[name] = {
            "then": rounded(mean),
            "now": rounded(np.nanmean(b)),
            "shift_percent": rounded(100 * (np.nanmean(b) / mean - 1), 2),
            "standard_error_percent": rounded(100 * np.sqrt(va + vb) / mean, 2),
        }
    write("cloud", out)


if __name__ == "__main__":
    main()
