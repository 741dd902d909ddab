"""How much angles scatter between runs, in the errors that their fits state.

    python -m benchmarks.numerics.angle_errors    a second; no run is made

`*_angle_error_deg` is the standard error of the line through one profile. It takes the rings of the
profile for independent, though a grain lies in several, and it knows nothing of what differs from
run to run. Shipped runs that differ in their seed only say how much angles scatter; written is the
ratio of the two, root mean squares over all such sets, to benchmarks/results/angle_errors.json.
"""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np

from benchmarks.common import rounded, write
from calibrator.case.vocabulary import RESPONSES
from calibrator.runs.database import Database
from calibrator.runs.record import Record

GRID = Path(__file__).resolve().parents[2] / "grid"
TABLES = (
    "missing_effect",
    "missing_effect_pools",
    "quartz_sand_reduced",
    "coarse_sand",
    "versions",
)
ANGLES = {
    n: n.replace("_of_repose", "_error") for n in RESPONSES if n.endswith("_angle_of_repose_deg")
}


def of_sets(records: list[Record], angle: str, error: str) -> list[tuple[float, float]]:
    """Variance of an angle over seeds and mean square of its stated error, of each set."""
    sets = defaultdict(list)
    for one in records:
        if one.status == "ok" and angle in one.responses and error in one.responses:
            key = {n: v for n, v in one.request.parameters.items() if n != "seed"}
            sets[one.request.setup, tuple(sorted(key.items()))].append(
                (one.responses[angle], one.responses[error])
            )
    runs = [np.array(own) for own in sets.values() if len(own) > 1]
    return [(float(r[:, 0].var(ddof=1)), float(np.mean(r[:, 1] ** 2))) for r in runs]


def main() -> None:
    """Compare scatter and stated error in every table."""
    found = {}
    for table in TABLES:
        records = list(Database.read(GRID / f"{table}.csv").records.values())
        for angle, error in ANGLES.items():
            if own := of_sets(records, angle, error):
                scatter, stated = np.sqrt(np.mean(own, axis=0))
                found[f"{table}: {angle}"] = {
                    "sets": len(own),
                    "scatter_deg": rounded(float(scatter)),
                    "stated_error_deg": rounded(float(stated)),
                    "ratio": rounded(float(scatter / stated)),
                }
    write("angle_errors", found)


if __name__ == "__main__":
    main()
