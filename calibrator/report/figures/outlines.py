"""What the report draws of a run: grains, walls and scanned surface, from the arrays that the run
left.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calibrator.report.figures import grains
from calibrator.runs.setups import hourglass_outline, ledge_outline, pile_outline


def scenes(
    setup: str, p: Mapping[str, float], arrays: Mapping[str, np.ndarray]
) -> list[grains.Scene]:
    top = float(arrays["filled"][:, 2].max() + 2 * p["particle_radius"])
    outlines = {
        "hourglass": hourglass_outline,
        "ledge": ledge_outline,
        "conical_pile": pile_outline,
    }[setup](p, top)
    moments = zip(
        ("filled", "final"), ("filled", "at rest"), outlines, (None, _surface(arrays)), strict=True
    )
    return [
        grains.Scene(title, arrays[name], outline, surface)
        for name, title, outline, surface in moments
    ]


def _surface(arrays: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Scanned profile (k, 2) of x and z [m], mirrored where it was scanned over the radius."""
    if "profile_x" in arrays:
        return np.column_stack([arrays["profile_x"], arrays["profile_height"]])
    if "profile_radius" not in arrays:
        return None
    radius, height = arrays["profile_radius"], arrays["profile_height"]
    return np.column_stack(
        [np.concatenate([-radius[::-1], radius]), np.concatenate([height[::-1], height])]
    )
