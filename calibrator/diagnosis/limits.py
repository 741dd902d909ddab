"""Whether the model meets the measurements inside the bounds of its parameters.

What recalibration could absorb is projected out of a residual before it is tested for a gap,
however far the parameters would have to go. So a residual without a gap is good news only where the
fit within the bounds is adequate as well; and where parameters stand at their bounds, a gap may be
no missing effect but a box that is too small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.diagnosis.explanations import Effect, Explanation, Measured, explain
from calibrator.diagnosis.surfaces import Surfaces

NEAR = 0.02  # share of a range from its end that counts as the end


@dataclass(frozen=True)
class Bound:
    """A parameter, by its place among them, whose best value is at one end of its range."""

    parameter: int
    upper: bool


def at_bounds(one: Explanation) -> tuple[Bound, ...]:
    """Parameters that a fit leaves at, or hardly inside, a bound."""
    low, high = one.unit <= NEAR, one.unit >= 1 - NEAR
    return tuple(Bound(int(i), bool(high[i])) for i in np.flatnonzero(low | high))


@dataclass(frozen=True, eq=False)
class Fits:
    """The model without effects, inside the box and where parameters may leave it.

    Attributes
    ----------
    p : probability of as large a chi2 within the bounds if the model is complete.
    bounds : parameters at a bound there.
    wider, p_wider : the fit with the wider bounds, and its probability; None and nan where no
        parameter is at a bound.
    """

    p: float
    bounds: tuple[Bound, ...]
    wider: Explanation | None
    p_wider: float


def fits(
    surfaces: Surfaces,
    measured: Measured,
    effects: Sequence[Effect],
    none: Explanation,
    kept: np.ndarray,
) -> Fits:
    """Judge the fit of the model as it is, none, with and without its bounds.

    kept : indices of the surfaces' observables that were measured. Outside the box the surfaces
    extrapolate, and their errors, which grow there, are counted.
    """
    p, bounds = none.adequacy(surfaces.degrees), at_bounds(none)
    if not bounds:
        return Fits(p, (), None, float("nan"))
    wider = explain(surfaces, measured, effects, kept=kept, box=surfaces.wider)
    return Fits(p, bounds, wider, wider.adequacy(surfaces.degrees))
