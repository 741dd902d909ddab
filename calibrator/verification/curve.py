"""A curve as a whole: the measured one beside those of the fresh runs of a candidate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.responses.curves import Components


@dataclass(frozen=True, eq=False)
class CurveComparison:
    """The curves of a candidate's fresh runs beside the measured one, on one grid of x.

    Attributes
    ----------
    key : experiment.curve; components : how many responses stand for it.
    x, measured, half_width : (q,) of the measured curve; half_width is the larger one of tolerance
        and two standard errors at a point.
    simulated : (n, q) of the runs.
    difference : root mean square over x of the runs' mean less the measured curve; None where no
        run has the curve. span : largest measured value less the smallest, and band : what the
        difference may be where all components are met; all in the curve's unit.
    verdict : what became of its components, in a word or two.
    """

    key: str
    components: int
    x: np.ndarray
    measured: np.ndarray
    half_width: np.ndarray
    simulated: np.ndarray
    difference: float | None
    span: float
    band: float
    verdict: str

    @property
    def line(self) -> str:
        """The comparison in plain words."""
        if self.difference is None:
            return f"{self.key}: no fresh run has the curve: {self.verdict}"
        share = f"{self.difference / self.span:.1%} of its range, band {self.band / self.span:.1%}"
        return (
            f"{self.key}: the curve of {len(self.simulated)} runs is {self.difference:.2g} off in"
            f" the root mean square ({share}): {self.verdict}"
        )


def compare_curve(
    found: Components, curves: Sequence[np.ndarray], bands: Mapping[str, float], verdict: str
) -> CurveComparison:
    """A measured curve beside those (2, n) of fresh runs; bands : of its components, by key."""
    curve = found.curve.curve
    assert curve is not None
    rows = np.array([found.on_grid(one) for one in curves]).reshape(-1, len(found.grid))
    off = rows.mean(axis=0) - found.value if len(rows) else None
    return CurveComparison(
        key=found.curve.key,
        components=len(found.targets),
        x=found.grid,
        measured=found.value,
        half_width=np.maximum(found.curve.tolerance * curve.span, 2 * found.error),
        simulated=rows,
        difference=None if off is None else float(np.sqrt(np.mean(off**2))),
        span=curve.span,
        band=math.hypot(*(bands[t.key] for t in found.targets)),
        verdict=verdict,
    )
