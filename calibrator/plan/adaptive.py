"""Adaptive design: which run to make next, so that few runs lead to a set that YADE confirms.

Points in, a proposal out; who carries the runs out is the caller's business. The idea is that of
Bayesian optimisation on raw responses: one process per response, and the next run where, as far as
the processes can tell, all targets are most likely met. That probability is small where the
processes are sure of a miss, and moderate where they know little, so that it explores by itself.
Runs that confirm a recommended set are runs of the design like any other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.case.problem import Problem, Target
from calibrator.errors import CalibratorError
from calibrator.plan.out_of_reach import SAMPLE, least_bad, shortfall
from calibrator.plan.proposal import Cheaper, Proposal
from calibrator.responses.box import refined, sample_of
from calibrator.responses.dear_process import FEWEST
from calibrator.responses.fit import fit_responses
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.objectives import OBJECTIVES
from calibrator.responses.success import Success
from calibrator.responses.targets import bands, log_within, met, standing_in

# Of the range: a proposal this close to a run set repeats that set, which tells the seed noise from
# the surface.
NEAR = 0.02

# Standard errors: enough after tries around the least bad set, and enough at once.
SHORT, FAR_SHORT = 2.0, 6.0
MISSED = 2.0  # standard errors of the mean of a set's own runs, beyond its band: it is left alone
# Of the runs that confirm a set: as many and no verdict, as at the very edge of a band, are enough.
MOST_ROUNDS = 4
AROUND = 0.1  # of the range: runs this close to the least bad set count as tries to do better there


@dataclass(frozen=True)
class Settings:
    """How an adaptive design goes about it.

    replicates : runs that confirm a recommended set; budget : runs in all, the failed ones counted;
    confidence : probability of passing from which a set is worth confirming; assurance :
    probability, all runs considered, that the mean of infinitely many runs would pass too, without
    which runs that pass confirm nothing; patience : runs around the least bad set before targets
    are said to be out of reach.
    """

    replicates: int = 3
    budget: int = 100
    confidence: float = 0.5
    assurance: float = 0.95
    patience: int = 4


def propose(
    problem: Problem,
    points: np.ndarray,
    values: np.ndarray,
    settings: Settings,
    similarity: bool = False,
    success: Success | None = None,
    left: int | None = None,
    cheaper: Cheaper | None = None,
) -> Proposal:
    """The next runs, given all runs so far.

    It depends on these alone, so that an interrupted design goes on from them.

    Parameters
    ----------
    points : (n, d) parameter sets of the finished runs in the order they were made, replicates
        repeated
    values : (n, t) the targets' responses, NaN where a run has none
    similarity : see `coordinates`
    success : where runs succeed, which is everywhere unless given; no set near a failed one is
        proposed, and none whose runs are likely to fail
    left : sets that may still be run once; what the budget leaves after these runs, unless given
    cheaper : runs of a cheaper version, and what they cost; more of them are proposed where they
        tell more of the likeliest set for their cost than full ones

    Raises
    ------
    CalibratorError : the runs are too poor to be interpolated, and none are left
    """
    success = success or Success(problem, ())
    left = settings.budget - len(points) if left is None else left
    if few := _too_few(problem, values, points, FEWEST if cheaper else 0):
        return _next_unlike(problem, points, success, left, few)
    keys, cheap = [t.key for t in problem.targets], cheaper.runs if cheaper else None
    interpolant = fit_responses(problem, points, values, keys, similarity=similarity, cheap=cheap)
    confirmed = _confirmed(problem, interpolant, points, values, settings)
    if confirmed is not None:
        return confirmed
    tried = _tried(problem, interpolant, points, values, settings)
    best, chance = most_likely(problem, interpolant, settings.replicates, success, tried)
    best = _existing(problem, points, best)
    if left < 1:
        words = f"the budget of {settings.budget} runs is used, and no set is confirmed"
        return Proposal("budget", _no_points(problem), best, chance, words)
    closed = bool(_closed(problem, best[None], success.failed, tried)[0])
    stuck = _unreachable(problem, interpolant, points, best, chance, settings, success, closed)
    following = stuck or _next_runs(best, chance, settings, left)
    return cheaper.instead(problem, interpolant, following) if cheaper else following


def _too_few(problem: Problem, values: np.ndarray, points: np.ndarray, fewest: int) -> str:
    """The target that was measured at too few sets for a process, in words; empty where none is.

    fewest : sets that it takes, where it is not the parameters that decide.
    """
    for target, column in zip(problem.targets, values.T, strict=True):
        sets = len(np.unique(points[np.isfinite(column)], axis=0))
        needed = fewest or len(problem.seen_by(target.experiment)) + 2
        if sets < needed:
            return f"{target.key} was measured at {sets} sets, of the {needed} that it takes"
    return ""


def _next_unlike(
    problem: Problem, points: np.ndarray, success: Success, left: int, few: str
) -> Proposal:
    """A run far from all others, where it is likely to succeed; CalibratorError if none is left."""
    if left < 1:
        said = "; ".join(part.said for part in success.parts if part.said)
        raise CalibratorError(
            f"the design used its budget, and {few}{f' ({said})' if said else ''}: raise"
            " plan.most_runs, or change what makes runs fail"
        )
    sample = success.among(sample_of(problem, 2**8, np.random.default_rng(4)))
    known = problem.shares_of(np.concatenate([points, success.failed]))
    away = np.abs(problem.shares_of(sample)[:, None] - np.nan_to_num(known, nan=0.5)).max(axis=2)
    best = sample[np.argmax(away.min(axis=1))]
    return Proposal("explore", best[None], best, 0.0, f"a run far from all others, as {few}")


def _confirmed(
    problem: Problem,
    interpolant: Interpolant,
    points: np.ndarray,
    values: np.ndarray,
    settings: Settings,
) -> Proposal | None:
    """The end of a design with a set whose latest runs meet every target, and not by luck."""
    count = settings.replicates
    for one in np.unique(points, axis=0):
        latest = values[(points == one).all(axis=1)][-count:]
        passed = len(latest) == count and is_met(problem.targets, latest, interpolant.noise)
        if passed and assurance(problem, interpolant, one, count) >= settings.assurance:
            words = f"{len(latest)} runs at the recommended set meet every target"
            return Proposal("confirmed", _no_points(problem), one, 1.0, words)
    return None


def _tried(
    problem: Problem,
    interpolant: Interpolant,
    points: np.ndarray,
    values: np.ndarray,
    settings: Settings,
) -> np.ndarray:
    """Sets (k, d) not to be run again: their own runs miss a band, or are many without a verdict.

    The processes alone do not tell: where they smooth over a set's mean, or claim little, its
    chance stays what it is however often it is run.
    """
    wanted, found = np.array([t.value for t in problem.targets]), []
    band = bands(problem.targets, interpolant.noise, settings.replicates)
    noise = standing_in(problem.targets, interpolant.noise)
    for one in np.unique(points, axis=0):
        own = values[(points == one).all(axis=1)]
        own = own[np.isfinite(own).all(axis=1)]
        if len(own) >= settings.replicates:
            beyond = np.abs(own.mean(axis=0) - wanted) - band
            missed = (beyond > MISSED * noise / math.sqrt(len(own))).any()
            if missed or len(own) >= MOST_ROUNDS * settings.replicates:
                found.append(one)
    return np.array(found).reshape(-1, len(problem.names))


def _unreachable(
    problem: Problem,
    interpolant: Interpolant,
    points: np.ndarray,
    best: np.ndarray,
    chance: float,
    settings: Settings,
    success: Success,
    closed: bool,
) -> Proposal | None:
    """The end of a design whose targets stay out of reach after enough tries around best (d,).

    So also where that is closed, as all sets are then.
    """
    around = int((_distance(problem, points, best) <= AROUND).sum())
    short = shortfall(problem, interpolant, success)
    if not (closed or short > FAR_SHORT or (short > SHORT and around >= settings.patience)):
        return None
    least, off = least_bad(problem, interpolant, settings.replicates, success)
    where = "" if success.certain else " where runs succeed"
    words = f"the targets cannot be met together{where}, by {short:.1f} standard errors: {off}"
    if closed:
        words = f"no set is left that is not near one whose runs failed or missed: {off}"
    return Proposal("unreachable", _no_points(problem), least, chance, words)


def _next_runs(best: np.ndarray, chance: float, settings: Settings, left: int) -> Proposal:
    """Runs at the likeliest set (d,): as many as confirm it where it is likely enough, or one.

    left : runs that may still be made.
    """
    if chance >= settings.confidence:
        repeated = np.repeat(best[None], min(settings.replicates, left), axis=0)
        words = f"{len(repeated)} runs at a set that passes with {chance:.0%}"
        return Proposal("confirm", repeated, best, chance, words)
    words = f"a run at the likeliest set, which passes with {chance:.0%}"
    return Proposal("explore", best[None], best, chance, words)


def _no_points(problem: Problem) -> np.ndarray:
    """Points (0, d)."""
    return np.empty((0, len(problem.names)))


def _existing(problem: Problem, points: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The set (d,) itself, or the run set that is nearly the same."""
    distance = _distance(problem, points, wanted)
    near = int(np.argmin(distance))
    return wanted if distance[near] > NEAR else points[near]


