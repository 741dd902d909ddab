"""Makes the users' raw data: logs of a scale, photographs of heaps, and a picture of a drum.

    python -m benchmarks.first_hour.data    an hour and a half of a slow core; resumes

Three runs of an hourglass and three of a heap at the frictions of TRUTH. The runs' mass-time curves
become the log of a scale that reads in grams fifty times a second, with noise and decimal commas;
the grains at rest are photographed from six degrees above. A run of a drum with those of PELLETS
leaves the picture that a camera with a long exposure takes of it.
"""

import sys
from pathlib import Path

import numpy as np
from skimage import io

from calibrator.files import read_arrays, write_text
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar
from tests.laboratory.rendered import spheres

DATA = Path(__file__).with_name("data")
FOLDER = RunFolder(Path(__file__).resolve().parents[2] / "results" / "first_hour_data")
TRUTH = {"rolling_friction": 0.4, "sliding_friction": 0.6, "restitution": 0.7}
GRAINS = {
    "particle_radius": 2.5e-3,
    "particle_density": 4200.0,
    "young_modulus": 5e6,
    "size_spread": 0.115,
}
VESSELS = {
    "hourglass": {"cylinder_diameter": 0.1, "neck_diameter": 0.045, "fill_mass": 2.0},
    "conical_pile": {
        "cylinder_diameter": 0.09,
        "fill_height": 0.09,
        "lift_speed": 0.02,
        "lift_height": 0.06,
    },
}
PELLETS = {
    "rolling_friction": 0.12,
    "sliding_friction": 0.45,
    "restitution": 0.8,
    "particle_radius": 0.75e-3,
    "particle_density": 1500.0,
    "young_modulus": 2e6,
    "size_spread": 0.1,
    "drum_diameter": 0.045,
    "drum_depth": 0.012,
    "rotation_rpm": 30.0,
    "longest_time": 30.0,
}
FIRST_SEED, REPEATS = 880_001, 3
RATE, BEFORE, NOISE = 50.0, 2.0, 0.3  # readings a second, seconds at rest, grams
PIXEL, TILT = 5e-4, 6.0


def log_of(record: Record, seed: int) -> str:
    """A scale's log of a run: seconds and grams, with decimal commas."""
    arrays = read_arrays(FOLDER.curves(record.run_id))
    time, mass = arrays["time"], 1e3 * arrays["passed_mass"]
    clock = np.arange(0, BEFORE + time[-1] + 2.0, 1 / RATE)
    random = np.random.default_rng(seed)
    grams = np.interp(clock - BEFORE, time, mass) + random.normal(0, NOISE, len(clock))
    rows = [f"{t:.2f};{m:.1f}".replace(".", ",") for t, m in zip(clock, grams, strict=True)]
    return "\n".join(["Zeit [s];Masse [g]", *rows]) + "\n"


def photograph(record: Record, path: Path) -> None:
    """A picture of a run's grains at rest."""
    centres = read_arrays(FOLDER.curves(record.run_id))["final"][:, :3]
    picture, _ = spheres(
        centres, GRAINS["particle_radius"], TILT, PIXEL, (420, 700), noise=0.01, light=0.8
    )
    io.imsave(path, np.rint(255 * picture).astype("u1"), check_contrast=False)


def drum_picture(record: Record, path: Path) -> None:
    """The drum's circle, with its sand dark, four pixels for one of the run's."""
    seen = read_arrays(FOLDER.curves(record.run_id))["seen"]
    picture = np.kron(0.9 - 0.75 * seen.T[::-1], np.ones((4, 4)))
    picture += np.random.default_rng(1).normal(0, 0.01, picture.shape)
    io.imsave(path, np.rint(255 * picture.clip(0, 1)).astype("u1"), check_contrast=False)


def main() -> None:
    """Make the runs that are missing, and the files."""
    DATA.mkdir(exist_ok=True)
    requests = [
        Request.of(setup, **TRUTH, **GRAINS, **vessel, seed=FIRST_SEED + i)
        for setup, vessel in VESSELS.items()
        for i in range(REPEATS)
    ]
    requests.append(Request.of("rotating_drum", **PELLETS, seed=FIRST_SEED))
    records = run(FOLDER, requests, report=ProgressBar(sys.stderr, "raw data"))
    for i, record in enumerate(records):
        number = i % REPEATS + 1
        if record.status != "ok":
            sys.exit(f"{record.run_id} ended {record.status}: {record.error}")
        if record.request.setup == "rotating_drum":
            drum_picture(record, DATA / "drum.png")
        elif record.request.setup == "hourglass":
            write_text(DATA / f"scale_{number}.csv", log_of(record, number))
        else:
            photograph(record, DATA / f"heap_{number}.png")


if __name__ == "__main__":
    main()
