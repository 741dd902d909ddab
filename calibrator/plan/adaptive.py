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
from calibrator.responses.box import box_sample, refined
from calibrator.responses.fit import fit_responses
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.objectives import OBJECTIVES
from calibrator.responses.targets import bands, chances, log_within, met

SAMPLE = 2**12  # points of the box that are looked at before the best is refined

# of the range: a proposal this close to a run set repeats that set, which tells seed noise from the
# surface
NEAR = 0.02

# standard errors: enough after tries around the least bad set, and enough at once
SHORT, FAR_SHORT = 2.0, 6.0
AROUND = 0.1  # of the range: runs this close to the least bad set count as tries to do better there


@dataclass(frozen=True)
class Settings:
    """How an adaptive design goes about it.

    replicates : runs that confirm a recommended set; budget : runs in all; confidence : probability
    of passing from which a set is worth confirming; assurance : probability, all runs considered,
    that the mean of infinitely many runs would pass too, without which runs that pass confirm
    nothing; patience : runs around the least bad set before targets are said to be out of reach.
    """

    replicates: int = 3
    budget: int = 100
    confidence: float = 0.5
    assurance: float = 0.95
    patience: int = 4


@dataclass(frozen=True, eq=False)
class Proposal:
    """What to do next.

    kind : "explore" or "confirm" (run `points` (k, d)), "confirmed" (the latest runs at
    `recommended` meet every target), "unreachable" or "budget" (both stop without); recommended :
    (d,) the set to take; chance : its probability of being confirmed; sentence : all that in words.
    """

    kind: str
    points: np.ndarray
    recommended: np.ndarray
    chance: float
    sentence: str

    @property
    def stops(self) -> bool:
        """Whether no further run is asked for."""
        return self.kind in ("confirmed", "unreachable", "budget")


def propose(
    problem: Problem,
    points: np.ndarray,
    values: np.ndarray,
    settings: Settings,
    similarity: bool = False,
    failed: np.ndarray | None = None,
) -> Proposal:
    """The next runs, given all runs so far; a function of these alone, so that an interrupted
    design goes on from them.

    Parameters
    ----------
    points : (n, d) parameter sets of the finished runs in the order they were made, replicates
        repeated; values : (n, t) the targets' responses, NaN where a run has none; similarity : see
        `coordinates`.
    failed : (f, d) sets whose runs failed; no set near one is proposed.

    Raises CalibratorError where the runs are too few or too poor to be interpolated.
    """
    interpolant = fit_responses(
        problem, points, values, [t.key for t in problem.targets], similarity=similarity
    )
    none = np.empty((0, len(problem.names)))
    for best in np.unique(points, axis=0):
        latest = values[(points == best).all(axis=1)][-settings.replicates :]
        passed = len(latest) == settings.replicates and is_met(
            problem.targets, latest, interpolant.noise
        )
        if (
            passed
            and assurance(problem, interpolant, best, settings.replicates) >= settings.assurance
        ):
            return Proposal(
                "confirmed",
                none,
                best,
                1.0,
                f"{len(latest)} runs at the recommended set meet every target",
            )
    best, chance = most_likely(problem, interpolant, settings.replicates, failed)
    best = _existing(problem, points, best)
    if len(points) >= settings.budget:
        return Proposal(
            "budget", none, best, chance, f"all {settings.budget} runs of the budget are used"
        )
    around = int((_distance(problem, points, best) <= AROUND).sum())
    short = shortfall(problem, interpolant)
    if short > FAR_SHORT or (short > SHORT and around >= settings.patience):
        best, words = least_bad(problem, interpolant, settings.replicates)
        return Proposal(
            "unreachable",
            none,
            best,
            chance,
            f"the targets cannot be met together, by {short:.1f} standard errors: {words}",
        )
    if chance >= settings.confidence:
        repeated = np.repeat(best[None], settings.replicates, axis=0)
        return Proposal(
            "confirm",
            repeated,
            best,
            chance,
            f"{len(repeated)} runs at a set that passes with {chance:.0%}",
        )
    return Proposal(
        "explore",
        best[None],
        best,
        chance,
        f"a run at the likeliest set, which passes with {chance:.0%}",
    )


