"""Formulas of the contact that both sides know: Rayleigh time, contact time, time step."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from calibrator.case.vocabulary import PARAMETERS

Columns = Mapping[str, np.ndarray | float]
"""Parameters by name [SI], each a number or of one shape."""

GRAVITY = 9.81
"""[m/s2]"""

LARGEST_SHARE = 0.4
"""Of the Rayleigh time. The paper asks for 20 %; up to 40 % the restitution of impacts above 0.6 is
unbiased and the bulk responses do not move (benchmarks/runs/same_responses.py).
"""

LARGEST_STEP_SHARE = 0.28
"""The scripts' bound on the step, as a share of the contact time (yade_scripts/material.py)."""


def rayleigh_time(columns: Columns) -> np.ndarray:
    """Rayleigh time T_R [s] of the grains, the shape of the columns.

    T_R = pi r sqrt(rho_p / G) / (0.163 nu + 0.8766) with G = E / (2 (1 + nu)): the paper's Eq. (2).
    """
    poisson = columns["poisson_ratio"]
    shear_modulus = columns["young_modulus"] / (2 * (1 + poisson))
    crossing = (
        math.pi * columns["particle_radius"] * np.sqrt(columns["particle_density"] / shear_modulus)
    )
    return np.asarray(crossing / (0.163 * poisson + 0.8766))


def time_step_warning(time_step: float, columns: Columns) -> str | None:
    """One line if a time step [s] is too large for the smallest Rayleigh time, else None."""
    shortest = float(np.min(rayleigh_time(columns)))
    if time_step <= LARGEST_SHARE * shortest:
        return None
    return (
        f"time step {time_step:.3g} s is {time_step / shortest:.0%} of the Rayleigh time"
        f" {shortest:.3g} s, above {LARGEST_SHARE:.0%}: lower it to {LARGEST_SHARE * shortest:.2g}"
        " s, or choose larger, denser or softer grains"
    )


def time_step(p: Mapping[str, float]) -> float:
    """The scripts' time step [s] for grains of one size: yade_scripts/material.py."""
    rayleigh = float(rayleigh_time({n: np.array(v) for n, v in p.items()}))
    return p["time_step"] or min(
        p["rayleigh_fraction"] * rayleigh, LARGEST_STEP_SHARE * contact_time(p)
    )


def contact_overlap(p: Mapping[str, float]) -> float:
    """Overlap [m] of two grains that five grain weights press together, after Hertz."""
    radius, poisson, young = p["particle_radius"], p["poisson_ratio"], p["young_modulus"]
    mass = 4 / 3 * math.pi * radius**3 * p["particle_density"]
    stiffness = 4 / 3 * young / (2 * (1 - poisson**2)) * math.sqrt(radius / 2)
    return float((5 * mass * GRAVITY / stiffness) ** (2 / 3))


def contact_time(p: Mapping[str, float]) -> float:
    """Time sqrt(I/k) [s] of a grain on the springs of a contact under five grain weights.

    k is the mean of what the shear and the rolling spring turn it by: yade_scripts/material.py.
    """
    radius, poisson, young = p["particle_radius"], p["poisson_ratio"], p["young_modulus"]
    mass, overlap = 4 / 3 * math.pi * radius**3 * p["particle_density"], contact_overlap(p)
    shear = 8 * young / (2 * (1 + poisson)) / (2 * (2 - poisson)) * math.sqrt(radius / 2 * overlap)
    default = PARAMETERS["rolling_stiffness_ratio"].default
    ratio = 0.5 * (4.0 + p.get("rolling_stiffness_ratio", default))  # type: ignore[operator]
    return math.sqrt(0.4 * mass * radius**2 / (ratio * shear * (radius / 2) ** 2))
