"""One entry for each set-up: all that is known of it beside its script and the vocabulary.

What a run will cost, what the report draws of it, and what its geometry asks for. A set-up is added
by its script, its words in the contract, and an entry here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from calibrator.case.physics import GRAVITY, time_step
from calibrator.case.vocabulary import EFFECTS, effect_of, parameters_of
from calibrator.runs.request import Request

FEWEST_GRAINS = 200
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


@dataclass(frozen=True)
class Doubt:
    """What is implausible in a geometry.

    kind : of doubt, badness : by which the worst one of a kind is chosen, larger is worse; sentence
    : says it with numbers, and what to do.
    """

    kind: str
    badness: float
    sentence: str


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
    across : widths of the vessel, and how many grain diameters they should have at least.
    impossible : what the set-up's script refuses in a geometry, in the script's own words.
    doubts : of a geometry that the script takes.
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
    across: Mapping[str, float] = field(default_factory=dict)
    impossible: Callable[[Numbers], list[str]] = lambda p: []
    doubts: Callable[[Numbers], list[Doubt]] = lambda p: []

    @property
    def curves(self) -> tuple[Curve, ...]:
        """What runs leave to be drawn."""
        return tuple(curve for curve in (self.history, self.profile) if curve is not None)


def numbers(request: Request) -> Numbers:
    """The parameters of a request that are numbers, effects that are off among them."""
    values = {n: request.value(n) for n in parameters_of(request.setup)}
    return {n: float(v) for n, v in values.items() if not isinstance(v, str)}


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


def impossible(setup: str, p: Numbers) -> list[str]:
    """Why a set-up's script would refuse these parameters or fail at once, a sentence each."""
    entry, grain = SETUP_ENTRIES[setup], 2 * p["particle_radius"]
    found = entry.impossible(p)
    site = grain * (math.pi / (6 * p["cloud_fraction"])) ** (1 / 3)
    if min((p[name] for name in entry.across), default=math.inf) <= site and not found:
        found.append("no grain fits into the vessel: widen it or choose smaller grains")
    on = [name for name in EFFECTS if name in p and p[name] != EFFECTS[name].default]
    return found + [
        f"{name} and {other} cannot be combined: set one of them to its default"
        for name in on
        for other in effect_of(name).excludes
        if other in on
    ]


def doubts(setup: str, p: Numbers) -> list[Doubt]:
    """What is implausible in a geometry."""
    entry, grain = SETUP_ENTRIES[setup], 2 * p["particle_radius"]
    found = [
        Doubt(
            name,
            -p[name],
            f"{name} = {p[name]:g} m is {p[name] / grain:.1f} grain diameters, below {least:g}:"
            " so few order themselves, and single runs scatter; widen it or choose smaller grains",
        )
        for name, least in entry.across.items()
        if p[name] < least * grain * (1 - 1e-9)
    ]
    if (count := entry.particles(p)) < FEWEST_GRAINS:
        found.append(
            Doubt(
                "grains",
                -count,
                f"a run has {max(1, round(count))} grains, below {FEWEST_GRAINS}: single grains"
                " decide its responses; fill in more, or choose smaller grains",
            )
        )
    return found + entry.doubts(p)


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


def _impossible_hourglass(p: Numbers) -> list[str]:
    grain, neck = 2 * p["particle_radius"], p["neck_diameter"] + p["neck_error"]
    if neck >= p["cylinder_diameter"] - grain:
        return [
            "neck_diameter must be smaller than cylinder_diameter by more than a grain diameter"
        ]
    if neck <= grain:
        return ["neck_diameter is below a grain diameter: nothing can pass; widen the neck"]
    return []


def _doubtful_hourglass(p: Numbers) -> list[Doubt]:
    """A discharge that is given up, and a fill that is gone before it flows steadily."""
    neck, found = p["neck_diameter"], []
    if (seconds := _discharge(p)) > p["longest_time"]:
        found.append(
            Doubt(
                "discharge",
                seconds,
                f"60 % of the grains take about {seconds:.2g} s to pass the neck, longer than"
                f" longest_time = {p['longest_time']:g} s, at which a run is given up; raise it",
            )
        )
    density = NOMINAL_FRACTION * p["particle_density"]
    height = p["fill_mass"] / density / _disc(p)
    if height < neck:
        mass = 2 * neck * density * _disc(p)
        found.append(
            Doubt(
                "fill",
                neck / height,
                f"the fill is {1e3 * height:.3g} mm high, lower than the orifice of"
                f" {1e3 * neck:.3g} mm is wide: it is gone before it flows steadily; give"
                f" fill_mass = {mass:.2g} kg or more, or a smaller neck",
            )
        )
    return found


def _impossible_ledge(p: Numbers) -> list[str]:
    if p["box_width"] >= 6 * p["particle_radius"]:
        return []
    return [
        "box_width must be at least three grain diameters; widen the box or choose smaller grains"
    ]


def _doubtful_pile(p: Numbers) -> list[Doubt]:
    ratio = p["lift_height"] / (2 * p["particle_radius"])
    if ratio >= 2:
        return []
    return [
        Doubt(
            "lift",
            -ratio,
            f"the cylinder is lifted by {ratio:.1f} grain diameters: the heap cannot run out below"
            " it; raise lift_height",
        )
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
    across={"cylinder_diameter": 8},
    impossible=_impossible_hourglass,
    doubts=_doubtful_hourglass,
)
LEDGE = Setup(
    name="ledge",
    base=_box,
    particles=_filling(_box),
    release=lambda p: 3 * math.sqrt(2 * p["fill_height"] / GRAVITY),
    outline=_ledge_outline,
    profile=surface("profile_x", "distance from the back wall"),
    across={"box_length": 8, "box_width": 5},
    impossible=_impossible_ledge,
)
CONICAL_PILE = Setup(
    name="conical_pile",
    base=_disc,
    particles=_filling(_disc),
    release=lambda p: p["lift_height"] / p["lift_speed"],
    outline=_pile_outline,
    profile=surface("profile_radius", "distance from the axis"),
    mirrored=True,
    across={"cylinder_diameter": 8},
    doubts=_doubtful_pile,
)
SETUP_ENTRIES: dict[str, Setup] = {s.name: s for s in (HOURGLASS, LEDGE, CONICAL_PILE)}
