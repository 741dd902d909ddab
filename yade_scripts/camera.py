"""What a camera before a drum's front face sees of the grains, averaged over time.

Pure numpy: importable without YADE. x runs to the right and z up from the drum's axis, along which
the camera looks. All is seen through the whole depth, as a shadow is. Lengths are in metres.
"""

import base64
import zlib

import numpy as np

import measure

KEPT = ("shadow", "centres", "along_x", "along_z")  # layers of a film


def pixels(drum, grain):
    """Pixel centres (n,) across a drum of that radius; grain : radius of the median one."""
    return measure.pixel_centres(drum, 2 * grain / measure.PIXELS_PER_DIAMETER)


def shadow(x, z, radii, at):
    """Which pixels (n, n) some grain lies before; x, z (m,) of centres, radii (m,) or a number."""
    radii, step, n = np.broadcast_to(radii, x.shape), at[1] - at[0], len(at)
    half = int(radii.max() / step) + 1
    around = np.arange(-half, half + 1)
    i, j = (np.rint((c - at[0]) / step).astype(int)[:, None] + around for c in (x, z))
    dx, dz = at[0] + i * step - x[:, None], at[0] + j * step - z[:, None]
    covered = dx[:, :, None] ** 2 + dz[:, None, :] ** 2 < radii[:, None, None] ** 2
    covered &= ((i >= 0) & (i < n))[:, :, None] & ((j >= 0) & (j < n))[:, None, :]
    flat = (i[:, :, None] * n + j[:, None, :])[covered]
    seen = np.zeros(n * n, bool)
    seen[flat] = True
    return seen.reshape(n, n)


def frame(centres, velocities, radii, at):
    """Layers (4, n, n) of one moment: shadow, number of centres, sums of their velocities [m/s].

    centres, velocities : (m, 2) along x and z.
    """
    n, step = len(at), at[1] - at[0]
    i, j = np.clip(np.rint((centres - at[0]) / step).astype(int), 0, n - 1).T
    layers = np.zeros((len(KEPT), n, n), np.float32)
    layers[0] = shadow(*centres.T, radii, at)
    for layer, value in zip(layers[1:], (1.0, *velocities.T), strict=True):
        np.add.at(layer, (i, j), value)
    return layers


def edge(grey, at, level):
    """Height (n,) [m] in each column above which fewer than `level` of the frames show a grain.

    grey : (n, n) share of the frames. A grain in flight darkens a pixel for a moment only, so that
    the highest crossing is the surface. NaN where there is none.
    """
    dark = grey >= level
    top = len(at) - 1 - np.argmax(dark[:, ::-1], axis=1)
    above = np.minimum(top + 1, len(at) - 1)
    column = np.arange(len(at))
    low, high = grey[column, top], grey[column, above]
    share = np.where(above > top, (low - level) / np.maximum(low - high, 1e-9), 0.0)
    return np.where(dark.any(axis=1), at[top] + share * (at[1] - at[0]), np.nan)


def surface(grey, at, drum, level=0.5):
    """The free surface, x and z (k,) [m]: that edge, where it is not the shell."""
    height = edge(grey, at, level)
    free = np.hypot(at, height) < 0.94 * drum  # no NaN is
    return at[free], height[free]


def layer_thickness(film, at, angle_deg, level, grain):
    """Thickness [m] of the flowing layer at the axis; None where no grain flows there.

    film : layers (4, n, n); angle_deg, level : slope and height [m] of the surface at the axis. The
    mean velocity along the surface, in slabs of half a grain within a diameter of the axis, falls
    with depth through zero to that of the bed, which turns with the drum the other way.
    """
    angle = np.radians(angle_deg)
    x, z = np.meshgrid(at, at - level, indexing="ij")
    along, depth = x * np.cos(angle) - z * np.sin(angle), -x * np.sin(angle) - z * np.cos(angle)
    near = (np.abs(along) < 2 * grain) & (depth > -3 * grain) & (film[1] > 0)
    slab = np.floor(depth[near] / grain).astype(int) + 3
    count = np.bincount(slab, film[1][near])
    speed = film[2] * np.cos(angle) - film[3] * np.sin(angle)
    mean = np.bincount(slab, speed[near]) / np.maximum(count, 1e-9)
    middle = (np.arange(len(count)) - 2.5) * grain
    # grains in the bed pass all the time; a slab above it that few pass says nothing
    busy = count > 0.1 * np.median(count[count > 0]) if count.any() else count > 0
    mean, middle = mean[busy], middle[busy]
    turns = np.flatnonzero((mean[:-1] > 0) & (mean[1:] <= 0))
    if len(turns) == 0:
        return None
    k = turns[0]
    return float(middle[k] + (middle[k + 1] - middle[k]) * mean[k] / (mean[k] - mean[k + 1]))


def packed(film):
    """A film as text, such as a checkpoint's JSON can hold."""
    return base64.b64encode(zlib.compress(film.astype(np.float32).tobytes(), 1)).decode()


def unpacked(text, n):
    """The film (4, n, n) of such a text."""
    raw = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.float32)
    return raw.reshape(len(KEPT), n, n).copy()
