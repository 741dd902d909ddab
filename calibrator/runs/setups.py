"""One entry for each set-up: all that is known of it beside its script and the vocabulary.

What a run will cost, what the report draws of it, and what its geometry asks for. A set-up is added
by its script, its words in the contract, and an entry here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection

import numpy as np

from calibrator.case.physics import GRAVITY, time_step
from calibrator.case.vocabulary import EFFECTS, PARAMETERS, parameters_of
from calibrator.runs.request import Request
from calibrator.runs.setup import Curve, Doubt, Numbers, Outline, Setup, surface

FEWEST_GRAINS = 200
NOMINAL_FRACTION = 0.57
"""Packing fraction of a filling, from which the scripts get the number of grains."""


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
    filling = settling / 3 + math.sqrt(2 * (p.get("pouring_height", 0.0) + cloud) / GRAVITY)
    # a step may be so small that the quotient is infinite
    return round(min((filling + entry.release(p) + settling) / time_step(p), 1e18))


def impossible(setup: str, p: Numbers, words: Collection[str] = ()) -> list[str]:
    """Why a set-up's script would refuse these parameters or fail at once, a sentence each.

    words : parameters off their default that are no numbers.
    """
    entry, grain = SETUP_ENTRIES[setup], 2 * p["particle_radius"]
    found = entry.impossible(p)
    site = grain * (math.pi / (6 * p["cloud_fraction"])) ** (1 / 3)
    if min((p[name] for name in entry.across), default=math.inf) <= site and not found:
        found.append("no grain fits into the vessel: widen it or choose smaller grains")
    on = [name for name in EFFECTS if name in p and p[name] != EFFECTS[name].default]
    return found + [
        f"{name} and {other} cannot be combined: set one of them to its default"
        for name in on
        for other in PARAMETERS[name].excludes
        if other in (*on, *words)
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


def _drum_outline(p: Numbers, top: float) -> tuple[Outline, Outline]:
    """The shell, about its axis."""
    around = np.linspace(0, 2 * math.pi, 129)
    shell = p["drum_diameter"] / 2 * np.column_stack([np.cos(around), np.sin(around)])
    return (shell,), (shell,)


def _drum_particles(p: Numbers) -> float:
    mass = _grain(p) * p["particle_density"]
    section = math.pi * p["drum_diameter"] ** 2 / 4
    filled = NOMINAL_FRACTION * p["fill_fraction"] * section * p["drum_depth"] / _grain(p)
    return p["drum_fill_mass"] / mass if p["drum_fill_mass"] else filled


def _turning(p: Numbers) -> float:
    """Seconds until a drum that is steady at once has been measured."""
    return (p["settling_turns"] + p["measuring_turns"]) * 60 / p["rotation_rpm"]


def _impossible_drum(p: Numbers) -> list[str]:
    if p["drum_depth"] < 6 * p["particle_radius"]:
        return [
            "drum_depth must be at least three grain diameters; deepen the drum or choose smaller"
            " grains"
        ]
    if _turning(p) > p["longest_time"]:
        return ["longest_time is over before settling_turns and measuring_turns are; raise it"]
    return []


def _doubtful_drum(p: Numbers) -> list[Doubt]:
    """A drum that is full, flings its grains round, or has no time to become steady."""
    speed, found = 2 * math.pi * p["rotation_rpm"] / 60, []
    grain = 2 * p["particle_radius"]
    free = math.pi * (p["drum_diameter"] - grain) ** 2 / 4 * (p["drum_depth"] - grain)
    if free > 0 and (share := _drum_particles(p) * _grain(p) / free) > 0.6:
        words = f"the grains are {share:.0%} of the drum that their centres can reach: they may"
        found.append(Doubt("fill", share, f"{words} not fit in before they fall; fill less"))
    froude = speed**2 * p["drum_diameter"] / 2 / GRAVITY
    if froude > 0.4:
        words = f"at rotation_rpm = {p['rotation_rpm']:g} the Froude number is {froude:.2g}: grains"
        found.append(
            Doubt("speed", froude, f"{words} fly, and there is no one surface; turn slower")
        )
    if (room := p["longest_time"] / _turning(p)) < 1.5:
        found.append(
            Doubt(
                "turns",
                -room,
                f"longest_time = {p['longest_time']:g} s leaves a drum that is not steady at once"
                f" {room:.2g} times the turns that are averaged; raise it",
            )
        )
    return found


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
ROTATING_DRUM = Setup(
    name="rotating_drum",
    base=lambda p: p["drum_diameter"] * p["drum_depth"],
    particles=_drum_particles,
    release=_turning,
    outline=_drum_outline,
    profile=Curve(
        "profiles",
        "profile_x",
        "profile_height",
        ("distance from the axis [mm]", "surface height over the axis [mm]"),
        (1e3, 1e3),
        "Surface of the {setup}, as a camera sees it in the mean over whole turns, every run.",
        true_to_scale=True,
    ),
    history=Curve(
        "angle_time",
        "time",
        "angle_deg",
        ("time since the settling turns [s]", "slope of the surface [deg]"),
        (1.0, 1.0),
        "Slope of the surface in the {setup} within half the radius, every verification run.",
    ),
    last="while the drum turns",
    across={"drum_diameter": 12, "drum_depth": 5},
    impossible=_impossible_drum,
    doubts=_doubtful_drum,
)
SETUP_ENTRIES: dict[str, Setup] = {
    s.name: s for s in (HOURGLASS, LEDGE, CONICAL_PILE, ROTATING_DRUM)
}
