"""The free surface in a rotating drum, measured as the scripts measure what a camera sees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calibrator.errors import CalibratorError
from calibrator.laboratory.outcome import Value
from calibrator.laboratory.profile import Surface
from calibrator.laboratory.scripts import scripts_measure

Outline = tuple[np.ndarray, np.ndarray]
"""Positions (n,), to the right and up, from the drum's axis."""


def drum_values(outline: Outline, radius: float, blurred: Sequence[Outline] = ()) -> Surface:
    """Slopes of a drum's surface, its cubic, heights and filled share, and the profile.

    outline : in the unit of the radius; the surface may fall to either side. blurred : where an
    average over time shows sand 16 and 84 % of the time; none for a picture of one moment. Raises
    CalibratorError where the surface does not cross the drum.
    """
    measure = scripts_measure()
    x, z = measure.falling_right(*outline) if len(outline[0]) > 1 else outline
    if len(x) < 40:
        raise CalibratorError("too few pixels lie on the surface; take a larger picture")
    found, errors = measure.drum_responses(x, z, radius)
    if not found:
        raise CalibratorError(
            "the surface does not cross the drum; give its circle as --circle column,row,radius"
        )
    values = {
        name: Value(float(value), errors.get(name), "deg" if name.endswith("_deg") else "1")
        for name, value in found.items()
    }
    if blurred:
        sides = [measure.falling_right(*side) for side in blurred]
        if (blur := measure.drum_blur(*sides, radius, found["drum_angle_deg"])) is not None:
            values["drum_blur"] = Value(float(blur), None, "m")
    notes = (
        "slopes within half the radius of the axis, within a fifth, and from 0.3 to 0.7 radii on"
        " either side; z/R = a_3 (x/R)^3 + a_2 (x/R)^2 + a_1 x/R + a_0 within 0.7 R",
    )
    return Surface(values, x, z, notes)
