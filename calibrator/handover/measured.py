"""By how much engines were seen to differ at equal parameters.

From grid/rolling_stiffness.csv and grid/rolling_stiffness_engines.csv: the set-ups of
cases/missing_effect.toml at four friction pairs, five seeds each (docs/benchmarks.md, 15). They are
written down here so that an export needs no statistics; tests/handover holds them against the runs.
Each is YADE's mean minus the other engine's, over the friction pairs, with its standard
error.
"""

from __future__ import annotations

from dataclasses import dataclass

PAIRS = ((0.1, 0.3), (0.2, 0.5), (0.3, 0.5), (0.4, 0.7))
"""Rolling and sliding friction of the comparison."""


@dataclass(frozen=True)
class Gap:
    """How far YADE's mean lay above another engine's.

    Attributes
    ----------
    engine : the other one; at the same rolling spring, which LIGGGHTS has one only of.
    ratio : YADE's rolling_stiffness_ratio.
    response : setup.response; mean, error : of the gap, in the response's unit.
    by_pair : the gap at each of PAIRS.
    """

    engine: str
    ratio: float
    response: str
    mean: float
    error: float
    by_pair: tuple[float, ...]


HEAP, LEDGE = "conical_pile.pile_equivalent_angle_deg", "ledge.ledge_equivalent_angle_deg"
DRAINED = "hourglass.drained_equivalent_angle_deg"
RATE, DENSITY = "hourglass.mass_flow_rate", "hourglass.bulk_density"

GAPS = (
    Gap("LIGGGHTS", 4.0, HEAP, 0.66, 0.16, (0.35, 0.53, 0.96, 0.80)),
    Gap("LIGGGHTS", 1.0, HEAP, -0.43, 0.16, (0.02, 0.09, -0.40, -1.41)),
    Gap("LIGGGHTS", 4.0, LEDGE, 0.86, 0.31, (0.65, 0.96, 1.45, 0.36)),
    Gap("LIGGGHTS", 1.0, LEDGE, 0.25, 0.31, (0.46, 0.62, 0.65, -0.72)),
    Gap("LIGGGHTS", 4.0, DRAINED, 0.18, 0.33, (-0.43, -0.57, 0.52, 1.21)),
    Gap("LIGGGHTS", 1.0, DRAINED, 0.21, 0.33, (0.21, 0.65, 0.26, -0.28)),
    Gap("LIGGGHTS", 4.0, RATE, 0.0001, 0.0011, (-0.0018, 0.0003, -0.0016, 0.0037)),
    Gap("LIGGGHTS", 1.0, RATE, -0.0002, 0.0011, (0.0001, 0.0000, -0.0010, -0.0001)),
    Gap("LIGGGHTS", 4.0, DENSITY, -5.6, 2.1, (-1.7, -5.0, -2.4, -13.1)),
    Gap("LIGGGHTS", 1.0, DENSITY, -0.2, 2.1, (-1.6, -3.7, 4.6, -0.2)),
    Gap("LAMMPS", 4.0, HEAP, 0.11, 0.17, (0.38, 0.32, 0.12, -0.39)),
    Gap("LAMMPS", 1.0, HEAP, 0.00, 0.16, (0.09, 0.89, -0.49, -0.50)),
)

_CALLED = {
    HEAP: ("heap, equivalent angle", "degrees", 1.0, 2),
    LEDGE: ("ledge, equivalent angle", "degrees", 1.0, 2),
    DRAINED: ("drained hourglass, equivalent angle", "degrees", 1.0, 2),
    RATE: ("discharge rate", "g/s of 38 to 64", 1e3, 1),
    DENSITY: ("filled density", "kg/m3 of 1576 to 1645", 1.0, 1),
}


def sentences(engine: str, ratio: float) -> list[str]:
    """What was measured between YADE at this ratio of the rolling spring, and the other engine.

    The nearest ratio that was measured stands in where this one was not, and it is said.
    """
    there = sorted({gap.ratio for gap in GAPS if gap.engine == engine})
    nearest = min(there, key=lambda one: abs(one - ratio))
    said = [f"At rolling_stiffness_ratio = {nearest:g}, as here:"]
    if nearest != ratio:
        said = [f"Not measured at rolling_stiffness_ratio = {ratio:g}; at {nearest:g}:"]
    for gap in GAPS:
        if gap.engine == engine and gap.ratio == nearest:
            name, unit, scale, digits = _CALLED[gap.response]
            said.append(
                f"{name}: YADE {scale * gap.mean:+.{digits}f} +- {scale * gap.error:.{digits}f}"
                f" {unit} (mean of four friction pairs)"
            )
            if gap.response == HEAP:
                pairs = [
                    f"{mu_r:g}: {g:+.1f}" for (mu_r, _), g in zip(PAIRS, gap.by_pair, strict=True)
                ]
                said.append(f"  by mu_r, {', '.join(pairs)} degrees; each +- 0.3 or so")
    return said
