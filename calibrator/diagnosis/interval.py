"""Intervals of what an explanation was fitted with, by profile likelihood.

Friction coefficients trade off against each other along a bent valley, and the errors of the
surfaces change along it, so that the curvature at the best fit can be far too narrow. The profile
goes along the valley: it fixes one value and fits all others (Raue et al., Bioinformatics 25 (2009)
1923-1929).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy import optimize, stats

from calibrator.diagnosis.explanations import Effect, Explanation, Measured, explain
from calibrator.diagnosis.left_out import astray
from calibrator.diagnosis.surfaces import Surfaces

RISE = float(stats.chi2.ppf(0.95, 1))  # of the deviance at the ends of a 95 % interval
FIRST_STEP, GROWTH, MOST_STEPS = 2.0, 1.6, 8  # from the best value outwards, in its errors
SHARP = 0.05  # of an error: how well an end is found


def interval(
    surfaces: Surfaces,
    measured: Measured,
    effects: Sequence[Effect],
    best: Explanation,
    kept: np.ndarray,
    index: int,
) -> tuple[float, float]:
    """Ends of the 95 % interval of a fitted value, those of its range where that comes first.

    The deviance rises by more than chi-square asks for by as much as fits to sets left out of the
    surfaces go further astray than they state. Where an effect bends between the few sizes at which
    it was run, a size can be off by more.

    measured : the observables at kept, those that best was fitted to; index : of the value among
    the parameters (as shares of their ranges) and, after them, the added amplitudes (in plausible
    sizes).
    """
    added = tuple(i for i, e in enumerate(effects) if e.name in best.effects)
    d = surfaces.dimensions
    everything = np.concatenate([best.unit, best.amplitude[list(added)]])
    at = float(everything[index])
    ends = (0.0, 1.0) if index < d else effects[added[index - d]].bounds
    width = ends[1] - ends[0]
    stated = min(max(float(best.spread[index, index]), (1e-3 * width) ** 2), width**2)
    enough = float(rises(surfaces, measured, added, best, kept)[index])
    error = float(np.sqrt(stated * enough / RISE))

    def rise(value: float) -> float:
        if value == at:  # the best fit itself, which a search from elsewhere need not find again
            return -enough
        pinned = (index, value)
        fit = explain(surfaces, measured, effects, added, kept, pinned=pinned, near=everything)
        return fit.deviance - best.deviance - enough

    return _end(rise, at, error, -1, ends[0]), _end(rise, at, error, 1, ends[1])


def rises(
    surfaces: Surfaces,
    measured: Measured,
    added: Sequence[int],
    best: Explanation,
    kept: np.ndarray,
) -> np.ndarray:
    """By how much (d + a,) the deviance rises from the best fit to the ends of a 95 % interval.

    By what chi-square says, times the variance that fits to sets left out of the surfaces have
    (left_out.py), over that which the fit states.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        more = astray(surfaces, measured, added, kept) / np.diag(best.spread)
    return np.asarray(RISE * (1 + np.where(np.isfinite(more), more, 0.0)))


def _end(rise: Callable[[float], float], at: float, error: float, sign: int, last: float) -> float:
    """Where a function that rises outwards is zero on one side of a place, or the last value."""
    inner, step = at, FIRST_STEP * error
    for _ in range(MOST_STEPS):
        outer = at + sign * step
        if (outer - last) * sign >= 0:
            outer = last
        if rise(outer) > 0:
            return float(optimize.brentq(rise, inner, outer, xtol=SHARP * error))
        if outer == last:
            return last
        inner, step = outer, step * GROWTH
    return last
