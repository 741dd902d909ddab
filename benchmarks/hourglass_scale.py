"""What a smaller hourglass changes: the reference paper's cylinder of 32 mm against the reduced one, three sets of frictions.

    python -m benchmarks.hourglass_scale full       cylinder of 32 mm, one run a set: hours of a core, resumable
    python -m benchmarks.hourglass_scale reduced    the reduced case's cylinder, five seeds a set: minutes
    python -m benchmarks.hourglass_scale            compare what has been run: grid/ and benchmarks/results/hourglass_scale.json

The neck, the grains (the paper's individual D) and the modulus are the same. The wide cylinder is filled with less than the
paper's 25 g, as much as its slope needs to reach the wall: rate and slope do not know how much has gone before them.
"""

import sys
from pathlib import Path

import numpy as np

from benchmarks.common import write
from calibrator.case import read_case
from calibrator.cli import ProgressBar
from calibrator.database import Database
from calibrator.records import Record
from calibrator.runner import RunFolder, gather, run
from calibrator.table import Request

REPO = Path(__file__).resolve().parent.parent
FOLDER = RunFolder(REPO / "results" / "hourglass_scale")
SHIPPED = REPO / "grid" / "hourglass_scale.csv"
# rolling and sliding friction, and the mass [kg] for the wide cylinder
SETS = {"low": (0.1, 0.2, 12e-3), "middle": (0.327, 0.429, 18e-3), "high": (0.5, 0.7, 22e-3)}
GRAINS = dict(particle_radius=0.4e-3, particle_density=2800.0, young_modulus=5e6, neck_diameter=5e-3, longest_time=20.0)
RESPONSES = ("bulk_density", "drained_equivalent_angle_deg", "drained_angle_of_repose_deg", "mass_flow_rate")
FIRST_SEED = 820_001


def requests(label: str, scale: str) -> list[Request]:
    """The runs of one set of frictions at one scale, "full" or "reduced"."""
    rolling, sliding, mass = SETS[label]
    frictions = dict(rolling_friction=rolling, sliding_friction=sliding)
    if scale == "full":
        return [Request.of("hourglass", **GRAINS, **frictions, fill_mass=mass, cylinder_diameter=32e-3, seed=FIRST_SEED)]
    small = read_case(REPO / "cases" / "quartz_sand_reduced.toml").problem.setups["hourglass"]
    return [Request.of("hourglass", **{**GRAINS, **small, **frictions, "seed": FIRST_SEED + i}) for i in range(5)]


def finished() -> list[Record]:
    """Runs made here or shipped."""
    asked = [r for label in SETS for scale in ("full", "reduced") for r in requests(label, scale)]
    there = Database.read(SHIPPED).find(asked) if SHIPPED.exists() else []
    return list({r.run_id: r for r in [*there, *gather(FOLDER, asked)]}.values())


def compare(records: list[Record]) -> dict[str, dict[str, dict[str, float]]]:
    """{set: {response: full, reduced, its scatter and their difference}} of the sets that have run at both scales."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for label in SETS:
        values = {scale: _responses(records, requests(label, scale)) for scale in ("full", "reduced")}
        if not all(len(v) for v in values.values()):
            continue
        found[label] = {}
        for i, name in enumerate(RESPONSES):
            full, reduced = (np.array([row[i] for row in values[s]]) for s in ("full", "reduced"))
            found[label][name] = {
                "full": float(full.mean()),
                "reduced": float(reduced.mean()),
                "scatter": float(reduced.std(ddof=1)),
                "difference": float(reduced.mean() - full.mean()),
                "ratio": float(reduced.mean() / full.mean()),
            }
    return found


def _responses(records: list[Record], asked: list[Request]) -> list[list[float]]:
    ids = {r.run_id for r in asked}
    return [[r.responses.get(n, np.nan) for n in RESPONSES] for r in records if r.run_id in ids and r.status == "ok"]


def main() -> None:
    """Run one scale, or compare both."""
    if sys.argv[1:]:
        run(FOLDER, [r for label in SETS for r in requests(label, sys.argv[1])], jobs=1, report=ProgressBar(sys.stderr))
    records = finished()
    Database(records).write(SHIPPED, "python -m benchmarks.hourglass_scale full; python -m benchmarks.hourglass_scale reduced")
    write("hourglass_scale", {"sets": compare(records)})


if __name__ == "__main__":
    main()
