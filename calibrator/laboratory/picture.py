"""Pictures: what of them is sand, where its surface lies, and what was found drawn over them.

The only place that needs scikit-image, which is an optional dependency.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.errors import CalibratorError
from calibrator.files import read_bytes

ROUNDS = 30
LARGEST = 2000  # pixels along a side; larger pictures are made smaller by whole numbers
CLEAR = 12.0  # contrast at which a picture is blurred no further
CONTRAST = 4.0  # least difference of sand and ground over the scatter within the ground


@dataclass(frozen=True)
class Sand:
    """Where a picture shows sand.

    level (rows, columns) : how far a pixel lies on the sand's side of the brightness midway between
    sand and ground, over half of that difference: 1 is sand, -1 ground; part : its largest
    connected piece, without holes; contrast : the difference of both over the ground's scatter.
    """

    level: np.ndarray
    part: np.ndarray
    contrast: float


def _skimage(name: str) -> Any:
    """A module of scikit-image; CalibratorError where it is not installed."""
    try:
        return importlib.import_module(f"skimage.{name}")
    except ImportError:
        raise CalibratorError(
            "photographs need scikit-image, which is not installed: pip install"
            " 'dem-calibrator[photo]'"
        ) from None


def read_picture(path: Path) -> tuple[np.ndarray, int]:
    """A picture (rows, columns, 3) between 0 and 1, and by how much it was made smaller."""
    io, util = _skimage("io"), _skimage("util")
    try:
        read_bytes(path, 256)
        raw = np.asarray(io.imread(path))
    except FileNotFoundError:
        raise CalibratorError(f"no file {path}: correct its name") from None
    except Exception as error:  # each reader of pictures has its own kinds
        raise CalibratorError(f"cannot read {path} ({error}): save it as PNG or JPEG") from None
    if raw.ndim not in (2, 3) or min(raw.shape[:2]) < 50:
        raise CalibratorError(f"{path} is no picture of at least 50 pixels; save it as PNG or JPEG")
    picture = util.img_as_float(raw)
    if picture.ndim == 2:
        picture = picture[:, :, None]
    picture = picture[:, :, :3] if picture.shape[2] >= 3 else picture[:, :, :1]
    picture = np.broadcast_to(picture, (*picture.shape[:2], 3))
    smaller = -(-max(picture.shape[:2]) // LARGEST)
    if smaller > 1:
        picture = _skimage("transform").downscale_local_mean(picture, (smaller, smaller, 1))
    return np.ascontiguousarray(picture), smaller


def find_sand(
    picture: np.ndarray, inside: np.ndarray, ground: np.ndarray, what: str, halves: bool = False
) -> Sand:
    """What of a picture is sand: two smooth fields of brightness, and the line midway.

    The light may fall off over the picture: the ground's brightness is a polynomial of second
    degree, the sand's a multiple of it, both fitted in turns with the pixels that lie nearer to
    either (a segmentation by two regions, Chan and Vese, IEEE Trans. Image Process. 10, 2001, with
    fields instead of constants and without a penalty on length; small pieces and holes are dropped
    instead).

    Parameters
    ----------
    picture : (rows, columns, 3).
    inside, ground : (rows, columns) of booleans; where to look, and what is surely no sand.
    what : it is called in messages.
    halves : sand and ground are two large parts, as in a drum, and most of `ground` is no sand.

    Raises
    ------
    CalibratorError : where nothing stands out.
    """
    brightness = [picture.mean(axis=2)]
    if np.ptp(picture, axis=2).max() > 0.05:  # sand may differ from its ground by colour alone
        brightness += [picture[:, :, i] for i in range(3)]
    best, finest = None, max(1.0, max(inside.shape) / 500)
    for blur in (finest, 2 * finest, 4 * finest):  # no more than the picture's noise asks for
        found = [_two_fields(one, inside, ground, halves, blur) for one in brightness]
        best = max((s for s in (best, *found) if s), key=lambda s: s.contrast, default=None)
        if best is not None and best.contrast > CLEAR:
            break
    if best is None or best.contrast < CONTRAST:
        raise CalibratorError(
            f"{what}: no sand stands out from its background; take the picture before a plain sheet"
            " that is darker or brighter, or cut it with --crop"
        )
    return best


def _two_fields(
    brightness: np.ndarray, inside: np.ndarray, ground: np.ndarray, halves: bool, blur: float
) -> Sand | None:
    """The sand in one channel; None where nothing differs from the ground."""
    filters = _skimage("filters")
    smooth = filters.gaussian(brightness, blur, mode="nearest")
    y, x = (axis / max(brightness.shape) for axis in np.indices(brightness.shape))
    terms = [np.ones_like(x), x, y, x**2, x * y, y**2]
    low, high = np.quantile(smooth[ground], [0.01, 0.99])
    first = np.clip(_fitted(terms, smooth, ground), 0.5 * low, 1.5 * high)
    if halves:
        first = np.full_like(smooth, np.median(smooth[ground]))
    difference = np.abs(smooth - first)
    if np.ptp(difference[inside]) < 1e-3:
        return None
    sand = inside & (difference > filters.threshold_otsu(difference[inside]))
    level = np.zeros_like(smooth)
    share = 1.0
    for _ in range(ROUNDS):
        # without the blurred edge, whose brightness is of neither
        outside = inside & (filters.gaussian(sand.astype(float), 2 * blur) < 0.02)
        if not sand.any() or outside.sum() < 100:
            return None
        # a polynomial may do anything far from what it was fitted to
        low, high = np.quantile(smooth[outside], [0.01, 0.99])
        field = np.clip(_fitted(terms, smooth, outside), max(0.5 * low, 1e-3), 1.5 * high)
        share = float(np.median(smooth[sand] / field[sand]))
        if abs(share - 1) < 1e-3:
            return None
        level = (smooth / field - (1 + share) / 2) * 2 / (share - 1)
        before, sand = sand, _largest(inside & (level > 0))
        if np.array_equal(before, sand):
            break
    noise = float(np.std(smooth[outside] / field[outside])) + 1e-6
    return Sand(np.where(inside, level, -1.0), sand, abs(share - 1) / noise)


def _fitted(terms: list[np.ndarray], values: np.ndarray, where: np.ndarray) -> np.ndarray:
    """The sum of terms that fits the values there best, everywhere."""
    step = max(1, int(where.sum()) // 20_000)
    chosen = np.column_stack([t[where][::step] for t in terms])
    factors = np.linalg.lstsq(chosen, values[where][::step], rcond=None)[0]
    return np.asarray(sum(f * t for f, t in zip(factors, terms, strict=True)))


def _largest(mask: np.ndarray) -> np.ndarray:
    """The largest connected piece, without holes and without what hangs on by a thread."""
    morphology, label = _skimage("morphology"), _skimage("measure").label
    disk = morphology.disk(max(1, max(mask.shape) // 400))
    opened = morphology.opening(mask, disk)
    labels = label(opened, connectivity=1)
    if not labels.any():
        return np.zeros_like(mask)
    piece = labels == np.argmax(np.bincount(labels.ravel())[1:]) + 1
    holes = label(~piece, connectivity=1)
    rim = np.unique(np.concatenate([holes[0], holes[-1], holes[:, 0], holes[:, -1]]))
    return np.asarray(piece | ~np.isin(holes, rim))


def upper_outline(sand: Sand, at: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """The upper edge of the sand: columns (n,), and rows (n,) to a fraction of a pixel.

    at : level between ground (-1) and sand (1) at which the edge is taken.
    """
    columns = np.flatnonzero(sand.part.any(axis=0))
    first = sand.part[:, columns].argmax(axis=0)
    rows = [_crossing(sand.level[:, c], r, at) for c, r in zip(columns, first, strict=True)]
    return columns.astype(float), np.array(rows)


def _crossing(level: np.ndarray, row: int, at: float) -> float:
    """Row at which the level passes a value, next to a row where it passes zero."""
    while row > 0 and level[row] > at:
        row -= 1
    while row < len(level) - 1 and level[row + 1] < at:
        row += 1
    if row == len(level) - 1 or level[row] > at:
        return float(row)
    return row + float((at - level[row]) / (level[row + 1] - level[row]))


def draw(
    picture: np.ndarray,
    lines: list[tuple[np.ndarray, np.ndarray, tuple[float, float, float]]],
    path: Path,
) -> None:
    """Write a picture with lines (columns, rows, colour) of two pixels drawn over it."""
    shown = np.array(picture, float)
    segment = _skimage("draw").line
    for columns, rows, colour in lines:
        c, r = np.rint(columns).astype(int), np.rint(rows).astype(int)
        for i in range(len(c) - 1):
            rr, cc = segment(r[i], c[i], r[i + 1], c[i + 1])
            for down in (0, 1):
                good = (rr + down >= 0) & (rr + down < shown.shape[0])
                good &= (cc >= 0) & (cc < shown.shape[1])
                shown[rr[good] + down, cc[good]] = colour
    raw = np.rint(255 * np.clip(shown, 0, 1)).astype(np.uint8)
    _skimage("io").imsave(path, raw, check_contrast=False)
