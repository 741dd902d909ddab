"""What the report draws of a run: grains, walls and scanned surface."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calibrator.report.figures import grains
from calibrator.runs.setup import Setup
from calibrator.runs.setups import SETUP_ENTRIES


def scenes(
    setup: str, p: Mapping[str, float], arrays: Mapping[str, np.ndarray]
) -> list[grains.Scene]:
    """A run when it was filled, and after the release.

    p : parameters of the run that are numbers; arrays : what it left, the centres "filled"
    and "final" of its grains (n, 3) [m] among them.
    """
    entry = SETUP_ENTRIES[setup]
    top = float(arrays["filled"][:, 2].max() + 2 * p["particle_radius"])
    full, released = entry.outline(p, top)
    return [
        grains.Scene("filled", arrays["filled"], full),
        grains.Scene(entry.last, arrays["final"], released, _surface(entry, arrays)),
    ]


def _surface(entry: Setup, arrays: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Scanned profile (k, 2) of x and z [m]; None where the run left none."""
    profile = entry.profile
    if profile is None or profile.across not in arrays:
        return None
    across, height = arrays[profile.across], arrays[profile.up]
    if entry.mirrored:
        across = np.concatenate([-across[::-1], across])
        height = np.concatenate([height[::-1], height])
    return np.column_stack([across, height])
