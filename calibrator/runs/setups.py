"""One entry for each set-up: all that is known of it beside its script and the vocabulary.

What a run will cost, what the report draws of it, and what its geometry asks for. A set-up is added
by its script, its words in the contract, and an entry here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from calibrator.case.physics import GRAVITY, time_step
from calibrator.runs.request import Request

NOMINAL_FRACTION = 0.57
"""Packing fraction of a filling, from which the scripts get the number of grains."""

Numbers = Mapping[str, float]
"""The parameters of a request that are numbers, by name [SI]."""

Outline = tuple[np.ndarray, ...]
"""Walls as polylines (k, 2) of x and z [m]."""


@dataclass(frozen=True)
class Curve:
    """Two arrays that a run leaves, one to be drawn over the other.

    Attributes
    ----------
    name : of the figure.
    across, up : names of the arrays, both of shape (n,).
    labels : of the two axes, with their units.
    scales : from the arrays' units to those of the labels.
    caption : of the figure; {setup} stands for the set-up in words.
    true_to_scale : whether a unit is as long on both axes.
    """

    name: str
    across: str
    up: str
    labels: tuple[str, str]
    scales: tuple[float, float]
    caption: str
    true_to_scale: bool = False


def surface(across: str, label: str) -> Curve:
    """The scanned surface at rest, over an array of positions [m] that is labelled so."""
    return Curve(
        "profiles",
        across,
        "profile_height",
        (f"{label} [mm]", "surface height [mm]"),
        (1e3, 1e3),
        "Scanned surface of the {setup} at rest, every run.",
        true_to_scale=True,
    )


@dataclass(frozen=True, kw_only=True)
class Setup:
    """What is known of a set-up.

    Attributes
    ----------
    name : as the vocabulary has it.
    base : area [m2] that the grains fall on.
    particles : number of grains, not yet rounded.
    release : seconds from the release until the grains only settle; some tens of per cent will do.
    outline : walls while filled, and after the release, up to a height [m] in the first case.
    profile : the scanned surface at rest, None where none is scanned.
    mirrored : whether the profile is scanned over the radius, and pictures show it on both sides.
    history : what happens over time, None where nothing is recorded.
    cut : whether pictures leave out the grains in front of the axis, so that a crater can be seen.
    preconditions : what the geometry of a request does not meet, a sentence each.
    """

    name: str
    base: Callable[[Numbers], float]
    particles: Callable[[Numbers], float]
    release: Callable[[Numbers], float]
    outline: Callable[[Numbers, float], tuple[Outline, Outline]]
    profile: Curve | None = None
    mirrored: bool = False
    history: Curve | None = None
    cut: bool = False
    preconditions: Callable[[Numbers], list[str]] = lambda p: []

    @property
    def curves(self) -> tuple[Curve, ...]:
        """What runs leave to be drawn."""
        return tuple(curve for curve in (self.history, self.profile) if curve is not None)


def numbers(request: Request) -> Numbers:
    """The parameters of a request that are numbers."""
    return {n: float(v) for n, v in request.parameters.items() if not isinstance(v, str)}


def particles(request: Request) -> int:
    """Number of grains a request will create."""
    return max(1, round(SETUP_ENTRIES[request.setup].particles(numbers(request))))


def steps(request: Request) -> int:
    """Number of time steps of a typical run: falling and settling, then release and settling.

    Settling takes a multiple of the time in which a grain falls its own diameter. The constants
    only have to be right to some tens of per cent: finished runs correct them (see `core_seconds`).
    """
    entry, p = SETUP_ENTRIES[request.setup], numbers(request)
    settling = 40 * math.sqrt(2 * p["particle_radius"] / GRAVITY)
    cloud = particles(request) * _grain(p) / p["cloud_fraction"] / entry.base(p)
    filling = settling / 3 + math.sqrt(2 * (p["pouring_height"] + cloud) / GRAVITY)
    # a step may be so small that the quotient is infinite
    return round(min((filling + entry.release(p) + settling) / time_step(p), 1e18))


def geometry_warnings(request: Request) -> list[str]:
    """What the geometry of a request does not meet, a sentence each."""
    return SETUP_ENTRIES[request.setup].preconditions(numbers(request))


def _grain(p: Numbers) -> float:
    """Volume of a grain [m3]."""
    return 4 / 3 * math.pi * p["particle_radius"] ** 3


def _filling(base: Callable[[Numbers], float]) -> Callable[[Numbers], float]:
    """Number of grains that fill a base up to fill_height."""
    return lambda p: NOMINAL_FRACTION * base(p) * p["fill_height"] / _grain(p)


def _disc(p: Numbers) -> float:
    return math.pi * p["cylinder_diameter"] ** 2 / 4


def _box(p: Numbers) -> float:
    return p["box_length"] * p["box_width"]


def _discharge(p: Numbers) -> float:
    """Seconds in which 60 % of the mass pass the neck.

    At Beverloo's rate, 0.58 rho_b sqrt(g) (D_0 - 1.5 d)^2.5: W. A. Beverloo, H. A. Leniger, J. van
    de Velde, Chem. Eng. Sci. 15 (1961) 260.
    """
    diameter = 2 * p["particle_radius"]
    neck = max(p["neck_diameter"] - 1.5 * diameter, 0.5 * diameter)
    rate = 0.58 * 0.57 * p["particle_density"] * math.sqrt(GRAVITY) * neck**2.5
    return float(0.6 * p["fill_mass"] / rate)


def _hourglass_outline(p: Numbers, top: float) -> tuple[Outline, Outline]:
    """Walls with the plug in place, and without it."""
    wall, neck = p["cylinder_diameter"] / 2, p["neck_diameter"] / 2
    left = np.array([[-wall, top], [-wall, 0], [-neck, 0]])
    right = np.array([[wall, top], [wall, 0], [neck, 0]])
    return (left, right, np.array([[-neck, 0], [neck, 0]])), (left, right)


def _narrow_neck(p: Numbers) -> list[str]:
    ratio = p["neck_diameter"] / (2 * p["particle_radius"])
    if ratio >= 6:
        return []
    return [
        f"the neck is {ratio:.1f} grain diameters wide: grains clog often below 6; widen it or"
        " expect clogged runs"
    ]


def _ledge_outline(p: Numbers, top: float) -> tuple[Outline, Outline]:
    """Box with its flap, and without it."""
    length = p["box_length"]
    box = np.array([[0, top], [0, 0], [length, 0]])
    return (box, np.array([[length, 0], [length, top]])), (box,)


def _pile_outline(p: Numbers, top: float) -> tuple[Outline, Outline]:
    """Cylinder on the plane, then nothing."""
    wall = p["cylinder_diameter"] / 2
    return (np.array([[-wall, top], [-wall, 0], [wall, 0], [wall, top]]),), ()


HOURGLASS = Setup(
    name="hourglass",
    base=_disc,
    particles=lambda p: p["fill_mass"] / (_grain(p) * p["particle_density"]),
    release=_discharge,
    outline=_hourglass_outline,
    profile=surface("profile_radius", "distance from the axis"),
    mirrored=True,
    history=Curve(
        "mass_time",
        "time",
        "passed_mass",
        ("time since the plug was pulled [s]", "passed mass [g]"),
        (1.0, 1e3),
        "Mass that has passed the neck of the {setup}, every verification run.",
    ),
    cut=True,
    preconditions=_narrow_neck,
)
LEDGE = Setup(
    name="ledge",
    base=_box,
    particles=_filling(_box),
    release=lambda p: 3 * math.sqrt(2 * p["fill_height"] / GRAVITY),
    outline=_ledge_outline,
    profile=surface("profile_x", "distance from the back wall"),
)
CONICAL_PILE = Setup(
    name="conical_pile",
    base=_disc,
    particles=_filling(_disc),
    release=lambda p: p["lift_height"] / p["lift_speed"],
    outline=_pile_outline,
    profile=surface("profile_radius", "distance from the axis"),
    mirrored=True,
)
SETUP_ENTRIES: dict[str, Setup] = {s.name: s for s in (HOURGLASS, LEDGE, CONICAL_PILE)}
