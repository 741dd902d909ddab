"""What is known of each set-up beside its script: how many grains and steps it takes, and its
outline.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from calibrator.case.physics import GRAVITY, time_step
from calibrator.runs.request import Request

NOMINAL_FRACTION = 0.57


def particles(request: Request) -> int:
    """Number of grains a request will create."""
    p = numbers(request)
    grain = 4 / 3 * math.pi * p["particle_radius"] ** 3
    if request.setup == "hourglass":
        return max(1, round(p["fill_mass"] / (grain * p["particle_density"])))
    base = (
        p["box_length"] * p["box_width"]
        if request.setup == "ledge"
        else math.pi * p["cylinder_diameter"] ** 2 / 4
    )
    return max(1, round(NOMINAL_FRACTION * base * p["fill_height"] / grain))


def steps(request: Request) -> int:
    """Number of time steps of a typical run: falling and settling, then release and settling.

    The discharge lasts as long as Beverloo's rate, 0.58 rho_b sqrt(g) (D_0 - 1.5 d)^2.5, needs for
    60 % of the mass; settling takes a multiple of the time in which a grain falls its own diameter.
    The constants only have to be right to some tens of per cent: finished runs correct them (see
    `core_seconds`).
    """
    p = numbers(request)
    diameter = 2 * p["particle_radius"]
    dt = time_step(p)
    settling = 40 * math.sqrt(diameter / GRAVITY)
    filling = settling / 3 + math.sqrt(
        2 * (p["pouring_height"] + _cloud_height(request, p)) / GRAVITY
    )
    if request.setup == "hourglass":
        neck = max(p["neck_diameter"] - 1.5 * diameter, 0.5 * diameter)
        release = (
            0.6
            * p["fill_mass"]
            / (0.58 * 0.57 * p["particle_density"] * math.sqrt(GRAVITY) * neck**2.5)
        )
    elif request.setup == "ledge":
        release = 3 * math.sqrt(2 * p["fill_height"] / GRAVITY)
    else:
        release = p["lift_height"] / p["lift_speed"]
    # a step may be so small that the quotient is infinite
    return round(min((filling + release + settling) / dt, 1e18))


def numbers(request: Request) -> dict[str, float]:
    return {n: float(v) for n, v in request.parameters.items() if not isinstance(v, str)}


def _cloud_height(request: Request, p: dict[str, float]) -> float:
    grains = particles(request) * 4 / 3 * math.pi * p["particle_radius"] ** 3
    base = (
        p["box_length"] * p["box_width"]
        if request.setup == "ledge"
        else math.pi * p["cylinder_diameter"] ** 2 / 4
    )
    return grains / p["cloud_fraction"] / base


Outline = tuple[np.ndarray, ...]


def hourglass_outline(p: Mapping[str, float], top: float) -> tuple[Outline, Outline]:
    """Walls with the plug in place, and without it."""
    wall, neck = p["cylinder_diameter"] / 2, p["neck_diameter"] / 2
    left, right = (
        np.array([[-wall, top], [-wall, 0], [-neck, 0]]),
        np.array([[wall, top], [wall, 0], [neck, 0]]),
    )
    return (left, right, np.array([[-neck, 0], [neck, 0]])), (left, right)


def ledge_outline(p: Mapping[str, float], top: float) -> tuple[Outline, Outline]:
    """Box with its flap, and without it."""
    length = p["box_length"]
    box = np.array([[0, top], [0, 0], [length, 0]])
    return (box, np.array([[length, 0], [length, top]])), (box,)


def pile_outline(p: Mapping[str, float], top: float) -> tuple[Outline, Outline]:
    """Cylinder on the plane, then nothing."""
    wall = p["cylinder_diameter"] / 2
    return (np.array([[-wall, top], [-wall, 0], [wall, 0], [wall, top]]),), ()
