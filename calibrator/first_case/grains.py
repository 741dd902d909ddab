"""Kinds of grains: what is conventional for each, and which parameters are left open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from calibrator.case.physics import GRAVITY
from calibrator.runs.setups import NOMINAL_FRACTION


@dataclass(frozen=True)
class Grains:
    """A kind of grains.

    rolling, sliding : bounds of the search; typical : of both, where one is not searched;
    restitution : normal, where it is not given; about : in words.
    """

    about: str
    rolling: tuple[float, float]
    sliding: tuple[float, float]
    typical: tuple[float, float]
    restitution: float


SHAPES = {
    "spheres": Grains("glass beads, balls, prills", (0.005, 0.15), (0.05, 0.6), (0.02, 0.25), 0.9),
    "rounded": Grains(
        "river sand, pellets, seeds, worn gravel", (0.02, 0.4), (0.2, 0.8), (0.15, 0.5), 0.8
    ),
    "angular": Grains(
        "crushed rock and ore, broken glass, sharp sand", (0.1, 0.8), (0.3, 1.0), (0.35, 0.6), 0.7
    ),
}
"""By shape. The bounds are wide: whatever the shape, a response that is reached only at one of them
is said to be so by `calibrate`. Rolling friction stands for shape (J. Ai et al., Powder Technology
206 (2011) 269), so that balls have little and broken grains much of it.
"""

SHOW_SLIDING = {"bulk_density", "mass_flow_rate", "emptying_time", "drum_upper_angle_deg"}
"""Responses that sliding friction moves by more than their runs scatter, angles of rough grains are
not among them (docs/own_measurement.md, which response shows which friction). A drum's shape is
taken to be: those who measured one fitted both frictions to it (docs/init.md).
"""
SOFTNESS = (1e-4, 3e-4, 1e-3)
"""Pressure at the bottom over Young's modulus: what is taken, and what is where that is too dear.

Grains overlap by the two thirds power of it at the bottom, after Hertz: 0.2, 0.4 and 1 %. What that
does to responses was measured (calibrator/first_case/vessels.py). The last one is the lower bound
where Young's modulus is searched.
"""
WIDTH_OF_DENSITY = 0.12
"""Share by which the effective density of grains that are no spheres may differ from the solid's:
their bulk density is that of other packings than spheres have.
"""


def stiffness(density: float, height: float, softness: float = SOFTNESS[0]) -> float:
    """Young's modulus [Pa] of grains of a density [kg/m3] in a fill of a height [m], two digits.

    >>> stiffness(2650.0, 0.05)
    7400000.0
    """
    pressure = NOMINAL_FRACTION * density * GRAVITY * height
    return float(f"{max(pressure / softness, 1e5):.1e}")


def open_parameters(
    shape: str, targets: Sequence[str], density: float, softest: float, young: float
) -> tuple[dict[str, tuple[float, float]], dict[str, float]]:
    """Bounds of the parameters to calibrate, and values of those that are fixed.

    No more are open than there are independent targets; targets : responses that are calibrated on.
    Rolling friction comes first, which every angle and rate shows; then sliding friction, where a
    rate or a density is there to show it; then an effective density, where grains that are no
    spheres have a bulk density to meet; then Young's modulus, which that density limits from below,
    from the softest usable to the one that is taken otherwise [Pa].
    """
    own = SHAPES[shape]
    frictions = {"rolling_friction": own.rolling, "sliding_friction": own.sliding}
    wanted = {"rolling_friction": own.rolling}
    if SHOW_SLIDING & set(targets):
        wanted["sliding_friction"] = own.sliding
    if "bulk_density" in targets:
        width = WIDTH_OF_DENSITY * density
        if shape != "spheres":
            wanted["particle_density"] = (round(density - width), round(density + width))
        if young > 2 * softest:
            wanted["young_modulus"] = (softest, young)
    bounds = dict(list(wanted.items())[: max(len(set(targets)), 1)])
    known = dict(zip(frictions, own.typical, strict=True))
    known |= {"particle_density": density, "young_modulus": young}
    return bounds, {n: v for n, v in known.items() if n not in bounds}
