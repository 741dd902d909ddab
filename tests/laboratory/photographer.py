"""Photographs of the piles of real runs, and what is read off them.

    python -m tests.laboratory.photographer    a minute or two; no run is made

Every pile from three sides at several tilts of the camera, in good light and in poor: what the mean
of the three views is off by from the angle of the run's record, and how far single views are. It
writes benchmarks/results/photographs.json.
"""

import tempfile
from pathlib import Path

import numpy as np
from skimage import io

from benchmarks.common import rounded, write
from calibrator.errors import CalibratorError
from calibrator.laboratory.camera import Camera
from calibrator.laboratory.photo import Shot, measure_photo
from calibrator.laboratory.profile import Ground
from tests.laboratory.piles import RADIUS, RECORDED, pile
from tests.laboratory.rendered import spheres

PIXEL = 1.5e-4
KNOWN = "200 = 30 mm"
POOR = dict(sand=0.45, ground=0.25, light=0.35, noise=0.03)
GRAINS = Ground(grain_radius=RADIUS)


def photograph(path, picture):
    io.imsave(path, np.rint(255 * picture).astype("u1"), check_contrast=False)
    return path


def read(path, shape="heap", camera=None, **how):
    return measure_photo(path, Shot(shape, camera or Camera(), **how))[0]


def angles(folder, name, tilt, roll=0.0, **light):
    """Angle and error of a pile photographed from three sides."""
    found = []
    for turned in (0, 60, 120):
        picture, _ = spheres(
            pile(name), RADIUS, tilt, PIXEL, (400, 640), turned_deg=turned, roll_deg=roll, **light
        )
        path = photograph(folder / f"{turned}.png", picture)
        reading = read(path, camera=Camera(tilt=tilt, roll=roll), known=KNOWN, ground=GRAINS)
        found.append(reading.values["pile_angle_of_repose_deg"])
    return np.array([one.value for one in found]), np.array([one.error for one in found])


TILTS = {"steepest": (0, 4, 8, 12, 16, 20), "steep": (0, 5, 10), "middle": (0, 5)}


def main():
    """Photograph and read every pile."""
    rows = []
    for name, tilts in TILTS.items():
        true = RECORDED[name]["pile_angle_of_repose_deg"]
        for tilt in tilts:
            for light, how in (("good", {}), ("poor", POOR)):
                row = {"pile": name, "angle_deg": true, "tilt_deg": tilt, "light": light}
                try:
                    with tempfile.TemporaryDirectory() as folder:
                        found, errors = angles(Path(folder), name, tilt, **how)
                except CalibratorError as refusal:
                    rows.append({**row, "refused": str(refusal)})
                    continue
                off = found - true
                rows.append(
                    {
                        **row,
                        "mean_off_deg": rounded(float(off.mean()), 2),
                        "view_off_most_deg": rounded(float(np.abs(off).max()), 2),
                        "stated_error_deg": rounded(float(errors.mean()), 2),
                    }
                )
    write("photographs", {"rows": rows})


if __name__ == "__main__":
    main()
