"""A parallel projection from a little above, and what it makes of vessels.

Page coordinates are x to the right, y upwards and depth away from the eye, all in metres: a sphere
is a disc of its own radius wherever it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

CREASE = math.cos(math.radians(35))
"""Cosine of the angle between two facets beyond which their edge is drawn as a corner."""

DISC = 96
"""Corners of the disc that stands for a plane without end."""


@dataclass(frozen=True, eq=False)
class Camera:
    """The eye: where it looks from, and how the set-up leans.

    azimuth_deg : turn about the vertical, 0 looks along +y; elevation_deg : how far from above;
    tilt_deg : of the set-up about the y axis, so that on the page gravity points down.
    """

    azimuth_deg: float
    elevation_deg: float
    tilt_deg: float = 0.0

    @property
    def axes(self) -> np.ndarray:
        """Rows (3, 3): right, up and away on the page, in the coordinates of the run."""
        a, e, t = map(math.radians, (self.azimuth_deg, self.elevation_deg, self.tilt_deg))
        level = np.array([-math.sin(a), math.cos(a), 0.0])
        right = np.array([math.cos(a), math.sin(a), 0.0])
        vertical = np.array([0.0, 0.0, 1.0])
        up = math.sin(e) * level + math.cos(e) * vertical
        away = math.cos(e) * level - math.sin(e) * vertical
        leaning = np.array(
            [[math.cos(t), 0, math.sin(t)], [0, 1, 0], [-math.sin(t), 0, math.cos(t)]]
        )
        page: np.ndarray = np.array([right, up, away]) @ leaning
        return page

    def seen(self, points: np.ndarray) -> np.ndarray:
        """Page coordinates (..., 3) [m] of points (..., 3) [m]."""
        return np.asarray(points @ self.axes.T)

    def behind(self, points: np.ndarray) -> np.ndarray:
        """How far points (..., 3) lie behind the vertical plane of the page through the axis."""
        a = math.radians(self.azimuth_deg)
        return np.asarray(points @ np.array([-math.sin(a), math.cos(a), 0.0]))


def outlines(facets: np.ndarray, camera: Camera) -> np.ndarray:
    """Edges (k, 2, 3) [m] that draw a vessel of facets (m, 3, 3) [m].

    Those of one facet only, its corners, and those between a facet that faces the eye and one that
    does not. Facets that only divide a wall leave no line.
    """
    away = camera.axes[2]
    normals: dict[tuple[tuple[float, ...], ...], list[np.ndarray]] = {}
    size = float(np.ptp(facets, axis=(0, 1)).max()) if len(facets) else 1.0
    for corners in facets:
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        length = float(np.linalg.norm(normal))
        if length <= 1e-12 * size**2:
            continue  # a facet that was cut down to a line
        for i in range(3):
            ends = sorted(tuple(float(x) for x in _rounded(c, size)) for c in
                          (corners[i], corners[i - 2]))  # fmt: skip
            normals.setdefault(tuple(ends), []).append(normal / length)
    edges = [ends for ends, own in normals.items() if _is_drawn(own, away)]
    return np.array(edges).reshape(-1, 2, 3)


def _rounded(corner: np.ndarray, size: float) -> np.ndarray:
    """A corner as it is compared with others: single precision parts those of two facets."""
    unit = 1e-5 * size
    return np.round(corner / unit) * unit


def _is_drawn(normals: list[np.ndarray], away: np.ndarray) -> bool:
    """Whether an edge between facets of these normals, whose signs mean nothing, is drawn."""
    if len(normals) != 2:
        return True
    one, other = normals
    if one @ other < 0:
        other = -other  # the corners of facets go round either way
    return bool(one @ other < CREASE or (one @ away) * (other @ away) < 0)


def ground(middle: tuple[float, float], height: float, radius: float) -> np.ndarray:
    """Rim (k, 3) [m] of a disc at a height, for a plane without end."""
    turn = np.linspace(0, 2 * np.pi, DISC)
    x, y = (radius * part(turn) + at for part, at in zip((np.cos, np.sin), middle, strict=True))
    return np.column_stack([x, y, np.full(DISC, height)])


CAMERAS: Mapping[str, Camera] = {"ledge": Camera(24, 17)}
"""Where a set-up is looked at from; a round one from anywhere."""
