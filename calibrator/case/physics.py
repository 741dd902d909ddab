"""Formulas of the contact that both sides know: Rayleigh time, contact time, time step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

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

LARGEST_DAMPED_SHARE, CROWD = 0.8, 6.0
"""Of the scripts' bound for the damping of inelastic grains (yade_scripts/material.py)."""


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
        p["rayleigh_fraction"] * rayleigh, LARGEST_STEP_SHARE * contact_time(p), damped_step(p)
    )


def damped_step(p: Mapping[str, float]) -> float:
    """Longest step [s] at which the damping of contacts does not shake a bed.

    With zeta = CROWD betan, (sqrt(1 + zeta^2) - zeta) of the longest one without damping: why, and
    how it was found, is in yade_scripts/material.py.
    """
    zeta = CROWD * damping_ratio(p["restitution"])
    return LARGEST_DAMPED_SHARE * _turning_time(p, 4.0) * (math.sqrt(1 + zeta * zeta) - zeta)


def damped_steps(columns: Columns) -> np.ndarray:
    """That step [s] of each row (n,) of the columns."""
    names = ("particle_radius", "particle_density", "young_modulus", "poisson_ratio", "restitution")
    rows = np.stack(np.broadcast_arrays(*(np.ravel(columns[n]) for n in names)), axis=1)
    own, place = np.unique(rows, axis=0, return_inverse=True)
    found = [damped_step(dict(zip(names, map(float, row), strict=True))) for row in own]
    return np.array(found)[np.ravel(place)]


def floored(number: float) -> str:
    """A positive number rounded down to two digits: a limit that is told must be kept by it."""
    unit = 10.0 ** (math.floor(math.log10(number)) - 1)
    return f"{math.floor(number / unit * (1 + 1e-9)) * unit:.2g}"


@lru_cache(maxsize=4096)
def damping_ratio(restitution: float) -> float:
    """YADE's betan that gives the restitution, by bisection: yade_scripts/material.py."""
    low, high = 0.0, 50.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _restitution_of(middle) > restitution else (low, middle)
    return low


def _restitution_of(betan: float) -> float:
    """Restitution of an impact under Hertz' spring and a damping of 2 betan sqrt(m k_n)."""
    x, v, dt = 0.0, 1.0, 4.0 / 1000
    while x >= 0:
        elastic: float = x**1.5
        force = elastic + betan * math.sqrt(6) * x**0.25 * v
        v -= dt * (force if force > 0 else elastic)
        x += dt * v
    return -v


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
    default = PARAMETERS["rolling_stiffness_ratio"].default
    rolling = p.get("rolling_stiffness_ratio", default)
    return _turning_time(p, 0.5 * (4.0 + rolling))  # type: ignore[operator]


def _turning_time(p: Mapping[str, float], ratio: float) -> float:
    """Time sqrt(I/k) [s] with k = ratio k_t (r/2)^2, k_t that under five grain weights."""
    radius, poisson, young = p["particle_radius"], p["poisson_ratio"], p["young_modulus"]
    mass, overlap = 4 / 3 * math.pi * radius**3 * p["particle_density"], contact_overlap(p)
    shear = 8 * young / (2 * (1 + poisson)) / (2 * (2 - poisson)) * math.sqrt(radius / 2 * overlap)
    return math.sqrt(0.4 * mass * radius**2 / (ratio * shear * (radius / 2) ** 2))
