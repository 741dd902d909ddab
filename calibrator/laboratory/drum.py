"""The free surface in a rotating drum: slopes along it.

No set-up of the contract is a drum yet, so nothing of this goes into the lab file.
"""

from __future__ import annotations

import numpy as np

from calibrator.errors import CalibratorError
from calibrator.laboratory.outcome import Value
from calibrator.laboratory.profile import Surface
from calibrator.laboratory.scripts import scripts_measure

PARTS = {
    "surface_angle_deg": (-0.5, 0.5),
    "central_angle_deg": (-0.2, 0.2),
    "upper_angle_deg": (-0.7, -0.3),
    "lower_angle_deg": (0.3, 0.7),
}
"""Slopes between two shares of the radius, the surface falling to the right."""


def drum_values(x: np.ndarray, z: np.ndarray, radius: float) -> Surface:
    """Slopes of a drum's surface [deg], its curvature, and the profile.

    x, z : (n,) from the drum's axis, to the right and up, in the unit of the radius. The surface
    may fall to either side. Raises CalibratorError where it does not cross the drum.
    """
    inner = np.abs(x) < 0.7 * radius
    if inner.sum() < 40 or x.min() > -0.5 * radius or x.max() < 0.5 * radius:
        raise CalibratorError(
            "the surface does not cross the drum; give its circle as --circle column,row,radius"
        )
    if np.polyfit(x[inner], z[inner], 1)[0] > 0:
        x, z = -x[::-1], z[::-1]
    measure = scripts_measure()
    values = {}
    for name, (low, high) in PARTS.items():
        part = (x > low * radius) & (x < high * radius)
        fit = measure.fit_slope(x[part], z[part])
        if fit is None:
            raise CalibratorError("too few pixels lie on the surface; take a larger picture")
        values[name] = Value(fit["angle"], fit["error"], "deg", False)
    inner = np.abs(x) < 0.7 * radius
    cubic = np.polyfit(x[inner] / radius, z[inner] / radius, 3)
    words = " ".join(f"{c:+.3f}" for c in cubic)
    notes = (
        "surface_angle within half the radius of the axis, central_angle within a fifth, upper and"
        " lower_angle from 0.3 to 0.7 radii",
        f"z/R = a (x/R)^3 + b (x/R)^2 + c x/R + d within 0.7 R: {words}",
    )
    return Surface(values, x, z, notes)