def _existing(problem: Problem, points: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The set (d,) itself, or the run set that is nearly the same."""
    distance = _distance(problem, points, wanted)
    near = int(np.argmin(distance))
    return wanted if distance[near] > NEAR else points[near]


def _distance(problem: Problem, points: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Largest difference (n,) in any parameter, in units of its range."""
    return np.abs((points - wanted) / (problem.high - problem.low)).max(axis=1)


def assurance(
    problem: Problem, interpolant: Interpolant, point: np.ndarray, replicates: int
) -> float:
    """Probability that the noise-free responses at a set (d,) lie within the bands of the mean of
    so many runs.

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
    problem: Problem, interpolant: Interpolant, replicates: int, failed: np.ndarray | None = None
) -> tuple[np.ndarray, float]:
    """The set (d,) most likely to be confirmed, and that probability.

    Among those of the sample whose probability is within a tenth of the highest, the cheapest by
    the paper's O2.
    """
    rng = np.random.default_rng(1)

    def loss(candidates: np.ndarray) -> np.ndarray:
        mean, error = interpolant.predict_with_error(candidates)
        found = -chances(problem.targets, mean, error, interpolant.noise, replicates)
        return np.where(_near_any(problem, candidates, failed), np.inf, found)

    sample = box_sample(problem.low, problem.high, SAMPLE, rng)
    best = refined(loss, sample[np.argmin(loss(sample))], problem, rng)
    sample = np.concatenate([sample, best[None]])
    losses = loss(sample)
    similar = np.flatnonzero(losses <= losses[-1] - math.log(0.9))
    cost = OBJECTIVES["time_cost"](problem, problem.columns(sample[similar]), {})
    chosen = similar[np.lexsort((losses[similar], cost))[0]]
    return sample[chosen], math.exp(-losses[chosen])


def _near_any(problem: Problem, candidates: np.ndarray, failed: np.ndarray | None) -> np.ndarray:
    """Which candidates (k,) lie near a set whose runs failed."""
    near = np.zeros(len(candidates), bool)
    for one in failed if failed is not None else ():
        near |= _distance(problem, candidates, one) <= 2 * NEAR
    return near


def least_bad(
    problem: Problem, interpolant: Interpolant, replicates: int
) -> tuple[np.ndarray, str]:
    """The set (d,) whose worst target, in units of its band, is missed by least; and by how much it
    is missed.
    """
    rng, values = np.random.default_rng(3), np.array([t.value for t in problem.targets])
    band = bands(problem.targets, interpolant.noise, replicates)

    def loss(candidates: np.ndarray) -> np.ndarray:
        return (np.abs(interpolant.predict(candidates) - values) / band).max(axis=1)

    sample = box_sample(problem.low, problem.high, SAMPLE, rng)
    best = refined(loss, sample[np.argmin(loss(sample))], problem, rng)
    off = interpolant.predict(best[None])[0] - values
    worst = int(np.argmax(np.abs(off) / band))
    target = problem.targets[worst]
    return (
        best,
        (f"{target.key} stays {off[worst] / target.scale:+.1%} off at the least bad set"),
    )


def shortfall(problem: Problem, interpolant: Interpolant) -> float:
    """How many standard errors of the processes the worst target stays outside its band.

    At the best set of a sample, and as if runs had no seed noise.
    """
    sample = box_sample(problem.low, problem.high, SAMPLE, np.random.default_rng(2))
    mean, error = interpolant.predict_with_error(sample)
    band = bands(problem.targets, np.zeros(mean.shape[1]), 1)
    outside = np.abs(mean - [t.value for t in problem.targets]) - band
    return float((outside / np.maximum(error, 1e-300)).max(axis=1).min())
