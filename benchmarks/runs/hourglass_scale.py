"""What a smaller hourglass changes: a cylinder of 32 mm, as in the paper, against the reduced.

    python -m benchmarks.runs.hourglass_scale full       cylinder of 32 mm, one run a set
    python -m benchmarks.runs.hourglass_scale reduced    the reduced case's, five seeds a set
    python -m benchmarks.runs.hourglass_scale narrow     the same with the paper's neck of 5 mm
    python -m benchmarks.runs.hourglass_scale stiff      with the modulus of the paper's front
    python -m benchmarks.runs.hourglass_scale            compare what has been run

The first takes about an hour of a core for each set and can be resumed, the others minutes; the
narrow one shows how often it clogs. Writes grid/hourglass_scale.csv and
benchmarks/results/hourglass_scale.json. A name of a set after the scale runs that set alone. The
grains have size and density of the paper's individual D everywhere, the neck is the reduced case's
for all but "narrow". The wide cylinder is filled with less than the paper's 25 g, as much as its
slope needs to reach the wall: rate and slope do not know how much has gone before them. The highest
frictions clog even the reduced neck in most runs and are not part of the comparison with the wide
cylinder.
"""

import sys
from pathlib import Path

import numpy as np

from benchmarks.common import write
from calibrator.case.toml import read_case
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

REPO = Path(__file__).resolve().parents[2]
FOLDER = RunFolder(REPO / "results" / "hourglass_scale")
SHIPPED = REPO / "grid" / "hourglass_scale.csv"
# rolling and sliding friction, and the mass [kg] for the wide cylinder
SETS = {
    "low": (0.1, 0.2, 10e-3),
    "medium": (0.2, 0.3, 12e-3),
    "high": (0.327, 0.429, 14.5e-3),
    "highest": (0.5, 0.7, 20e-3),
}
# "high" has the frictions of the paper's individual D; "highest" clogs in most runs
COMPARED = ("low", "medium", "high")
# Soft, so that a wide cylinder costs an hour and not three; "stiff" shows what that changes.
GRAINS = dict(particle_radius=0.4e-3, particle_density=2800.0, young_modulus=1e6)
STIFF = 5e6
SCALES = ("full", "reduced", "narrow", "stiff")
RESPONSES = (
    "bulk_density",
    "drained_equivalent_angle_deg",
    "drained_angle_of_repose_deg",
    "mass_flow_rate",
)
FIRST_SEED = 820_001
SEEDS = 5


def requests(label: str, scale: str) -> list[Request]:
    """The runs of one set of frictions at one of the scales."""
    rolling, sliding, mass = SETS[label]
    grains = dict(**GRAINS, rolling_friction=rolling, sliding_friction=sliding)
    small = read_case(REPO / "cases" / "quartz_sand_reduced.toml").problem.setups["hourglass"]
    if scale == "full":
        wide = dict(
            fill_mass=mass,
            cylinder_diameter=32e-3,
            neck_diameter=small["neck_diameter"],
            longest_time=20.0,
        )
        return [Request.of("hourglass", **grains, **wide, seed=FIRST_SEED)]
    shape = {**small, "neck_diameter": 5e-3} if scale == "narrow" else small
    if scale == "stiff":
        grains["young_modulus"] = STIFF
    return [
        Request.of("hourglass", **{**grains, **shape, "seed": FIRST_SEED + i}) for i in range(SEEDS)
    ]


def finished(label: str, scale: str) -> list[Record]:
    """Runs made here or shipped."""
    asked = requests(label, scale)
    there = Database.read(SHIPPED).find(asked) if SHIPPED.exists() else []
    return list({r.run_id: r for r in [*there, *gather(FOLDER, asked)]}.values())


def summary(records: list[Record]) -> dict[str, object]:
    """How many runs, how many clogged, and mean and scatter of each response."""
    found: dict[str, object] = {
        "runs": len(records),
        "clogged": sum(r.status == "clogged" for r in records),
    }
    for name in RESPONSES:
        values = np.array([r.responses[name] for r in records if name in r.responses])
        if len(values):
            found[name] = {
                "mean": float(values.mean()),
                "scatter": float(values.std(ddof=1)) if len(values) > 1 else None,
            }
    return found


def main() -> None:
    """Run one scale, or compare all."""
    scale, *labels = sys.argv[1:] or [""]
    labels = labels or list(COMPARED if scale == "full" else SETS)
    if scale:
        run(
            FOLDER,
            [r for label in labels for r in requests(label, scale)],
            jobs=1,
            report=ProgressBar(sys.stderr),
        )
    records = {label: {s: finished(label, s) for s in SCALES} for label in SETS}
    everything = [r for own in records.values() for runs in own.values() for r in runs]
    Database(everything).write(
        SHIPPED, "\n".join(f"python -m benchmarks.runs.hourglass_scale {s}" for s in SCALES)
    )
    write(
        "hourglass_scale",
        {
            "sets": {
                label: {s: summary(r) for s, r in own.items() if r}
                for label, own in records.items()
            }
        },
    )


if __name__ == "__main__":
    main()
