"""From pixels to lengths, and what the tilt of a camera does to a surface.

All formulas are for a camera far away against the size of what it sees (parallel projection). At a
distance of ten times the width of a heap the perspective changes its angle by half a degree
(tests/laboratory/test_photo.py).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from calibrator.errors import CalibratorError, shown
from calibrator.laboratory.units import quantity

STEEPEST = 60.0  # [deg] tilt of a camera
_BOTH_ENDS = re.compile(r"\s*([\d.]+),([\d.]+)\s+([\d.]+),([\d.]+)\s*=(.*)", re.ASCII)
_WIDTH = re.compile(r"\s*([\d.]+)\s*(?:px|pixels)?\s*=(.*)", re.ASCII)


@dataclass(frozen=True)
class Camera:
    """How the picture was taken.

    metres : per pixel, None where no length is known; metres_error : its relative error; tilt,
    tilt_error : by how much the camera looks down [deg]; roll : by how much the picture's horizon
    is turned anticlockwise [deg].
    """

    metres: float | None = None
    metres_error: float = 0.0
    tilt: float = 0.0
    tilt_error: float = 1.0
    roll: float = 0.0

    def __post_init__(self) -> None:
        for name, angle in (("tilt", self.tilt), ("roll", self.roll)):
            if not abs(angle) <= STEEPEST:
                raise CalibratorError(f"--{name} {angle:g}: give -{STEEPEST:g} to {STEEPEST:g} deg")
        if self.tilt < 0:
            raise CalibratorError(
                "a camera that looks up does not see the ground: give a --tilt of 0 or more"
            )
        if not 0 <= self.tilt_error <= 10:
            raise CalibratorError(f"--tilt-error {self.tilt_error:g}: give 0 to 10 deg")

    @property
    def unit(self) -> float:
        """Metres per pixel, or 1 where lengths stay in pixels."""
        return self.metres or 1.0


def known_length(text: str, shape: tuple[int, int], smaller: int) -> tuple[float, float, str]:
    """Metres per pixel, their relative error, and what was converted, from a length in the picture.

    Parameters
    ----------
    text : "x1,y1 x2,y2 = 84 mm", the ends in pixels from the upper left, or "406 = 84 mm", the
        length in pixels.
    shape : rows and columns of the picture as it is read.
    smaller : by how much it was made smaller; pixels are counted in the file.

    Raises
    ------
    CalibratorError : where this is no length, or its ends lie outside of the picture.
    """
    rows, columns = (side * smaller for side in shape)
    if found := _BOTH_ENDS.fullmatch(text):
        x1, y1, x2, y2 = (_pixel(cell) for cell in found.groups()[:4])
        if max(x1, x2) > columns or max(y1, y2) > rows:
            raise CalibratorError(
                f"--known {shown(text)} ends outside of the picture, which has {columns} x {rows}"
                " pixels; count columns, then rows, from the upper left"
            )
        pixels, written = math.hypot(x2 - x1, y2 - y1), found[5]
    elif found := _WIDTH.fullmatch(text):
        pixels, written = _pixel(found[1]), found[2]
        if pixels > math.hypot(rows, columns):
            raise CalibratorError(
                f"--known {shown(text)} is longer than the picture, which has {columns} x {rows}"
                " pixels; correct it"
            )
    else:
        raise CalibratorError(
            f'--known {shown(text)}: write "x1,y1 x2,y2 = 84 mm", or "406 = 84 mm" for a length of'
            " 406 pixels"
        )
    metres, words = quantity(written, "m", "known length")
    if not (pixels >= 10 and metres > 0):
        raise CalibratorError(
            f"--known {shown(text)}: give a positive length of at least 10 pixels"
        )
    # each end is set to a pixel or so
    return metres / pixels * smaller, math.sqrt(2) / pixels, words


def _pixel(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise CalibratorError(
            f"--known: {shown(text)} is no number of pixels; correct it"
        ) from None


def level(u: np.ndarray, v: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Points of a picture (n,), to the right and up, with the horizon turned back by the roll."""
    roll = math.radians(camera.roll)
    c, s = math.cos(roll), math.sin(roll)
    return u * c + v * s, v * c - u * s


def cone_angle(seen: float, tilt: float) -> float:
    """Angle [deg] of a cone whose outline rises by `seen` [deg] in a picture from above by `tilt`.

    A level line at depth y, away from the camera, appears y sin(tilt) higher, and a height z as
    z cos(tilt): the base circle is an ellipse of half axes R and R sin(tilt) below an apex at h
    cos(tilt). Its tangents through the apex are the outline: tan(seen)^2 = tan(angle)^2 cos(tilt)^2
    - sin(tilt)^2 (pole and polar of an ellipse; it is the condition of tangency of a line with
    slope m and intercept c, c^2 = m^2 a^2 + b^2).
    """
    m, t = math.tan(math.radians(seen)), math.radians(tilt)
    return math.degrees(math.atan(math.sqrt(m * m + math.sin(t) ** 2) / math.cos(t)))


def seen_angle(angle: float, tilt: float) -> float | None:
    """The inverse of `cone_angle`; None where the camera looks down more steeply than the cone."""
    m, t = math.tan(math.radians(angle)), math.radians(tilt)
    square = (m * math.cos(t)) ** 2 - math.sin(t) ** 2
    return math.degrees(math.atan(math.sqrt(square))) if square >= 0 else None


def carved(rho: np.ndarray, v: np.ndarray, tilt: float) -> np.ndarray:
    """Height of a round body's surface from one side of the outline of its picture.

    The ring of radius rho at height z appears as an ellipse, and nothing of it may lie above the
    outline v: z(rho) = min over u <= rho of (v(u) - sin(tilt) sqrt(rho^2 - u^2)) / cos(tilt). That
    is the largest round body in the outline (its visual hull, Laurentini, IEEE Trans. Pattern
    Anal. 16, 1994); every ring that is seen against the background has its true height, and a
    straight flank has the angle of `cone_angle`.

    rho : (n,) distance from the axis in the picture, rising; v : (n,) height above the middle of
    the base in the picture; in one unit.
    """
    t = math.radians(tilt)
    if tilt == 0:
        return v
    depth = np.sqrt(np.maximum(rho[:, None] ** 2 - rho[None, :] ** 2, 0.0))
    below = np.where(rho[None, :] <= rho[:, None], v[None, :] - math.sin(t) * depth, np.inf)
    return np.asarray(below.min(axis=1) / math.cos(t))


def foot(u: np.ndarray, v: np.ndarray, tilt: float) -> tuple[float, float]:
    """Height of the middle of a heap's base in the picture, and the tilt [deg] that its foot shows.

    The front of the base is the lower half of an ellipse: v(u) = middle - sin(tilt) sqrt(R^2 -
    u^2). u, v : (n,) points of the lower outline, u from the axis.
    """
    radius = float(np.ptp(u)) / 2
    bulge = np.sqrt(np.maximum(radius**2 - u**2, 0.0))
    shape = np.column_stack([np.ones_like(u), -bulge])
    (_, sine), *_ = np.linalg.lstsq(shape, v, rcond=None)
    inner = np.abs(u) < 0.5 * radius  # further out grains that lie about count for more
    middle = float(np.median((v + math.sin(math.radians(tilt)) * bulge)[inner]))
    return middle, math.degrees(math.asin(float(np.clip(sine, -1, 1))))
