"""The profile of a surface, position against height, measured as the scripts measure a scan.

A profile across a round heap or crater becomes a scan by turning each of its sides about the axis
by half a turn; `yade_scripts/measure.py` then measures it as it measures a simulated heap.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from calibrator.errors import CalibratorError
from calibrator.laboratory.outcome import Value
from calibrator.laboratory.scripts import scripts_measure

RASTER = 301  # pixels of a scan along a side, at most
RINGS = 20  # of half a heap, where the grains' size is not given
FEWEST = 20  # points of a profile
UNITS = {
    "pile_apex_rounding": "m",
    "pile_curvature": "1/m",
    "ledge_curvature": "1/m",
    "drained_curvature": "1/m",
}


@dataclass(frozen=True)
class Ground:
    """What is known of a profile beside its points; None: it is found.

    grain_radius [m]; axis : position of the axis of a heap or crater; base : height of the ground;
    box_length : of a ledge; cylinder_diameter and neck_diameter of a crater [m].
    """

    grain_radius: float | None = None
    axis: float | None = None
    base: float | None = None
    box_length: float | None = None
    cylinder_diameter: float | None = None
    neck_diameter: float | None = None


@dataclass(frozen=True)
class Surface:
    """A measured surface: values by response, profile (k,) and what to say of it."""

    values: dict[str, Value]
    position: np.ndarray
    height: np.ndarray
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()


def measure_profile(x: np.ndarray, z: np.ndarray, shape: str, ground: Ground) -> Surface:
    """Responses of a profile; x, z (n,) [m]; shape : heap, slope or crater.

    Raises CalibratorError for a profile that cannot be one, with what to do.
    """
    if len(x) < FEWEST:
        raise CalibratorError(f"only {len(x)} points; give a profile of at least {FEWEST}")
    order = np.argsort(x, kind="stable")
    x, z = x[order], z[order]
    if shape == "heap":
        return _heap(x, z, ground)
    return _slope(x, z, ground) if shape == "slope" else _crater(x, z, ground)


def scan(rho: list[np.ndarray], z: list[np.ndarray], half: float) -> tuple[np.ndarray, np.ndarray]:
    """A scan of a surface whose profile on the side of -x and of +x is given.

    rho, z : distance from the axis, rising, and height (n,) on either side; half : the raster
    covers [-half, half] both ways. Returns the pixels' positions (k,) and heights (k, k), 0 beyond
    the profile.
    """
    edges = np.linspace(-half, half, RASTER + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    distance = np.hypot(middle[:, None], middle[None, :])
    left, right = (np.interp(distance, r, h, right=0.0) for r, h in zip(rho, z, strict=True))
    return middle, np.where(middle[:, None] >= 0, right, left)


def heap_axis(x: np.ndarray, z: np.ndarray) -> float:
    """Where the lines of a heap's two flanks meet: the axis of the cone, whatever its apex is."""
    measure = scripts_measure()
    steps = max(3, len(z) // 40)
    smooth = np.convolve(z, np.ones(steps) / steps, "same")
    axis = float(x[np.argmax(smooth)])
    lines = []
    for side in (x <= axis, x >= axis):
        towards = np.argsort(np.abs(x[side] - axis))
        flank = measure.flank(x[side][towards], np.maximum(z[side][towards], 0.0))
        if len(flank[0]) < 4:
            return axis
        lines.append(np.polyfit(flank[0], flank[1], 1))
    (a, b), (c, d) = lines
    met = float((d - b) / (a - c)) if a > c else axis
    return met if abs(met - axis) < 0.25 * (x[-1] - x[0]) else axis


def heap_responses(
    x: np.ndarray, z: np.ndarray, axis: float, ring: float
) -> tuple[dict[str, float], dict[str, float], np.ndarray, np.ndarray]:
    """Responses of a heap's profile above its ground, what differs between its sides, and its mean.

    x, z (n,), x rising; ring : width of the rings that are averaged. Returns the responses, half of
    their difference between a heap like either side, and the mean profile (k,), (k,).
    """
    measure = scripts_measure()
    left, right = x <= axis, x >= axis
    rho = [axis - x[left][::-1], x[right] - axis]
    height = [np.maximum(z[left][::-1], 0.0), np.maximum(z[right], 0.0)]
    half = max(float(r[-1]) for r in rho) + ring
    both, position, profile = measure.pile_responses(*_square(scan(rho, height, half)), ring)
    alike = [
        measure.pile_responses(*_square(scan([r, r], [h, h], half)), ring)[0]
        for r, h in zip(rho, height, strict=True)
    ]
    differ = {
        name: abs(alike[0][name] - alike[1][name]) / 2
        for name in both
        if name in alike[0] and name in alike[1]
    }
    return {n: float(v) for n, v in both.items()}, differ, position, profile


def _square(scanned: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    middle, height = scanned
    return middle, middle, height


def _heap(x: np.ndarray, z: np.ndarray, ground: Ground) -> Surface:
    """A heap: both angles, curvature, asymmetry, apex."""
    base = float(np.quantile(z, 0.02)) if ground.base is None else ground.base
    z = z - base
    top, edge = float(z.max()), max(1, len(z) // 50)
    if not top > 0:
        raise CalibratorError("no heap rises above its ground; correct --base")
    warnings: list[str] = []
    if one_sided := ground.axis is None and min(np.argmax(z), len(z) - 1 - np.argmax(z)) < edge:
        tip = x[0] if np.argmax(z) < edge else x[-1]
        x, z = np.concatenate([x, 2 * tip - x]), np.concatenate([z, z])
        order = np.argsort(x, kind="stable")
        x, z = x[order], z[order]
        warnings.append("only one side of the heap is there: its other side is taken to be alike")
    if max(np.median(z[:edge]), np.median(z[-edge:])) > 0.2 * top:
        raise CalibratorError(
            "the profile ends on the flank, above a fifth of the height; give it down to the ground"
            " on both sides"
        )
    axis = heap_axis(x, z) if ground.axis is None else ground.axis
    if not x[0] < axis < x[-1]:
        raise CalibratorError("the axis lies outside of the profile; correct --axis")
    ring = ground.grain_radius or (x[-1] - x[0]) / 2 / RINGS
    responses, differ, position, profile = heap_responses(x, z, axis, ring)
    _require(responses, "pile_angle_of_repose_deg")
    fit = responses.pop("pile_angle_error_deg")
    if one_sided:
        responses.pop("pile_asymmetry_deg", None)
        differ = {}
    values = {n: _value(n, v, differ.get(n)) for n, v in responses.items()}
    values["pile_angle_of_repose_deg"] = _angle(responses, differ, fit, "pile")
    notes = (
        f"axis at {axis * 1e3:.4g} mm, heights from {base * 1e3:.4g} mm, rings of"
        f" {ring * 1e3:.3g} mm; line between 20 and 80 % of the height; error of the fit"
        f" {fit:.2g} deg",
    )
    return Surface(values, position, profile, notes, tuple(warnings))


def _angle(responses: dict[str, float], differ: dict[str, float], fit: float, of: str) -> Value:
    """The fitted angle with its error: that of the line, and of the mean of two sides."""
    name = f"{of}_angle_of_repose_deg"
    return Value(responses[name], float(np.hypot(fit, differ.get(name, 0.0))), "deg")


def _value(name: str, value: float, error: float | None) -> Value:
    unit = UNITS.get(name, "deg" if name.endswith("_deg") else "1")
    # an asymmetry is the difference itself, and says nothing of its own error
    return Value(value, None if name.endswith("asymmetry_deg") else error, unit)


def _require(responses: Mapping[str, object], name: str) -> None:
    """Raise CalibratorError where too few points lie on the slope."""
    if name not in responses:
        raise CalibratorError(
            "fewer than four points lie on the straight part of the slope; give more points, or a"
            " smaller --grain-diameter, which is the width that they are averaged over"
        )


def _slope(x: np.ndarray, z: np.ndarray, ground: Ground) -> Surface:
    """A slope that falls from its back wall: both angles and curvature."""
    measure = scripts_measure()
    base = min(0.0, float(z.min())) if ground.base is None else ground.base
    z = np.maximum(z - base, 0.0)
    if np.polyfit(x, z, 1)[0] > 0:  # the back wall is on the other side
        x, z = -x[::-1], z[::-1]
    x = x - x[0]
    ring = ground.grain_radius or x[-1] / 2 / RINGS
    position, profile = measure.x_profile(x, z[:, None], ring)
    responses = measure.ledge_responses(position, profile)
    _require(responses, "ledge_angle_of_repose_deg")
    fit = responses.pop("ledge_angle_error_deg")
    length = ground.box_length or float(x[-1])
    if length < 0.9 * x[-1]:
        raise CalibratorError(
            f"the profile is {x[-1] * 1e3:.4g} mm long and the ledge only {length * 1e3:.4g} mm;"
            " correct --box-length, or the unit"
        )
    volume = float(np.sum((z[1:] + z[:-1]) * np.diff(x)) / 2)
    values = {n: _value(n, float(v), None) for n, v in responses.items()}
    values["ledge_angle_of_repose_deg"] = _angle(responses, {}, fit, "ledge")
    equivalent = measure.wedge_angle_from_volume(volume, length, 1.0)
    values["ledge_equivalent_angle_deg"] = Value(equivalent, None, "deg")
    notes = (
        f"slabs of {ring * 1e3:.3g} mm, heights from {base * 1e3:.4g} mm; line between 20 and 90 %"
        f" of the height; ledge {length * 1e3:.4g} mm long",
    )
    return Surface(values, position, profile, notes)


def _crater(x: np.ndarray, z: np.ndarray, ground: Ground) -> Surface:
    """The crater of a drained cylinder: angle, curvature, asymmetry."""
    cylinder, neck, grain = ground.cylinder_diameter, ground.neck_diameter, ground.grain_radius
    if cylinder is None or neck is None or grain is None:
        raise CalibratorError(
            "the slope of a crater is cut at neck and wall: give --cylinder-diameter,"
            " --neck-diameter and --grain-diameter"
        )
    measure = scripts_measure()
    axis = float(x[0] + x[-1]) / 2 if ground.axis is None else ground.axis
    z = z - (0.0 if ground.base is None else ground.base)
    left, right = x <= axis, x >= axis
    rho = [axis - x[left][::-1], x[right] - axis]
    if min(len(r) for r in rho) < 4:
        raise CalibratorError("the axis lies outside of the profile; correct --axis")
    middle, height = scan(rho, [z[left][::-1], z[right]], cylinder / 2)
    size = (neck / 2, cylinder / 2, grain)
    responses = measure.crater_responses(middle, middle, height, *size)
    _require(responses, "drained_angle_of_repose_deg")
    fit, sides = responses.pop("drained_angle_error_deg"), responses.get("drained_asymmetry_deg", 0)
    values = {n: _value(n, float(v), None) for n, v in responses.items()}
    differ = {"drained_angle_of_repose_deg": abs(sides)}
    values["drained_angle_of_repose_deg"] = _angle(responses, differ, fit, "drained")
    position, profile = measure.radial_profile(middle, middle, height, grain)
    notes = (f"axis at {axis * 1e3:.4g} mm; a grain at the neck and one at the wall left out",)
    return Surface(values, position, profile, notes)
