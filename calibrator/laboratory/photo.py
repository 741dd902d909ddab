"""A photograph of a heap, a slope or a drum: outline, profile and angle with errors."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calibrator.errors import CalibratorError
from calibrator.laboratory.camera import Camera, carved, cone_angle, foot, known_length, level
from calibrator.laboratory.drum import drum_values
from calibrator.laboratory.outcome import Reading, Value
from calibrator.laboratory.picture import Sand, draw, find_sand, read_picture, upper_outline
from calibrator.laboratory.profile import Ground, Surface, heap_axis, measure_profile

EDGES = (-0.3, 0.0, 0.3)  # levels at which the outline is taken: how sharp it is shows its error
BLUR = (-0.68, 0.68)  # levels at which sand is there 16 and 84 % of the time
EXCESS, EXCESS_ERROR = 0.65, 0.3
"""How far an outline runs above the mean surface, in grain diameters, and how well that is known.

From scans of piles of YADE runs: 0.4 to 0.85 grain diameters all over the flank, whatever its angle
(docs/measure.md).
"""
CARVED = 0.75  # share of that which is left where a round body was carved from the outline
NEAREST, NEAR = 3.0, 17.0  # [deg] between tilt and angle: refused, doubted
TOO_LOW = 3.0  # [deg] by which an angle is read too low there
LEANING = 5.0  # [deg] between the given tilt and that which the foot shows


@dataclass(frozen=True)
class Shot:
    """How to read a photograph.

    shape : heap, slope or drum; camera; known : a length in the picture, "" where there is none;
    crop : left, top, right, bottom; base : row of the ground; circle : column, row and radius of a
    drum; all in pixels of the file; ground : what is known of the surface; overlay : file to draw.
    """

    shape: str
    camera: Camera
    known: str = ""
    crop: tuple[float, ...] | None = None
    base: float | None = None
    circle: tuple[float, ...] | None = None
    ground: Ground = dataclasses.field(default_factory=Ground)
    overlay: Path | None = None


def measure_photo(path: Path, shot: Shot) -> tuple[Reading, list[str]]:
    """Angle and profile of a photograph, and what was converted, in words.

    Raises CalibratorError for a picture that cannot be read so, with what to do.
    """
    picture, smaller = read_picture(path)
    shape = (picture.shape[0], picture.shape[1])
    camera, words = shot.camera, ""
    if shot.known:
        metres, relative, words = known_length(shot.known, shape, smaller)
        camera = dataclasses.replace(camera, metres=metres, metres_error=relative)
    inside, box = _inside(shape, shot, smaller)
    sand = find_sand(
        picture, inside, _surely_ground(inside, box, shot.shape), path.name, shot.shape != "heap"
    )
    _within_frame(sand, box, shot, path.name)
    base = None if shot.base is None else shot.base / smaller
    reader: dict[str, Callable[[float], Surface]] = {
        "heap": lambda edge: _heap(sand, edge, camera, base, shot.ground),
        "slope": lambda edge: _slope(sand, edge, camera, base or box[3] - 1, box, shot.ground),
        "drum": lambda edge: _drum(sand, edge, camera, _circle(shot, box, smaller)),
    }
    surfaces = [reader[shot.shape](edge) for edge in EDGES]
    middle = surfaces[1]
    values = _with_errors(middle, [surfaces[0], surfaces[2]], camera, shot)
    overlay = ""
    if shot.overlay is not None:
        columns, rows = upper_outline(sand)
        lines = [(columns, rows, (1.0, 0.1, 0.1))]
        draw(picture, lines + _guides(middle, camera, shot, (columns, rows), base), shot.overlay)
        overlay = str(shot.overlay)
    notes = (*middle.notes, *_camera_notes(camera, sand, shape, smaller))
    profile = (tuple(map(float, middle.position)), tuple(map(float, middle.height)))
    found = Reading(path.name, values, notes, middle.warnings, profile, overlay)
    return found, [f"{path.name}: {words}"] if words else []


def _inside(
    shape: tuple[int, int], shot: Shot, smaller: int
) -> tuple[np.ndarray, tuple[int, int, int, int]]:
    """Where to look, and the box of it: left, top, right, bottom."""
    left, top, right, bottom = 0, 0, shape[1], shape[0]
    if shot.crop is not None:
        left, top, right, bottom = (round(side / smaller) for side in shot.crop)
        if not (0 <= left < right - 40 and right <= shape[1] and 0 <= top < bottom - 40):
            raise CalibratorError(
                "--crop: give left,top,right,bottom within the picture, in pixels"
            )
        bottom = min(bottom, shape[0])
    if shot.base is not None:
        bottom = min(bottom, round(shot.base / smaller))
    inside = np.zeros(shape, bool)
    inside[top:bottom, left:right] = True
    box = (left, top, right, bottom)
    if shot.shape == "drum":
        column, row, radius = _circle(shot, box, smaller)
        y, x = np.indices(shape)
        inside &= np.hypot(x - column, y - row) < 0.97 * radius  # the rim is neither
    if inside.sum() < 2000:
        raise CalibratorError("nothing of the picture is left; correct --crop, --base or --circle")
    return inside, box


def _circle(shot: Shot, box: tuple[int, int, int, int], smaller: int) -> tuple[float, float, float]:
    """Column, row and radius of the drum: as given, else the circle that fills the picture."""
    if shot.circle is not None:
        column, row, radius = (number / smaller for number in shot.circle)
        return column, row, radius
    left, top, right, bottom = box
    radius = min(right - left, bottom - top) / 2
    return (left + right - 1) / 2, (top + bottom - 1) / 2, radius


def _surely_ground(inside: np.ndarray, box: tuple[int, int, int, int], shape: str) -> np.ndarray:
    """What of a picture is surely background: its upper edge, and the upper sides beside a heap."""
    left, top, right, bottom = box
    ground = np.zeros_like(inside)
    if shape == "drum":
        rows = np.flatnonzero(inside.any(axis=1))
        ground[: rows[0] + max(8, len(rows) // 6)] = True
        return np.asarray(ground & inside)
    ground[: top + max(8, (bottom - top) // 12)] = True
    if shape == "heap":
        side, half = max(8, (right - left) // 33), (top + bottom) // 2
        ground[:half, : left + side] = True
        ground[:half, right - side :] = True
    return np.asarray(ground & inside)


def _within_frame(sand: Sand, box: tuple[int, int, int, int], shot: Shot, name: str) -> None:
    """Raise CalibratorError where the outline touches the frame."""
    left, top, right, bottom = box
    if shot.shape == "drum":
        return
    touched = ["top"] * bool(sand.part[top].any())
    if shot.shape == "heap":
        touched += ["left"] * bool(sand.part[:, left].any())
        touched += ["right"] * bool(sand.part[:, right - 1].any())
        touched += ["bottom"] * bool(sand.part[bottom - 1].any() and shot.base is None)
    if touched:
        raise CalibratorError(
            f"{name}: the outline touches the {' and the '.join(touched)} of the frame; take the"
            " picture with background all around, cut other things off with --crop, or give the"
            " ground with --base"
        )


def _heap(sand: Sand, edge: float, camera: Camera, base: float | None, ground: Ground) -> Surface:
    """A heap from its outline."""
    unit = camera.unit
    columns, rows = upper_outline(sand, edge)
    lowest = sand.part.shape[0] - 1 - sand.part[::-1][:, columns.astype(int)].argmax(axis=0)
    u, v = level(columns, -rows, camera)
    _, low = level(columns, -lowest.astype(float), camera)
    axis = heap_axis(u, v - float(np.quantile(low, 0.02)))
    # grains that lie about are not the foot
    grain = 2 * (ground.grain_radius or 0.0) / unit
    wide = v - low > 1.5 * grain
    middle, seen = foot(u[wide] - axis, low[wide], camera.tilt)
    middle = middle if base is None else -base
    warnings = []
    if base is None and abs(seen - camera.tilt) > LEANING:
        warnings.append(
            f"the heap's foot is bent as if the camera looked down by {seen:.0f} deg; correct"
            f" --tilt, which is {camera.tilt:g}"
        )
    excess = EXCESS * grain * (CARVED if camera.tilt else 1.0)
    height = v - middle - excess
    left, right = u <= axis, u >= axis
    z = np.concatenate(
        [
            carved((axis - u[left])[::-1], height[left][::-1], camera.tilt)[::-1],
            carved(u[right] - axis, height[right], camera.tilt),
        ]
    )
    x = np.concatenate([u[left], u[right]]) - axis
    own = dataclasses.replace(ground, axis=0.0, base=0.0)
    try:
        found = measure_profile(x * unit, z * unit, "heap", own)
    except CalibratorError as error:
        raise CalibratorError(*(warnings or error.messages)) from None
    warnings += _steep(found.values["pile_angle_of_repose_deg"].value, camera)
    if not grain:
        warnings.append(
            "an outline runs over the highest grains; give --grain-diameter and --known, and what"
            " it lies too high is taken off"
        )
    notes = [f"outline {excess * unit * 1e3:.2g} mm above the mean surface taken off"] * bool(grain)
    return dataclasses.replace(found, notes=(*found.notes, *notes), warnings=tuple(warnings))


def _steep(angle: float, camera: Camera) -> list[str]:
    """What to doubt of a heap [deg] that the camera looks down upon; refused where it hides."""
    if camera.tilt and angle < camera.tilt + NEAREST:
        raise CalibratorError(
            f"the camera looks down by {camera.tilt:g} deg on a heap of about {angle:.0f} deg: its"
            " flank is hidden behind its front; take the picture from lower down"
        )
    if camera.tilt and angle < camera.tilt + NEAR:
        return [
            f"the camera looks down almost as steeply as the heap: its angle of {angle:.0f} deg is"
            f" read up to {TOO_LOW:g} deg too low; take the picture from lower down"
        ]
    return []


def _slope(
    sand: Sand,
    edge: float,
    camera: Camera,
    base: float,
    box: tuple[int, int, int, int],
    ground: Ground,
) -> Surface:
    """A slope behind a pane, or of the same profile from front to back."""
    columns, rows = upper_outline(sand, edge)
    keep = (columns >= box[0] + 2) & (columns <= box[2] - 3)  # the outline ends at the walls
    u, v = level(columns[keep], base - rows[keep], camera)
    z = np.maximum(v, 0.0) / math.cos(math.radians(camera.tilt))
    return measure_profile(u * camera.unit, z * camera.unit, "slope", ground)


def _drum(sand: Sand, edge: float, camera: Camera, circle: tuple[float, float, float]) -> Surface:
    """The surface in a drum, about its axis."""
    outer, inner = (_drum_outline(sand, side, camera, circle) for side in BLUR)
    outline = _drum_outline(sand, edge, camera, circle)
    return drum_values(outline, circle[2] * camera.unit, (outer, inner))


def _drum_outline(
    sand: Sand, edge: float, camera: Camera, circle: tuple[float, float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """The upper edge of what is in a drum, about its axis; edge : level at which it is taken."""
    column, row, radius = circle
    columns, rows = upper_outline(sand, edge)
    # where the sand reaches up to the rim there is no surface
    free = np.hypot(columns - column, rows - row) < 0.94 * radius
    u, v = level(columns[free] - column, row - rows[free], camera)
    v = v / math.cos(math.radians(camera.tilt))
    return u * camera.unit, v * camera.unit


def _with_errors(
    middle: Surface, others: list[Surface], camera: Camera, shot: Shot
) -> dict[str, Value]:
    """The values with the errors of the outline, the sides, the fit, the tilt and the grains.

    Lengths and curvatures are left out where nothing in the picture has a known length.
    """
    found = {}
    grain = 2 * (shot.ground.grain_radius or 0.0)
    reach = float(np.ptp(middle.position)) or 1.0
    pixel = camera.unit / math.sqrt(6) / (reach / 2)  # one pixel, at both ends of a flank
    for name, one in middle.values.items():
        if one.unit not in ("deg", "1") and camera.metres is None:
            continue
        sharp = [s.values[name].value for s in others if name in s.values]
        error = [(max(sharp) - min(sharp)) / 2] if sharp else []
        if one.unit == "deg" and not name.endswith("asymmetry_deg"):
            error += [math.degrees(pixel), one.error or 0.0]
            error += [math.degrees(EXCESS_ERROR * grain / (0.6 * reach))]
            error += [_tilt_error(one.value, camera, shot.shape)]
            near = shot.shape == "heap" and camera.tilt > max(0.0, one.value - NEAR)
            error += [TOO_LOW / 2] * near
        else:
            error += [one.error or 0.0, abs(one.value) * camera.metres_error * (one.unit != "1")]
        found[name] = dataclasses.replace(one, error=math.hypot(*error))
    return found


def _tilt_error(angle: float, camera: Camera, shape: str) -> float:
    """What the error of the tilt does to an angle [deg]."""
    if not 0 < angle < 89:
        return 0.0
    low, high = max(camera.tilt - camera.tilt_error, 0.0), camera.tilt + camera.tilt_error
    if shape == "heap":
        t = math.radians(camera.tilt)
        square = (math.tan(math.radians(angle)) * math.cos(t)) ** 2 - math.sin(t) ** 2
        seen = math.degrees(math.atan(math.sqrt(max(square, 0.0))))
        return abs(cone_angle(seen, high) - cone_angle(seen, low)) / 2
    slope = math.tan(math.radians(angle)) * math.cos(math.radians(camera.tilt))
    ends = [math.degrees(math.atan(slope / math.cos(math.radians(t)))) for t in (low, high)]
    return abs(ends[1] - ends[0]) / 2


def _camera_notes(camera: Camera, sand: Sand, shape: tuple[int, int], smaller: int) -> list[str]:
    """How the picture was read."""
    scale = f"{camera.metres * 1e3:.4g} mm a pixel" if camera.metres else "no known length"
    said = f"{shape[1]} x {shape[0]} pixels"
    said += f" ({smaller} x {smaller} of the file taken together)" * (smaller > 1)
    return [
        f"{said}, {scale}, tilt {camera.tilt:g} +- {camera.tilt_error:g} deg, roll"
        f" {camera.roll:g} deg; contrast {sand.contrast:.0f} times the scatter of the background"
    ]


def _guides(
    surface: Surface,
    camera: Camera,
    shot: Shot,
    outline: tuple[np.ndarray, np.ndarray],
    base: float | None,
) -> list[tuple[np.ndarray, np.ndarray, tuple[float, float, float]]]:
    """Lines that show the measured angle, as it appears in the picture: at half height."""
    columns, rows = outline
    name = next(n for n in surface.values if n.endswith(("repose_deg", "drum_angle_deg")))
    t = math.radians(camera.tilt)
    slope = math.tan(math.radians(surface.values[name].value))
    if shot.shape == "heap":
        slope = math.sqrt(max((slope * math.cos(t)) ** 2 - math.sin(t) ** 2, 0.0))
    else:
        slope *= math.cos(t)
    low, high = float(np.quantile(rows, 0.9)), float(rows.min())
    half = (low + high) / 2
    top = int(np.argmin(rows))
    sides = [(slice(None, top + 1), -1.0), (slice(top, None), 1.0)]
    if shot.shape != "heap":
        falls = 1.0 if np.polyfit(columns, rows, 1)[0] > 0 else -1.0
        sides = [(slice(None), falls)]
    lines = []
    for part, down in sides:
        c, r = columns[part], rows[part]
        if len(c) == 0:
            continue
        at = int(np.argmin(np.abs(r - half)))
        reach = np.array([-0.15, 0.15]) * (columns[-1] - columns[0])
        turned = math.atan(slope * down) - math.radians(camera.roll)
        lines.append((c[at] + reach, r[at] + reach * math.tan(turned), (0.1, 0.9, 0.2)))
    return lines
