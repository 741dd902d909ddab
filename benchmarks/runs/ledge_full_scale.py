"""The reference paper's Table 8 on YADE: its individuals A-D in the full-scale ledge.

    python -m benchmarks.runs.ledge_full_scale          about 60 core-minutes, resumable
    python -m benchmarks.runs.ledge_full_scale D C      only these individuals

There are three seeds of each. Writes grid/ledge_full_scale.csv (the runs) and
benchmarks/results/ledge_full_scale.json (angles beside the paper's).
"""

import json
import sys
from pathlib import Path

import numpy as np

from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

REPO = Path(__file__).resolve().parents[2]
# Table 6 of the paper (rolling friction, sliding friction, radius, density, Young's modulus) and
# its ledge angle of Table 8
INDIVIDUALS = {
    "A": ((0.429, 0.351, 0.4e-3, 2712.16, 4.96e7), 35.65),
    "B": ((0.395, 0.377, 0.4e-3, 2741.0, 3.47e7), 35.59),
    "C": ((0.361, 0.403, 0.4e-3, 2770.0, 1.98e7), 34.96),
    "D": ((0.327, 0.429, 0.4e-3, 2800.0, 5e6), 35.79),
}
NAMES = (
    "rolling_friction",
    "sliding_friction",
    "particle_radius",
    "particle_density",
    "young_modulus",
)
BOX = dict(
    box_length=16e-3,
    box_width=3.2e-3,
    fill_height=16e-3,
    sampling_interval=1e-3,
    rayleigh_fraction=0.2,
    filling_kinetic_energy=1e-12,
)
MEASURED = 35.1
SEEDS = (810_001, 810_002, 810_003)


def requests(label: str) -> list[Request]:
    """The replicates of one individual, with the numerics of their time.

    That is 20 % of the Rayleigh time.
    """
    values = dict(zip(NAMES, INDIVIDUALS[label][0], strict=True))
    return [Request.of("ledge", **values, **BOX, seed=seed) for seed in SEEDS]


def main() -> None:
    """Run what is missing, then compare."""
    asked = {label: requests(label) for label in sys.argv[1:] or INDIVIDUALS}
    records = run(
        RunFolder(REPO / "results" / "ledge_full_scale"),
        [r for own in asked.values() for r in own],
        report=ProgressBar(sys.stderr),
    )
    Database(records).write(
        REPO / "grid" / "ledge_full_scale.csv", "python -m benchmarks.runs.ledge_full_scale"
    )
    by_id = {r.run_id: r for r in records if r.status == "ok"}
    found = {"measured": MEASURED}
    for label, own in asked.items():
        good = [by_id[r.run_id].responses for r in own if r.run_id in by_id]
        found[label] = {
            "paper": INDIVIDUALS[label][1],
            "fitted": [r["ledge_angle_of_repose_deg"] for r in good],
            "fitted_mean": float(np.mean([r["ledge_angle_of_repose_deg"] for r in good])),
            "equivalent_mean": float(np.mean([r["ledge_equivalent_angle_deg"] for r in good])),
            "residual_fraction_mean": float(np.mean([r["residual_fraction"] for r in good])),
        }
    out = REPO / "benchmarks" / "results" / "ledge_full_scale.json"
    out.parent.mkdir(exist_ok=True)
    out.write_text(json.dumps(found, indent=1) + "\n")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
