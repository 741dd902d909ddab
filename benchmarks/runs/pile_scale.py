"""What a smaller heap changes: the reference paper's individual D in piles of growing size.

    python -m benchmarks.runs.pile_scale     half a core-hour where no run is shipped

Compares the runs of grid/pile_scale.csv and makes those that it lacks; writes it and
benchmarks/results/pile_scale.json. The cylinder is filled as high as it is wide, as in the reduced
case, whose pile is the middle size. The paper's own is 32 mm wide and filled to 20 mm.
"""

from pathlib import Path

import numpy as np

from benchmarks.common import shipped_or_run, write
from calibrator.case.toml import read_case
from calibrator.runs.folder import RunFolder
from calibrator.runs.request import Request

REPO = Path(__file__).resolve().parents[2]
FOLDER = RunFolder(REPO / "results" / "pile_scale")
SHIPPED = REPO / "grid" / "pile_scale.csv"
GRAINS = dict(
    rolling_friction=0.327,
    sliding_friction=0.429,
    particle_radius=0.4e-3,
    particle_density=2800.0,
    young_modulus=5e6,
)
SEEDS = {8e-3: 3, 12e-3: 3, 16e-3: 2}  # by diameter of the cylinder [m]
FIRST_SEED = 840_001
RESPONSES = ("pile_angle_of_repose_deg", "pile_equivalent_angle_deg", "bulk_density")


def requests(diameter: float) -> list[Request]:
    """The runs of one size."""
    shape = read_case(REPO / "cases" / "quartz_sand_reduced.toml").problem.setups["conical_pile"]
    size = {**shape, "cylinder_diameter": diameter, "fill_height": diameter}
    return [
        Request.of("conical_pile", **{**GRAINS, **size, "seed": FIRST_SEED + i})
        for i in range(SEEDS[diameter])
    ]


def main() -> None:
    """Run what is missing, then compare."""
    asked = {diameter: requests(diameter) for diameter in SEEDS}
    wanted = [r for own in asked.values() for r in own]
    records = shipped_or_run(SHIPPED, FOLDER, wanted, "python -m benchmarks.runs.pile_scale")
    good, found = {r.run_id: r for r in records if r.status == "ok"}, {}
    for diameter, own in asked.items():
        there = [good[r.run_id] for r in own if r.run_id in good]
        sizes = {name: np.array([r.responses[name] for r in there]) for name in RESPONSES}
        found[f"{diameter * 1e3:g} mm"] = {
            "runs": len(there),
            "grains": int(np.mean([r.diagnostics["particles"] for r in there])),
            **{
                n: {
                    "mean": float(v.mean()),
                    "standard_error": float(v.std(ddof=1) / np.sqrt(len(v))),
                }
                for n, v in sizes.items()
            },
        }
    write(
        "pile_scale",
        {"paper": {"diameter": 32e-3, "pile_angle_of_repose_deg": 33.17}, "sizes": found},
    )


if __name__ == "__main__":
    main()
