"""What a run will cost: particles x steps over a measured rate."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from calibrator.objectives import rayleigh_time
from calibrator.quantities import PARAMETERS
from calibrator.records import Record
from calibrator.table import Request

PARTICLE_STEPS_PER_SECOND = 1.9e6
"""Particle-steps a second and core: grains at the start times steps, measured by benchmarks/rate.py on 1,400 grains."""

LARGEST_STEP_SHARE = 0.28
"""The scripts' bound on the step, as a share of the contact time (yade_scripts/material.py)."""

GRAVITY = 9.81
NOMINAL_FRACTION = 0.57


def particles(request: Request) -> int:
    """Number of grains a request will create."""
    p = _numbers(request)
    grain = 4 / 3 * math.pi * p["particle_radius"] ** 3
    if request.setup == "hourglass":
        return max(1, round(p["fill_mass"] / (grain * p["particle_density"])))
    base = p["box_length"] * p["box_width"] if request.setup == "ledge" else math.pi * p["cylinder_diameter"] ** 2 / 4
    return max(1, round(NOMINAL_FRACTION * base * p["fill_height"] / grain))


def steps(request: Request) -> int:
    """Number of time steps of a typical run: falling and settling, then release and settling.

    The discharge lasts as long as Beverloo's rate, 0.58 rho_b sqrt(g) (D_0 - 1.5 d)^2.5, needs for 60 % of the
    mass; settling takes a multiple of the time in which a grain falls its own diameter. The constants only have
    to be right to some tens of per cent: finished runs correct them (see `core_seconds`).
    """
    p = _numbers(request)
    diameter = 2 * p["particle_radius"]
    dt = time_step(p)
    settling = 40 * math.sqrt(diameter / GRAVITY)
    filling = settling / 3 + math.sqrt(2 * (p["pouring_height"] + _cloud_height(request, p)) / GRAVITY)
    if request.setup == "hourglass":
        neck = max(p["neck_diameter"] - 1.5 * diameter, 0.5 * diameter)
        release = 0.6 * p["fill_mass"] / (0.58 * 0.57 * p["particle_density"] * math.sqrt(GRAVITY) * neck**2.5)
    elif request.setup == "ledge":
        release = 3 * math.sqrt(2 * p["fill_height"] / GRAVITY)
    else:
        release = p["lift_height"] / p["lift_speed"]
    return round(min((filling + release + settling) / dt, 1e18))  # a step may be so small that the quotient is infinite


def time_step(p: Mapping[str, float]) -> float:
    """The scripts' time step [s] for grains of one size: yade_scripts/material.py."""
    rayleigh = float(rayleigh_time({n: np.array(v) for n, v in p.items()}))
    return p["time_step"] or min(p["rayleigh_fraction"] * rayleigh, LARGEST_STEP_SHARE * contact_time(p))


def contact_time(p: Mapping[str, float]) -> float:
    """Time sqrt(I/k) [s] of a grain on the springs of a contact under five grain weights.

    k is the mean of what the shear and the rolling spring turn it by: yade_scripts/material.py.
    """
    radius, poisson, young = p["particle_radius"], p["poisson_ratio"], p["young_modulus"]
    mass = 4 / 3 * math.pi * radius**3 * p["particle_density"]
    overlap = (5 * mass * GRAVITY / (4 / 3 * young / (2 * (1 - poisson**2)) * math.sqrt(radius / 2))) ** (2 / 3)
    shear = 8 * young / (2 * (1 + poisson)) / (2 * (2 - poisson)) * math.sqrt(radius / 2 * overlap)
    default = PARAMETERS["rolling_stiffness_ratio"].default
    ratio = 0.5 * (4.0 + p.get("rolling_stiffness_ratio", default))  # type: ignore[operator]
    return math.sqrt(0.4 * mass * radius**2 / (ratio * shear * (radius / 2) ** 2))


def core_seconds(requests: Sequence[Request], finished: Iterable[Record] = ()) -> np.ndarray:
    """Predicted core-seconds (n,) of each request, corrected per set-up by the median of what finished runs took."""
    ratios: dict[str, list[float]] = {}
    for record in finished:
        spent = sum(record.diagnostics.get(k, 0.0) for k in ("filling_cpu", "release_cpu"))
        if record.status == "ok" and spent > 0:
            ratios.setdefault(record.request.setup, []).append(spent / _predicted(record.request))
    correction = {setup: float(np.median(values)) for setup, values in ratios.items()}
    return np.array([_predicted(r) * correction.get(r.setup, 1.0) for r in requests])


def _predicted(request: Request) -> float:
    start_up = 2.0
    return start_up + particles(request) * steps(request) / PARTICLE_STEPS_PER_SECOND


def _numbers(request: Request) -> dict[str, float]:
    return {n: float(v) for n, v in request.parameters.items() if not isinstance(v, str)}


def _cloud_height(request: Request, p: dict[str, float]) -> float:
    grains = particles(request) * 4 / 3 * math.pi * p["particle_radius"] ** 3
    base = p["box_length"] * p["box_width"] if request.setup == "ledge" else math.pi * p["cylinder_diameter"] ** 2 / 4
    return grains / p["cloud_fraction"] / base
