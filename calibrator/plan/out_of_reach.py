"""How far targets stay out of reach in an adaptive design, and at which set they do so least."""

from __future__ import annotations

import numpy as np

from calibrator.case.problem import Problem
from calibrator.responses.box import refined, sample_of
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.success import Success
from calibrator.responses.targets import bands

SAMPLE = 2**12  # points of the box that are looked at before the best is refined


def least_bad(
    problem: Problem, interpolant: Interpolant, replicates: int, success: Success
) -> tuple[np.ndarray, str]:
    """The set (d,) whose worst target is missed by least, and by how much, in words.

    It is one that is likely to run. A target's unit is its band.
    """
    rng, values = np.random.default_rng(3), np.array([t.value for t in problem.targets])
    band = bands(problem.targets, interpolant.noise, replicates)

    def loss(candidates: np.ndarray) -> np.ndarray:
        off = (np.abs(interpolant.predict(candidates) - values) / band).max(axis=1)
        return np.where(success.shortfall(candidates) > 0, np.inf, off)

    sample = success.among(sample_of(problem, SAMPLE, rng))
    best = refined(loss, sample[np.argmin(loss(sample))], problem, rng)
    off = interpolant.predict(best[None])[0] - values
    worst = int(np.argmax(np.abs(off) / band))
    target = problem.targets[worst]
    return best, f"{target.key} stays {off[worst] / target.scale:+.1%} off at the least bad set"


def shortfall(problem: Problem, interpolant: Interpolant, success: Success) -> float:
    """How many standard errors of the processes the worst target stays outside its band.

    At the best set of a sample that is likely to run, and as if runs had no seed noise.
    """
    sample = success.among(sample_of(problem, SAMPLE, np.random.default_rng(2)))
    mean, error = interpolant.predict_with_error(sample)
    band = bands(problem.targets, np.zeros(mean.shape[1]), 1)
    outside = np.abs(mean - [t.value for t in problem.targets]) - band
    return float((outside / np.maximum(error, 1e-300)).max(axis=1).min())
