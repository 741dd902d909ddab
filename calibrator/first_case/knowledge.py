"""What each response says of the two frictions, from this project's own runs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from calibrator.case.lab import Observable


@dataclass(frozen=True)
class Slope:
    """d ln(response) / d ln(friction) for rolling and sliding, and the scatter of a single run.

    The scatter is a share of the value.
    """

    rolling: float
    sliding: float
    scatter: float


SLOPES = {
    "hourglass.bulk_density": Slope(-0.011, -0.038, 0.0041),
    "ledge.bulk_density": Slope(-0.008, -0.036, 0.0046),
    "conical_pile.bulk_density": Slope(-0.013, -0.041, 0.0048),
    "hourglass.residual_fraction": Slope(0.189, 0.001, 0.0399),
    "ledge.residual_fraction": Slope(0.268, 0.168, 0.0306),
    "hourglass.emptying_time": Slope(-0.008, 0.237, 0.12),
    "hourglass.mass_flow_rate": Slope(-0.243, -0.225, 0.0765),
    "hourglass.drained_angle_of_repose_deg": Slope(0.437, 0.361, 0.3402),
    "hourglass.drained_equivalent_angle_deg": Slope(0.096, 0.014, 0.0196),
    "ledge.ledge_angle_of_repose_deg": Slope(0.289, 0.241, 0.0652),
    "ledge.ledge_equivalent_angle_deg": Slope(0.211, 0.152, 0.0235),
    "conical_pile.pile_angle_of_repose_deg": Slope(0.509, 0.443, 0.0474),
    "conical_pile.pile_equivalent_angle_deg": Slope(0.416, 0.307, 0.0331),
}
"""At the frictions of TAKEN_AT, in vessels of 250 to 810 grains:
`python -m benchmarks.numerics.sensitivities`.
"""
TAKEN_AT = {"rolling_friction": 0.25, "sliding_friction": 0.45}

CHEAP = {
    "hourglass.bulk_density": ("a bulk density, filled into a cylinder of known volume", 0.005),
    "conical_pile.pile_equivalent_angle_deg": ("a heap from a lifted cylinder", 0.03),
    "ledge.ledge_equivalent_angle_deg": ("a slope in a box whose front is dropped", 0.03),
    "hourglass.drained_equivalent_angle_deg": ("the crater of a drained cylinder", 0.015),
    "hourglass.mass_flow_rate": ("the rate through a neck, with a scale below it", 0.03),
}
"""Further measurements in words, and the error that three repeats of each leave, as a share."""

FRESH_RUNS = 5
MODEL = 0.01
"""Error of an interpolated response, as a share of it."""


def factors(
    rows: Iterable[Observable],
    bounds: Mapping[str, tuple[float, float]],
    more: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """The factor, up or down, within which each friction will be known with 95 %.

    A rough forecast, linear in the frictions' logarithms about the middle of their bounds.
    Responses count as linear in a friction up to where the slopes were taken, so that a tenth of it
    moves them a tenth as much. rows : that are calibrated on; bounds : of the search, by parameter,
    which count as known before; more : further measurements and their error as a share, by
    `setup.response`. Empty where no run of ours says anything of what was measured.
    """
    names = [n for n in TAKEN_AT if n in bounds]
    rows = list(rows)
    if not any(r.key in SLOPES for r in rows):
        return {}
    widths = {n: math.log(bounds[n][1] / bounds[n][0]) for n in names}
    shares = {n: min(math.sqrt(bounds[n][0] * bounds[n][1]) / TAKEN_AT[n], 1.0) for n in names}
    errors = {r.key: r.scatter / math.sqrt(r.replicates) / abs(r.value) for r in rows if r.value}
    information = np.diag([12 / widths[n] ** 2 for n in names])
    for key, error in {**errors, **(more or {})}.items():
        if (slope := SLOPES.get(key)) is None:
            continue
        all_slopes = {"rolling_friction": slope.rolling, "sliding_friction": slope.sliding}
        own = np.array([all_slopes[n] * shares[n] for n in names])
        variance = error**2 + slope.scatter**2 / FRESH_RUNS + MODEL**2
        information += np.outer(own, own) / variance
    spread = np.sqrt(np.diag(np.linalg.inv(information)))
    widest = [widths[n] / 2 for n in names]
    return {
        n: math.exp(min(2 * float(s), most))
        for n, s, most in zip(names, spread, widest, strict=True)
    }


def most_telling(
    rows: list[Observable], bounds: Mapping[str, tuple[float, float]]
) -> tuple[str, str, float] | None:
    """The further measurement that would narrow the frictions most: key, words, and its error.

    None where none of them would narrow either by a tenth.
    """

    def area(more: Mapping[str, float]) -> float:
        return sum(math.log(f) for f in factors(rows, bounds, more).values())

    have = {r.key for r in rows}
    left = {k: area({k: error}) for k, (_, error) in CHEAP.items() if k not in have}
    if not left:
        return None
    best = min(left, key=left.__getitem__)
    return (best, *CHEAP[best]) if left[best] < 0.9 * area({}) else None
