"""Photographs of heaps, slopes and drums whose angles are known: grains as shaded spheres."""

import numpy as np


def camera(centres, tilt_deg, distance, turned_deg=0.0):
    """Right, up and nearness (n,) of points [m] in a camera's picture, and its magnification (n,).

    The camera looks down by tilt_deg at the origin from a distance [m]; infinite: without
    perspective. turned_deg : about the heap's axis before.
    """
    turn, tilt = np.radians(turned_deg), np.radians(tilt_deg)
    x, y, z = np.asarray(centres, float).T
    x, y = x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)
    up = z * np.cos(tilt) + y * np.sin(tilt)
    near = z * np.sin(tilt) - y * np.cos(tilt)
    larger = np.ones_like(near) if np.isinf(distance) else distance / (distance - near)
    return x * larger, up * larger, near, larger


def spheres(centres, radius, tilt_deg=0.0, pixel=1e-4, size=(480, 800), **how):
    """A picture (rows, columns) of grains before a plain background, and where the axis meets the
    ground in it (column, row).

    pixel : size of one [m]; how : sand and ground, their brightness; roll_deg of the camera;
    turned_deg, distance; light, as it falls off from left to right; noise; seed.
    """
    sand, ground = how.get("sand", 0.75), how.get("ground", 0.12)
    right, up, near, larger = camera(
        centres, tilt_deg, how.get("distance", np.inf), how.get("turned_deg", 0.0)
    )
    roll = np.radians(how.get("roll_deg", 0.0))
    right, up = right * np.cos(roll) - up * np.sin(roll), right * np.sin(roll) + up * np.cos(roll)
    middle = (size[1] / 2, 0.65 * size[0])
    picture = np.full(size, ground)
    order = np.argsort(near)
    for i in order:
        column, row = middle[0] + right[i] / pixel, middle[1] - up[i] / pixel
        r = radius * larger[i] / pixel
        r0, r1 = max(0, int(row - r)), min(size[0], int(row + r) + 2)
        c0, c1 = max(0, int(column - r)), min(size[1], int(column + r) + 2)
        if r0 >= r1 or c0 >= c1:
            continue
        dy = (np.arange(r0, r1)[:, None] - row) / r
        dx = (np.arange(c0, c1)[None, :] - column) / r
        depth = 1 - dx**2 - dy**2
        # lit from the camera's upper left, with light from all around
        facing = 0.45 + 0.55 * np.clip((np.sqrt(np.clip(depth, 0, 1)) - 0.4 * dy - 0.2 * dx), 0, 1)
        picture[r0:r1, c0:c1] = np.where(depth > 0, sand * facing, picture[r0:r1, c0:c1])
    return lit(picture, **how), middle


def lit(picture, light=1.0, noise=0.0, seed=1, blur=1, **_):
    """A picture in light that falls off to this share on the right, with a camera's noise."""
    fall = np.linspace(1, light, picture.shape[1])[None, :]
    fall = fall * np.linspace(1, (1 + light) / 2, picture.shape[0])[:, None]
    for _ in range(blur):
        wide = np.pad(picture, 1, mode="edge")
        wide = (wide[:-2] + wide[1:-1] + wide[2:]) / 3
        picture = (wide[:, :-2] + wide[:, 1:-1] + wide[:, 2:]) / 3
    random = np.random.default_rng(seed).normal(0, noise, picture.shape) if noise else 0.0
    return np.clip(picture * fall + random, 0, 1)