def _distance(problem: Problem, points: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Largest difference (n,) in any parameter, in units of its range on its scale.

    It is infinite where a run does not have them all.
    """
    away = np.abs(problem.shares_of(points) - problem.shares_of(wanted[None])).max(axis=1)
    return np.where(np.isnan(away), np.inf, away)


def assurance(
    problem: Problem, interpolant: Interpolant, point: np.ndarray, replicates: int
) -> float:
    """Probability that the noise-free responses at a set (d,) lie within the bands of so many runs.

    Few runs pass by luck as well, all the more so where several sets had the chance; their
    neighbours on the processes did not.
    """
    mean, error = interpolant.predict_with_error(point[None])
    band = bands(problem.targets, interpolant.noise, replicates)
    return float(np.exp(log_within(problem.targets, mean, error, band)[0]))


def is_met(targets: Sequence[Target], values: np.ndarray, noise: np.ndarray) -> bool:
    """Whether the means of the runs (n, t) at one set meet every target.

    A response that no run has counts as missed.
    """
    if np.isnan(values).all(axis=0).any():
        return False
    return bool(met(targets, np.nanmean(values, axis=0), noise, len(values)).all())


def most_likely(
    problem: Problem,
    interpolant: Interpolant,
    replicates: int,
    success: Success,
    tried: np.ndarray,
) -> tuple[np.ndarray, float]:
    """The set (d,) most likely to be confirmed, and that probability; 0 where none is left.

    Its runs have to succeed for that, and its noise-free responses to lie within the bands: runs
    may pass by luck where they do not, as often as they are tried, and confirm nothing. It is away
    from sets whose runs failed, and from those tried (k, d). Among those of the sample whose
    probability is within a tenth of the highest, the cheapest by the paper's O2.
    """
    rng = np.random.default_rng(1)
    band = bands(problem.targets, interpolant.noise, replicates)

    def loss(candidates: np.ndarray) -> np.ndarray:
        mean, error = interpolant.predict_with_error(candidates)
        found = -log_within(problem.targets, mean, error, band)
        found -= np.log(np.maximum(success.probability(candidates), 1e-300))
        # beyond any loss, and yet the nearest of these is the least where there is no other
        unlikely = 1e300 * success.shortfall(candidates)
        closed = _closed(problem, candidates, success.failed, tried)
        return np.where(closed, np.inf, found + unlikely)

    sample = sample_of(problem, SAMPLE, rng)
    best = refined(loss, sample[np.argmin(loss(sample))], problem, rng)
    sample = np.concatenate([sample, best[None]])
    losses = loss(sample)
    similar = np.flatnonzero(losses <= losses[-1] - math.log(0.9))
    cost = OBJECTIVES["time_cost"](problem, problem.columns(sample[similar]), {})
    chosen = similar[np.lexsort((losses[similar], cost))[0]]
    return sample[chosen], math.exp(-losses[chosen])


def _closed(
    problem: Problem, candidates: np.ndarray, failed: np.ndarray, tried: np.ndarray
) -> np.ndarray:
    """Which candidates (k,) lie near a set whose runs failed (f, d), or at one tried (t, d)."""
    closed = np.zeros(len(candidates), bool)
    for sets, distance in ((failed, 2 * NEAR), (tried, NEAR)):
        for one in sets:
            closed |= _distance(problem, candidates, one) <= distance
    return closed
