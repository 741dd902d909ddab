"""What a vessel smaller than the laboratory's, at the same grains, leaves of each measurement.

Lengths shrink in proportion, so that the number of grains across is what changes. A neck whose
rate was measured stays as wide as it is, and where the cylinder about it still holds too many
grains, they are coarser there. What is said here was measured on this project's own runs
(`python -m benchmarks.numerics.scaled_vessels`), or is Beverloo's law.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.runs.setups import NOMINAL_FRACTION

LENGTHS = {
    "hourglass": ("cylinder_diameter", "neck_diameter"),
    "ledge": ("box_length", "fill_height"),
    "conical_pile": ("cylinder_diameter", "fill_height", "lift_height"),
    "rotating_drum": ("drum_diameter",),
}
"""What shrinks, the width of the vessel first. The mass of an hourglass goes with its cube."""

FEWEST_ACROSS = {"hourglass": 15.0, "ledge": 15.0, "conical_pile": 12.0, "rotating_drum": 20.0}
"""Grain diameters across the smallest vessel that `init` writes."""
NARROWEST_NECK = 8.0
"""Grain diameters; at high friction narrower ones clog."""
EMPTY_RING, RING_ERROR = 1.4, 0.15
"""k of Beverloo's law, a rate that goes with (D_0 - k d)^2.5, and its standard error.

The rates through necks of 9 and 7 grain diameters in 32 sets of frictions (grid/missing_effect.csv)
give 1.36 +- 0.08; W. A. Beverloo et al., Chem. Eng. Sci. 15 (1961) 260 have 1.4 for sand.
"""
FREE_WIDTH, FREE_HEIGHT = 2.5, 2.0
"""Neck diameters of cylinder and fill from which the rate does not know of them.

R. M. Nedderman, Statics and Kinematics of Granular Materials (1992), section 10.2. In a cylinder of
2.2 necks with a fill of one it was off by +32 to -9 % (`benchmarks/results/hourglass_scale.json`).
"""
RATE_ERROR = 0.05
"""Of a rate in the smallest such vessel: ours were never run beside wide ones."""
FEWEST_DEEP = 5.0
"""Grain diameters between the faces of a drum."""
LEDGE_WIDTH = 8.0
"""Grain diameters of the ledge's period from front to back."""

SOFTER = {
    "bulk_density": {3e-4: (0.007, 0.002), 1e-3: (0.029, 0.004)},
    "mass_flow_rate": {3e-4: (0.0, 0.03), 1e-3: (-0.03, 0.03)},
    "pile_equivalent_angle_deg": {3e-4: (-0.3, 0.3), 1e-3: (-0.3, 0.3)},
    "pile_angle_of_repose_deg": {3e-4: (-0.9, 0.5), 1e-3: (-1.0, 0.8)},
    "ledge_equivalent_angle_deg": {3e-4: (-0.2, 0.6), 1e-3: (-0.7, 0.8)},
    "ledge_angle_of_repose_deg": {3e-4: (-0.2, 1.5), 1e-3: (-1.1, 2.0)},
    "drained_equivalent_angle_deg": {3e-4: (-0.7, 0.6), 1e-3: (-1.9, 0.6)},
}
"""What softer grains do to a response, by softness: the change from grains.SOFTNESS[0] and its
standard error, of densities and rates as a share, of angles in degrees.

Means over four friction pairs of five seeds, errors with the scatter from pair to pair
(`python -m benchmarks.runs.softness`, 180 runs of three set-ups).
"""
TAKEN = {3e-4: (0.0, 0.8), 1e-3: (-0.7, 1.0)}
"""Of angles that were not measured so."""

OF_THE_VESSEL = ("residual_mass", "discharge_time", "emptying_time", "onset_delay")
OF_THE_CRATER = ("residual_fraction", "drained_")


@dataclass(frozen=True)
class Kept:
    """What becomes of a measured value in a smaller vessel.

    value : that the smaller vessel would show; error : of that step, one standard deviation; words
    : why, "" where nothing changes.
    """

    value: float
    error: float = 0.0
    words: str = ""


@dataclass(frozen=True)
class Lost:
    """Why a measured value says nothing of a smaller vessel."""

    words: str


def across(setup: str, vessel: dict[str, float]) -> float:
    """Width of a vessel over the diameter of its grains."""
    return vessel[LENGTHS[setup][0]] / (2 * vessel["particle_radius"])


def smaller(
    setup: str, lab: dict[str, float], most: float, responses: Sequence[str]
) -> dict[str, float]:
    """The vessel to simulate, at most so many grain diameters across where that is possible.

    lab : the laboratory's, with radius and density of its grains [SI]; it is taken as it is where
    it is that small.
    """
    grain = 2 * lab["particle_radius"]
    least = min(max(most, FEWEST_ACROSS[setup]) / across(setup, lab), 1.0)
    found = dict(lab)
    if setup == "ledge":
        found["box_width"] = min(lab.get("box_width", math.inf), LEDGE_WIDTH * grain)
    if setup == "hourglass" and "mass_flow_rate" in responses:
        found |= _about_the_neck(lab, least, most)
    elif setup == "rotating_drum":
        # of its size, the speed is right: coarser grains, as far as five fit between the faces
        coarser = max(1.0, min(1 / least, lab["drum_depth"] / (FEWEST_DEEP * grain)))
        found["particle_radius"] = lab["particle_radius"] * coarser
    elif setup == "hourglass":
        least = min(max(least, NARROWEST_NECK * grain / lab["neck_diameter"]), 1.0)
        found |= {n: lab[n] * least for n in LENGTHS[setup]}
        found["fill_mass"] = lab["fill_mass"] * least**3
    else:
        found |= {n: lab[n] * least for n in LENGTHS[setup]}
    if setup == "conical_pile":
        # how fast a lift is, is told by its speed over that of a fall through the width
        found["lift_speed"] = lab["lift_speed"] * math.sqrt(least)
        # beyond, the cylinder touches no grain any more, and costs time
        found["lift_height"] = min(found["lift_height"], clear_height(found, grain))
    return {n: float(f"{v:.4g}") for n, v in found.items()}


