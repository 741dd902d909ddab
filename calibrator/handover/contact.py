"""What every engine needs of a contact: moduli, stiffnesses, steps.

The formulas are those of yade_scripts/material.py, which YADE's own Python runs and this one cannot
import; tests/handover compares the two. p : parameters by name [SI], as in `chosen.Chosen`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from calibrator.case.physics import GRAVITY, rayleigh_time, time_step

Numbers = Mapping[str, float]

LOAD = 5.0
"""Grain weights under which YADE's rolling spring, a constant, is taken."""

SIZE_CLASSES = 7
"""Equally frequent sizes of polydisperse grains (yade_scripts/material.py)."""

LIGGGHTS_SHARE = 0.2
"""Of the Rayleigh time: the step of the runs that LIGGGHTS was compared with YADE on."""


def grain_mass(p: Numbers) -> float:
    """Mass of a grain [kg]."""
    return 4 / 3 * math.pi * p["particle_radius"] ** 3 * p["particle_density"]


def effective_modulus(p: Numbers) -> float:
    """E* = E / (2 (1 - nu^2)) of two equal materials [Pa]."""
    return p["young_modulus"] / (2 * (1 - p["poisson_ratio"] ** 2))


def shear_modulus(p: Numbers) -> float:
    """G = E / (2 (1 + nu)) [Pa]."""
    return p["young_modulus"] / (2 * (1 + p["poisson_ratio"]))


def effective_shear_modulus(p: Numbers) -> float:
    """G* = G / (2 (2 - nu)) of two equal materials [Pa]."""
    return shear_modulus(p) / (2 * (2 - p["poisson_ratio"]))


def overlap(p: Numbers, effective_radius: float, load: float | None = None) -> float:
    """Overlap [m] at which Hertz' 4/3 E* sqrt(R_eff) delta^1.5 is a load [N].

    load : five grain weights unless one is given.
    """
    force = LOAD * grain_mass(p) * GRAVITY if load is None else load
    return float((force / (4 / 3 * effective_modulus(p) * math.sqrt(effective_radius))) ** (2 / 3))


def shear_stiffness(p: Numbers, effective_radius: float) -> float:
    """Mindlin's k_t = 8 G* sqrt(R_eff delta) [N/m] under five grain weights."""
    radius = math.sqrt(effective_radius * overlap(p, effective_radius))
    return 8 * effective_shear_modulus(p) * radius


def rolling_spring(p: Numbers, kind: str, effective_radius: float) -> float:
    """Rolling stiffness over R_eff^2 [N/m]; 0 where mu_r is 0.

    kind : "epsd2", rolling_stiffness_ratio k_t; or "epsd", 2.25 k_n mu_r^2 with k_n = 4/3 E*
    sqrt(R_eff delta); k_t and k_n are those under five grain weights.
    """
    if p["rolling_friction"] == 0:
        return 0.0
    if kind == "epsd":
        radius = math.sqrt(effective_radius * overlap(p, effective_radius))
        return 2.25 * 4 / 3 * effective_modulus(p) * radius * p["rolling_friction"] ** 2
    return p["rolling_stiffness_ratio"] * shear_stiffness(p, effective_radius)


def sizes(p: Numbers) -> tuple[float, ...]:
    """Equally frequent radii [m] of the grains: one where size_spread is 0."""
    spread = p.get("size_spread", 0.0)
    if spread == 0:
        return (p["particle_radius"],)
    steps = [i - (SIZE_CLASSES - 1) / 2 for i in range(SIZE_CLASSES)]
    deviation = math.sqrt(sum(s * s for s in steps) / SIZE_CLASSES)
    return tuple(p["particle_radius"] * (1 + spread * s / deviation) for s in steps)


def yade_step(p: Numbers) -> float:
    """The scripts' time step [s] of the smallest grains."""
    return time_step({**p, "particle_radius": min(sizes(p))})


def liggghts_step(p: Numbers) -> float:
    """A fifth of the Rayleigh time [s] of the smallest grains, or the case's own fixed step."""
    smallest = {**p, "particle_radius": min(sizes(p))}
    return p["time_step"] or LIGGGHTS_SHARE * float(rayleigh_time(smallest))
