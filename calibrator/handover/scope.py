"""What a material is good for, and what it was not calibrated for, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

from calibrator.case.vocabulary import EFFECTS, effect_of
from calibrator.handover.card import Compared
from calibrator.handover.chosen import Chosen
from calibrator.handover.contact import sizes
from calibrator.search.outcome import Calibration

STIFF = 1e9
"""[Pa]: mineral grains are stiffer; a smaller modulus was chosen for the time step."""


def valid_for(chosen: Chosen, compared: Sequence[Compared]) -> tuple[str, ...]:
    """What fresh runs have shown, and what follows from it."""
    radii = sizes(chosen.numbers)
    grains = f"radius {radii[0]:.4g} m"
    if len(radii) > 1:
        grains = f"radii from {radii[0]:.4g} to {radii[-1]:.4g} m"
    shape = "clumps of two spheres" if "clump_aspect" in chosen.effects else "spheres"
    said = [f"{shape} of {grains} under gravity, in vessels like those below"]
    for role, words in (("calibrate", "calibrated on and met"), ("held_out", "predicted and met")):
        met = [c.key for c in compared if c.role == role and c.verdict == "met"]
        if met:
            said.append(f"{words} by fresh YADE runs: {', '.join(met)}")
    said.append(
        "another density or size of grains, where Young's modulus keeps E/(rho_p g d) and all"
        " lengths keep their ratio to the grains: such grains move alike"
    )
    return tuple(said)


def not_calibrated_for(
    chosen: Chosen, calibration: Calibration, compared: Sequence[Compared]
) -> tuple[str, ...]:
    """What no target says anything of, or says that it is not so."""
    said = [
        f"{c.key}: {c.verdict.lower()}"
        for c in compared
        if c.verdict not in ("met", "reported only (weight 0)")
    ]
    loose = [p.name for p in calibration.identifiability.parameters if not p.pinned]
    if loose:
        said.append(
            f"what depends on {' or '.join(loose)} alone: the targets do not pin"
            f" {'it' if len(loose) == 1 else 'them'} down; see the family"
        )
    fixed = ("poisson_ratio", "restitution", "young_modulus", "particle_radius")
    given = [name for name in fixed if name not in chosen.calibrated]
    if given:
        said.append(f"{', '.join(given)}: given by the case, not measured by these tests")
    if chosen.numbers["young_modulus"] < STIFF:
        said.append(
            "contact stresses, stiffness of a bed, sound: Young's modulus is that of soft model"
            " grains, chosen for the time step"
        )
    if "wall_friction_ratio" not in chosen.effects:
        said.append(
            "walls of another material: their friction and rolling resistance are the grains'"
        )
    off = [effect_of(n).called for n in EFFECTS if n not in chosen.effects and n != "neck_error"]
    said.append(f"effects that were off: {', '.join(off)}")
    said.append(
        "other engines at the same numbers: names mean other things there, and heaps differ even"
        " where they are mapped (the verb export writes both)"
    )
    return tuple(said)