def clear_height(vessel: dict[str, float], grain: float) -> float:
    """Height [m] at which a lifted cylinder is clear of the heap below it, whatever that is.

    One of 45 degrees, steeper than those of spheres, has a radius and a height of (3 V / pi)^(1/3).
    """
    radius = vessel["cylinder_diameter"] / 2
    highest = float(np.cbrt(3 * radius**2 * vessel["fill_height"]))
    return max(highest - radius, 0.0) + 3 * grain


def _about_the_neck(lab: dict[str, float], scale: float, most: float) -> dict[str, float]:
    """A cylinder and a fill of which the rate through the laboratory's neck does not know.

    scale : of the cylinder, as far as the neck lets it; most : grain diameters across, for which
    grains become coarser, as far as the neck lets them.
    """
    width, neck, radius = lab["cylinder_diameter"], lab["neck_diameter"], lab["particle_radius"]
    height = lab["fill_mass"] / (_mass_per_height(lab) * width**2)
    new = min(max(width * scale, FREE_WIDTH * neck), width)
    lowest = max(min(height, FREE_HEIGHT * neck), height * scale)
    wanted = new / (2 * radius) / max(most, FEWEST_ACROSS["hourglass"])
    coarser = max(1.0, min(wanted, neck / (2 * radius) / NARROWEST_NECK))
    return {
        "cylinder_diameter": new,
        "fill_mass": lowest * _mass_per_height(lab) * new**2,
        "particle_radius": radius * coarser,
    }


def _mass_per_height(lab: dict[str, float]) -> float:
    """Mass over height and squared diameter of a filled cylinder [kg/m3]."""
    return math.pi / 4 * NOMINAL_FRACTION * lab["particle_density"]


def carried(
    setup: str, response: str, value: float, lab: dict[str, float], new: dict[str, float]
) -> Kept | Lost:
    """What a value measured in the laboratory's vessel is in the simulated one."""
    more = 1 / across(setup, new) - 1 / across(setup, lab)
    if lab == new or more <= 1e-9:
        return Kept(value)
    if response == "bulk_density":
        return Kept(
            value * (1 - 0.3 * more),
            value * 0.15 * more,
            "walls loosen the packing by 0.3 of its value times d/D (heaps of 10 to 20 d)",
        )
    if response == "pile_angle_of_repose_deg":
        return Kept(
            value - 50 * more,
            8 * more,
            "fitted angles of small heaps are flatter by 50 degrees times d/D (heaps of 7 to 20 d)",
        )
    if response == "pile_equivalent_angle_deg":
        return Kept(value, 25 * more, "equivalent angles moved by -14 to +37 degrees times d/D")
    if response in ("ledge_angle_of_repose_deg", "ledge_equivalent_angle_deg"):
        return Kept(value, 25 * more, "taken to move no more than those of heaps do")
    if response.endswith("_angle_deg") and setup == "rotating_drum":
        return Kept(value, 25 * more, "taken to move no more than equivalent angles of heaps do")
    if response.startswith("drum_height_"):
        return Kept(value, 0.3 * more, "taken to move as little as the angles")
    if response == "residual_fraction" and setup == "ledge":
        return Kept(value, 0.5 * more * value, "goes with the slope")
    if response == "mass_flow_rate":
        return _rate(value, lab, new)
    if response.startswith(OF_THE_CRATER):
        return Lost("a crater of few grains is not that of many, by up to 16 degrees")
    if response.startswith(OF_THE_VESSEL):
        return Lost("it belongs to the vessel's own size")
    return Lost("it was not measured how it goes with the vessel's size")


def softened(response: str, step: Kept, softness: float) -> Kept:
    """The step of a measured value, and that to softer grains."""
    usual = TAKEN if response.endswith("_deg") else {}
    by_softness = SOFTER.get(response, usual)
    if softness not in by_softness:
        return step
    change, error = by_softness[softness]
    if response.endswith("_deg"):
        known = "" if response in SOFTER else " (taken from other angles)"
        words = f"softer grains move it by {change:+.2g} degrees{known}"
    else:
        words = f"softer grains move it by {change:+.2%}"
        change, error = change * step.value, error * abs(step.value)
    return Kept(
        step.value + change,
        math.hypot(step.error, error),
        f"{step.words}; {words}" if step.words else words,
    )


def _rate(value: float, lab: dict[str, float], new: dict[str, float]) -> Kept:
    """A rate through the same neck, of grains that may be coarser."""
    neck, fine, coarse = lab["neck_diameter"], lab["particle_radius"], new["particle_radius"]
    if coarse <= fine * (1 + 1e-6):
        return Kept(value, RATE_ERROR * value, "the neck is the laboratory's own")
    free = [neck - 2 * EMPTY_RING * radius for radius in (fine, coarse)]
    found = value * (free[1] / free[0]) ** 2.5
    error = 2.5 * RING_ERROR * (2 * coarse / free[1] - 2 * fine / free[0])
    return Kept(
        found,
        math.hypot(RATE_ERROR, error) * found,
        f"grains of {2e3 * coarse:.3g} mm stand in for {2e3 * fine:.3g} mm (Beverloo's law)",
    )
