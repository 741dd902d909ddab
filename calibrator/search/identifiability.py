"""Which parameters the targets pin down: profile likelihood over the interpolant.

Raue et al., Structural and practical identifiability analysis of partially observed dynamical
models by exploiting the profile likelihood, Bioinformatics 25 (2009) 1923-1929.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import chi2 as chi_squared

from calibrator.case.problem import Problem
from calibrator.responses.box import box_sample
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.success import Success
from calibrator.responses.targets import repeats, ruling, target_columns, target_errors
from calibrator.search.descent import Points, Residuals, descended, joined
from calibrator.search.parts import Identifiability, ParameterProfile

CHI2_68, CHI2_95 = 1.0, 3.84  # rises of chi2 that bound 68 and 95 % of one parameter
REFUSED = 0.99  # chi2 beyond this quantile: no parameter set agrees with the targets
STARTS = 20  # points of the sample from which the global minimum is sought
NEARBY = 64  # sample points around a position of which the best is a start
SWEEPS, HELPED = 5, 0.01  # of a profile from its neighbours, and the fall of chi2 worth another
WALKERS, STEPS = 256, 80  # of the map of accepted sets; every fifth step of the second half is kept

BARRIER = 1000.0
"""Standard errors per unit by which a set breaks the constraints or is likely to fail.

