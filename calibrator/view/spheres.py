"""Spheres painted by hand: shaded discs with the nearest surface in front, no graphics card."""

from __future__ import annotations

import numpy as np

LIGHT = np.array([-0.45, 0.62, 0.64])
"""Direction to the light: from the upper left, in front of the page."""

HAZE = np.array([0.93, 0.94, 0.96])
"""What far grains fade into."""

FINER = 2
"""Points along a pixel's side that are averaged, so that rims are smooth."""

Box = tuple[float, float, float, float]
"""Left, right, bottom and top of what is shown on the page [m]."""


def painted(
    centres: np.ndarray, radii: np.ndarray, colours: np.ndarray, box: Box, pixel: float
) -> np.ndarray:
    """Picture (h, w, 4) of spheres, its first row at the bottom; transparent where there is none.

    Parameters
    ----------
    centres : (n, 3) [m] in page coordinates (see `Camera.seen`); radii : (n,) [m].
    colours : (n, 3), red, green and blue from 0 to 1.
    box : what is shown; pixel : its size [m].
    """
    fine = pixel / FINER
    height, width = (FINER * max(1, round((box[i + 1] - box[i]) / pixel)) for i in (2, 0))
    x, y = box[0] + fine * (np.arange(width) + 0.5), box[2] + fine * (np.arange(height) + 0.5)
    nearest = _nearest(centres, radii, x, y)
    rows, columns = np.nonzero(nearest >= 0)
    own = nearest[rows, columns]
    across = (x[columns] - centres[own, 0]) / radii[own]
    up = (y[rows] - centres[own, 1]) / radii[own]
    far = _fading(centres[:, 2])[own, None]
    picture = np.zeros((height, width, 4))
    picture[rows, columns, :3] = (1 - far) * _lit(across, up, colours[own]) + far * HAZE
    picture[rows, columns, 3] = 1.0
    return _averaged(picture)


def _nearest(centres: np.ndarray, radii: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Which sphere is in front at each point (h, w) of these coordinates [m]; -1 where none is."""
    depth, nearest = np.full((len(y), len(x)), np.inf), np.full((len(y), len(x)), -1)
    for k, ((cx, cy, cz), radius) in enumerate(zip(centres, radii, strict=True)):
        i = slice(*np.searchsorted(y, [cy - radius, cy + radius]))
        j = slice(*np.searchsorted(x, [cx - radius, cx + radius]))
        bulge = radius**2 - (x[None, j] - cx) ** 2 - (y[i, None] - cy) ** 2
        surface = np.where(bulge > 0, cz - np.sqrt(np.maximum(bulge, 0)), np.inf)
        nearer = surface < depth[i, j]
        depth[i, j][nearer] = surface[nearer]
        nearest[i, j][nearer] = k
    return nearest


def _lit(across: np.ndarray, up: np.ndarray, colours: np.ndarray) -> np.ndarray:
    """Colours (n, 3) of spheres at places (n,) of their discs: dull light, and a gleam."""
    bulge = np.sqrt(np.maximum(1 - across**2 - up**2, 0))
    facing = np.maximum(LIGHT[0] * across + LIGHT[1] * up + LIGHT[2] * bulge, 0)[:, None]
    shade = (0.36 + 0.70 * facing) * (0.62 + 0.38 * bulge[:, None])
    return np.asarray(np.clip(shade * colours + 0.16 * facing**24, 0, 1))


def _fading(depth: np.ndarray) -> np.ndarray:
    """How much (n,) of each sphere fades, by its depth [m] among the others."""
    if not len(depth):
        return depth
    return np.asarray(0.22 * (depth - depth.min()) / max(float(np.ptp(depth)), 1e-12))


def _averaged(picture: np.ndarray) -> np.ndarray:
    """The picture at the pixels' own size; what is transparent gives no colour to a mean."""
    height, width = (n // FINER for n in picture.shape[:2])
    parts = picture.reshape(height, FINER, width, FINER, 4)
    opaque = parts[..., 3:].sum(axis=(1, 3))
    colour = (parts[..., :3] * parts[..., 3:]).sum(axis=(1, 3)) / np.maximum(opaque, 1)
    return np.concatenate([colour, opaque / FINER**2], axis=-1)
