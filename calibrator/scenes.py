"""What the report draws of a run: grains, walls and scanned surface, from the arrays that the run left."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calibrator import plot


def scenes(setup: str, p: Mapping[str, float], arrays: Mapping[str, np.ndarray]) -> list[plot.Scene]:
    top = float(arrays["filled"][:, 2].max() + 2 * p["particle_radius"])
    outlines = {"hourglass": _hourglass, "ledge": _ledge, "conical_pile": _pile}[setup](p, top)
    moments = zip(("filled", "final"), ("filled", "at rest"), outlines, (None, _surface(arrays)), strict=True)
    return [plot.Scene(title, arrays[name], outline, surface) for name, title, outline, surface in moments]


def _surface(arrays: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Scanned profile (k, 2) of x and z [m], mirrored where it was scanned over the radius."""
    if "profile_x" in arrays:
        return np.column_stack([arrays["profile_x"], arrays["profile_height"]])
    if "profile_radius" not in arrays:
        return None
    radius, height = arrays["profile_radius"], arrays["profile_height"]
    return np.column_stack([np.concatenate([-radius[::-1], radius]), np.concatenate([height[::-1], height])])


Outline = tuple[np.ndarray, ...]


def _hourglass(p: Mapping[str, float], top: float) -> tuple[Outline, Outline]:
    """Walls with the plug in place, and without it."""
    wall, neck = p["cylinder_diameter"] / 2, p["neck_diameter"] / 2
    left, right = np.array([[-wall, top], [-wall, 0], [-neck, 0]]), np.array([[wall, top], [wall, 0], [neck, 0]])
    return (left, right, np.array([[-neck, 0], [neck, 0]])), (left, right)


def _ledge(p: Mapping[str, float], top: float) -> tuple[Outline, Outline]:
    """Box with its flap, and without it."""
    length = p["box_length"]
    box = np.array([[0, top], [0, 0], [length, 0]])
    return (box, np.array([[length, 0], [length, top]])), (box,)


def _pile(p: Mapping[str, float], top: float) -> tuple[Outline, Outline]:
    """Cylinder on the plane, then nothing."""
    wall = p["cylinder_diameter"] / 2
    return (np.array([[-wall, top], [-wall, 0], [wall, 0], [wall, top]]),), ()