Such sets are not accepted however well the interpolant matches there: the measured material did
what was measured, and an interpolant knows nothing of where no run ended well. The 95 % interval
reaches 0.2 % beyond.
"""


def identify(
    problem: Problem,
    interpolant: Interpolant,
    success: Success | None = None,
    samples: int = 2**14,
    positions: int = 41,
    seed: int = 1,
    alike: np.ndarray | None = None,
) -> Identifiability:
    """Profile chi2 over each parameter of the box.

    chi2 is the sum over the targets of (prediction - target)^2 / (standard error of the target^2 +
    standard error of the interpolant^2). Targets that say the same, because they are functions of
    each other or because the same seeds move them alike, share their weight: the variance of each
    is multiplied by 1 + the sum of its squared correlations with the others, which makes k copies
    of one measurement one measurement, and never narrows an interval.

    From a Sobol sample of the box the others descend to the smallest chi2 at each position of a
    parameter, all over the range and then within the 95 % interval. Random walkers map what fits.

    Parameters
    ----------
    success : where runs succeed; everywhere, unless given
    samples : Sobol points of the box; seed : of sample and walkers
    positions : of each profile over the range, and again over the 95 % interval
    alike : (m, m) squared correlations of the responses' seed noise (see
        `interpolant.alike_seeds`), beside the repeats that the contract names

    Raises
    ------
    CalibratorError : a target's response is not interpolated, or it has neither scatter nor
        tolerance
    """
    success = success or Success(problem, ())
    residuals, assumed = _residuals(problem, interpolant, success, alike)
    rng = np.random.default_rng(seed)
    sample = _searched(residuals, len(problem.names), samples, rng)
    curves, best = _curves(residuals, sample, positions)
    refused = _refused(problem, best)
    profiles = [_parameter_profile(problem, c, best, i, refused) for i, c in enumerate(curves)]
    walked = _walked(residuals, _near_best(joined(*curves)), rng)
    return Identifiability(
        tuple(profiles),
        _scaled(problem, best.units)[0],
        float(best.chi2[0]),
        _scaled(problem, walked),
        _correlation(walked),
        assumed,
        refused,
    )


def _refused(problem: Problem, best: Points) -> bool:
    """Whether even the best point's chi2 is too large for the number of its degrees of freedom.

    A parameter at the wall of the box is not fitted. There is one degree at least, as chi2 is not
    zero where walls keep the fit from the targets.
    """
    fitted = int(((best.units[0] > 0) & (best.units[0] < 1)).sum())
    degrees = max(1, int(ruling(problem.targets).sum()) - fitted)
    return bool(best.chi2[0] > chi_squared.ppf(REFUSED, degrees))


def _correlation(sets: np.ndarray) -> np.ndarray:
    """Correlation (d, d) of the sets (k, d); 0 with a parameter that does not vary."""
    scatter = sets.std(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        found = np.cov(sets.T, bias=True).reshape(len(scatter), -1) / np.outer(scatter, scatter)
    found = np.clip(np.nan_to_num(found, posinf=0.0, neginf=0.0), -1, 1)
    np.fill_diagonal(found, 1.0)
    return found


def _scaled(problem: Problem, units: np.ndarray) -> np.ndarray:
    """Parameter sets (n, d) of points of the unit box."""
    return problem.values_at(units)


def _residuals(
    problem: Problem, interpolant: Interpolant, success: Success, alike: np.ndarray | None
) -> tuple[Residuals, tuple[str, ...]]:
    """Function from points of the unit box (n, d) to normalised residuals.

    They are those of the targets and, where not every set may be chosen, one more: (n, t) or
    (n, t + 1). Beside it stand the targets whose standard error had to be assumed.
    """
    columns = target_columns(problem, interpolant.responses)
    errors, assumed = target_errors(problem)
    values = np.array([target.value for target in problem.targets])
    same = repeats(problem.targets)
    if alike is not None:
        own = np.array([target.experiment for target in problem.targets])
        same = np.maximum(same, alike[np.ix_(columns, columns)] * (own[:, None] == own))
    crowd = np.sqrt((same * ruling(problem.targets)).sum(axis=1).clip(1))

    bounded = not success.certain or bool(problem.constraints)

    def residuals(units: np.ndarray) -> np.ndarray:
        points = _scaled(problem, units)
        mean, std = interpolant.predict_with_error(points)
        spread = np.hypot(errors, std[:, columns]) * crowd
        found = (mean[:, columns] - values) / spread
        if not bounded:
            return np.asarray(found)
        return np.column_stack([found, BARRIER * success.excess(points)])

    return residuals, assumed


def _searched(
    residuals: Residuals, dimensions: int, samples: int, rng: np.random.Generator
) -> Points:
    """A Sobol sample of the unit box, and the ends of descents from its best points."""
    units = box_sample(np.zeros(dimensions), np.ones(dimensions), samples, rng)
    sample = Points(units, (residuals(units) ** 2).sum(axis=1))
    starts = sample.units[np.argsort(sample.chi2)[:STARTS]]
    return joined(sample, descended(residuals, starts, np.zeros(starts.shape, bool)))


def _curves(residuals: Residuals, sample: Points, positions: int) -> tuple[list[Points], Points]:
    """Profile curve of each coordinate, all over the range and closely, and the best point."""
    columns = range(sample.units.shape[1])
    coarse = [_profile(residuals, sample, i, np.linspace(0, 1, positions)) for i in columns]
    sample = joined(sample, *coarse)
    grids = [_zoomed(curve, sample.best, i, positions) for i, curve in enumerate(coarse)]
    fine = [_profile(residuals, sample, i, grid) for i, grid in enumerate(grids)]
    best = joined(sample, *fine).best
    return [joined(*both, best) for both in zip(coarse, fine, strict=True)], best


def _near_best(points: Points) -> Points:
    """The points whose chi2 lies within the 95 % rise of the smallest."""
    near = points.chi2 <= points.chi2.min() + CHI2_95
    return Points(points.units[near], points.chi2[near])


def _profile(residuals: Residuals, sample: Points, column: int, grid: np.ndarray) -> Points:
    """Smallest chi2 at each position (b,) of one coordinate, the other coordinates free.

    Each position starts twice: from the best of the sample points nearby and from the best point of
    all. Then each starts from where its neighbours ended, as long as that helps: a descent that
    stopped early would stand out of the curve, and split an interval.
    """
    found = _lower_of(
        residuals,
        (_best_nearby(sample, column, grid), np.repeat(sample.best.units, len(grid), axis=0)),
        column,
        grid,
    )
    for _ in range(SWEEPS):
        left, right = (np.roll(found.units, shift, axis=0) for shift in (1, -1))
        left[0], right[-1] = found.units[0], found.units[-1]
        again = _lower_of(residuals, (left, right), column, grid)
        lower = again.chi2 < found.chi2
        helped = bool((again.chi2 < found.chi2 - HELPED).any())
        found = Points(
            np.where(lower[:, None], again.units, found.units),
            np.where(lower, again.chi2, found.chi2),
        )
        if not helped:
            break
    return found


def _lower_of(
    residuals: Residuals, starts: tuple[np.ndarray, np.ndarray], column: int, grid: np.ndarray
) -> Points:
    """The lower end of descents from two starts (b, d) at each position (b,) of a coordinate."""
    both = np.concatenate(starts)
    both[:, column] = np.tile(grid, 2)
    fixed = np.zeros(both.shape, bool)
    fixed[:, column] = True
    found = descended(residuals, both, fixed)
    rows = np.arange(len(grid)) + len(grid) * np.argmin(found.chi2.reshape(2, -1), axis=0)
    return Points(found.units[rows], found.chi2[rows])


def _best_nearby(sample: Points, column: int, grid: np.ndarray) -> np.ndarray:
    """Of the points nearest to each position (b,) the one of smallest chi2, (b, d)."""
    count = min(NEARBY, len(sample.chi2))
    distances = np.abs(sample.units[:, column] - grid[:, None])
    nearby = np.argpartition(distances, count - 1, axis=1)[:, :count]
    best = np.argmin(sample.chi2[nearby], axis=1)
    return np.asarray(sample.units[nearby[np.arange(len(grid)), best]])


def _zoomed(curve: Points, best: Points, column: int, positions: int) -> np.ndarray:
    """Positions that resolve the 95 % interval found so far.

    They reach half its width beyond it on either side.
    """
    low, high = _interval(joined(curve, best), column, CHI2_95)
    margin = (high - low) / 2
    return np.linspace(max(0.0, low - margin), min(1.0, high + margin), positions)


def _interval(curve: Points, column: int, level: float) -> tuple[float, float]:
    """Hull of the positions whose chi2 exceeds the curve's smallest by no more than level.

    Between positions sqrt(chi2 - smallest) is taken as linear, which is exact for a linear model.
    """
    order = np.argsort(curve.units[:, column])
    at, root = curve.units[order, column], np.sqrt(curve.chi2[order] - curve.chi2.min())
    accepted = np.flatnonzero(root <= math.sqrt(level))
    return _crossing(at, root, accepted[0], -1, level), _crossing(at, root, accepted[-1], 1, level)


def _crossing(at: np.ndarray, root: np.ndarray, last: int, side: int, level: float) -> float:
    """Where the root rises through that of the level, beyond the last accepted position."""
    beyond = last + side
    if not 0 <= beyond < len(at):
        return float(at[last])
    share = (math.sqrt(level) - root[last]) / (root[beyond] - root[last])
    return float(at[last] + share * (at[beyond] - at[last]))


def _parameter_profile(
    problem: Problem, curve: Points, best: Points, column: int, refused: bool
) -> ParameterProfile:
    """The profile of one parameter in its unit."""
    parameter = problem.parameters[column]
    order = np.argsort(curve.units[:, column])

    def interval(level: float) -> tuple[float, float]:
        low, high = parameter.values_at(np.array(_interval(curve, column, level)))
        return float(low), float(high)

    return ParameterProfile(
        parameter.name,
        parameter.low,
        parameter.high,
        float(parameter.values_at(best.units[0, column])),
        interval(CHI2_68),
        interval(CHI2_95),
        parameter.values_at(curve.units[order, column]),
        curve.chi2[order],
        parameter.scale,
        refused=refused,
    )


def _walked(residuals: Residuals, start: Points, rng: np.random.Generator) -> np.ndarray:
    """Points (k, d) of the unit box distributed as exp(-chi2 / 2).

    They come from differential evolution Markov chains: each half of the walkers proposes steps
    along differences within the other half, so that the steps take the shape of the ridge (ter
    Braak, Stat. Comput. 16 (2006) 239-249). start holds points of the region to be walked.
    """
    walkers = start.units[rng.integers(len(start.units), size=(2, WALKERS // 2))]
    chi2 = np.stack([(residuals(half) ** 2).sum(axis=1) for half in walkers])
    stride, jitter = 2.38 / math.sqrt(2 * walkers.shape[2]), 0.01 * start.units.std(axis=0)
    kept = []
    for step in range(STEPS):
        for half in (0, 1):
            first, second = walkers[1 - half][rng.integers(WALKERS // 2, size=(2, WALKERS // 2))]
            trial = (
                walkers[half] + stride * (first - second) + jitter * rng.normal(size=first.shape)
            )
            tried = (residuals(np.clip(trial, 0, 1)) ** 2).sum(axis=1)
            inside = ((trial >= 0) & (trial <= 1)).all(axis=1)
            bound = chi2[half] + 2 * rng.exponential(size=len(tried))  # Metropolis
            moves = inside & (tried < bound)
            walkers[half][moves], chi2[half][moves] = trial[moves], tried[moves]
        if step >= STEPS // 2 and step % 5 == 0:
            kept.append(walkers.reshape(WALKERS, -1).copy())
    return np.concatenate(kept)
