"""What of a material an engine's file does not hold: said in the file, and on the terminal."""

from __future__ import annotations

import math

from calibrator.case.physics import GRAVITY
from calibrator.handover.chosen import Chosen
from calibrator.handover.contact import grain_mass, sizes
from calibrator.handover.names import CALLED

OF_THE_SETUP = ("neck_error", "tilt_deg", "shaking")
"""Switches that belong to a vessel and not to its grains."""

MAPPED = {
    "yade": (
        "bond_number",
        "wall_friction_ratio",
        "twisting_stiffness",
        "size_spread",
        "size_distribution",
    ),
    "liggghts": ("wall_friction_ratio",),
    "lammps": ("wall_friction_ratio",),
    "mercury": ("wall_friction_ratio",),
    "edem": ("wall_friction_ratio",),
}
"""Effects that the contact laws in a file have, where they are on."""


def unmapped(chosen: Chosen, engine: str) -> tuple[str, ...]:
    """Sentences on what is on in the calibration and is not in an engine's file; empty for none."""
    said = [_effect(chosen, name, engine) for name in chosen.effects if name not in MAPPED[engine]]
    if engine == "yade" and "size_spread" in chosen.effects:
        said.append(_grains(chosen))
    if engine == "yade" and "size_distribution" in chosen.effects:
        said.append(_given(chosen))
    if chosen.differing:
        said.append(
            f"{', '.join(chosen.differing)} differ between the set-ups of the calibration: the"
            f" values are those of {chosen.setups[0]}"
        )
    said += _rolling(chosen, engine)
    return tuple(said)


def _grains(chosen: Chosen) -> str:
    """Which radii polydisperse grains have: a file of a contact law makes no grains."""
    radii = ", ".join(f"{r:.6g}" for r in sizes(chosen.numbers))
    return (
        f"size_spread = {chosen.values['size_spread']}: make grains of these radii [m] in equal"
        f" numbers: {radii}; with the constant spring of the mean radius a cap of each pair"
        " is right in the mean only"
    )


def _given(chosen: Chosen) -> str:
    """Which sizes grains of a given distribution have."""
    return (
        f"size_distribution = {chosen.values['size_distribution']}: make grains of these diameters,"
        " scaled to a mean radius by number of particle_radius, each with its share of the number"
    )


def _effect(chosen: Chosen, name: str, engine: str) -> str:
    """A sentence on one effect that is on, and not in the file."""
    p, value = chosen.numbers, chosen.values[name]
    start = f"NOT IN THIS FILE: {name} = {value}, which the calibration has"
    if name in OF_THE_SETUP:
        return f"{name} = {value} belongs to the set-up of the calibration, not to the material"
    if name == "bond_number":
        force = p["bond_number"] * grain_mass(p) * GRAVITY
        return (
            f"{start}; it is a constant pull of {force:.4g} N between two grains in contact, twice"
            " that at a wall (Derjaguin, Muller, Toporov). Cohesion models that grow with the"
            " overlap or the contact area, as LIGGGHTS' sjkr, are another law, and LAMMPS' dmt"
            " takes the pull into its friction limit in its own way: none was compared"
        )
    if name == "bed_viscosity":
        drag = 6 * math.pi * p["bed_viscosity"] * p["particle_radius"]
        return f"{start}; it is a drag force of {drag:.4g} N s/m times the velocity on every grain"
    if name == "clump_aspect":
        return (
            f"{start}; the grains are clumps of two spheres (yade_scripts/grains.py), and frictions"
            " that were found with clumps are not those of spheres"
        )
    if name == "size_distribution":
        return f"NOT IN THIS FILE: {_given(chosen)}; the step is that of the mean size"
    if name == "size_spread":
        radii = ", ".join(f"{r:.6g}" for r in sizes(p))
        return f"{start}; make grains of these radii [m] in equal numbers: {radii}"
    return f"{start}; no counterpart was looked for in {CALLED[engine]}"


def _rolling(chosen: Chosen, engine: str) -> list[str]:
    """What is said of rolling springs that this engine has not, or not like this."""
    if chosen.values["rolling_spring"] == "epsd" and engine in ("liggghts", "edem"):
        return [
            "rolling_spring = epsd: YADE's soft spring is a constant, taken under five grain"
            " weights, and has no dashpot; this engine's follows the load. The two were not"
            " compared on heaps"
        ]
    if chosen.values["rolling_spring"] == "epsd" and engine == "mercury":
        return ["NOT IN THIS FILE: rolling_spring = epsd; MercuryDPM's spring is a stiff one"]
    ratio = chosen.numbers["rolling_stiffness_ratio"]
    if engine == "liggghts" and ratio != 1:
        return [
            f"NOT IN THIS FILE: rolling_stiffness_ratio = {ratio:g}; epsd2 has 1 and no such"
            " setting: what that does to bulk responses was measured (docs/benchmarks.md, 15)"
        ]
    return []
