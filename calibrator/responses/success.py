"""Where runs succeed: the probability of it, learnt from all runs, the failed ones too.

Where every run clogs nothing is measured, and an interpolant through the others knows nothing of
that. So a classifier by experiment learns from how runs ended, and whoever chooses parameter sets
keeps to where a run is likely to succeed: the laboratory's material did flow.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessClassifier
from sklearn.gaussian_process.kernels import RBF, ConstantKernel

from calibrator.case.problem import Problem
from calibrator.errors import CalibratorError
from calibrator.responses.table import by_experiment, points_of
from calibrator.runs.record import Record
from calibrator.threads import on_one_thread

LIKELY = 0.5  # probability of success from which a set counts as one that can be run
HIGH = 0.65  # the same for candidates, which are to be verified
NEARLY = 0.9  # of the highest probability at a good run, where that is low
NEAREST = 4  # sets around another that a sentence counts
CHUNK = 4096  # rows predicted at once
MOST_RUNS = 500  # that the classifier sees: it takes the cube of their number
FEWEST_FAILED = 50  # of these, where there are as many

REMEDIES = {
    "clogged": "widen the neck, or lower the upper bounds of the frictions",
    "not_settled": "raise longest_time",
    "unstable": "lower rayleigh_fraction, or time_step where it is fixed",
    "input": "correct the values that the errors name",
}
"""What to do where every run of an experiment ended alike."""


@dataclass(frozen=True, eq=False)
class Outcomes:
    """How the runs of one experiment ended.

    Attributes
    ----------
    seen : columns of the parameters that vary in it, c of d.
    points, shares : (n, d) with NaN and (n, c), the runs' sets and where they lie on their scales.
    good : (n,) whether a run gave every target's response; statuses : n words.
    classifier : of good runs over shares; None where all ended alike.
    """

    experiment: str
    seen: list[int]
    points: np.ndarray
    shares: np.ndarray
    good: np.ndarray
    statuses: tuple[str, ...]
    classifier: GaussianProcessClassifier | None

    @classmethod
    def of(cls, problem: Problem, experiment: str, own: Sequence[Record]) -> Outcomes:
        """The outcomes of an experiment's own runs."""
        asked = [t.response for t in problem.targets if t.experiment == experiment]
        good = np.array(
            [r.status == "ok" and all(name in r.responses for name in asked) for r in own], bool
        )
        points = points_of(problem, [r.request for r in own])
        seen = [i for i, n in enumerate(problem.names) if n in problem.seen_by(experiment)]
        shares = problem.shares_of(points)[:, seen]
        statuses = tuple("incomplete" if r.status == "ok" else r.status for r in own)
        mixed = good.any() and not good.all()
        classifier = _classifier(shares, good) if mixed else None
        return cls(experiment, seen, points, shares, good, statuses, classifier)

    @on_one_thread
    def probability(self, shares: np.ndarray) -> np.ndarray:
        """Probability (k,) that a run succeeds at shares (k, d) of all parameters."""
        if self.classifier is None:
            return np.full(len(shares), 1.0 if self.good.all() else 0.0)
        own = shares[:, self.seen]
        parts = range(0, max(1, len(own)), CHUNK)
        found = [self.classifier.predict_proba(own[i : i + CHUNK])[:, 1] for i in parts]
        return np.concatenate(found)

    def nearest(self, shares: np.ndarray) -> str:
        """At how many of the sets nearest to shares (d,) a run failed; empty where none did."""
        sets, own = np.unique(self.shares, axis=0, return_inverse=True)
        near = np.argsort(np.linalg.norm(sets - shares[self.seen], axis=1), kind="stable")[:NEAREST]
        failed = [i for i in np.flatnonzero(~self.good) if own[i] in near]
        if not failed:
            return ""
        how, count = _how([self.statuses[i] for i in failed]), len(set(own[failed].tolist()))
        return f"{self.experiment} runs {how} at {count} of the {len(near)} nearest sets"

    @property
    def said(self) -> str:
        """How many runs failed, in words; empty where none did."""
        failed = [s for s, good in zip(self.statuses, self.good, strict=True) if not good]
        if not failed:
            return ""
        return f"{len(failed)} of {len(self.good)} {self.experiment} runs {_how(failed)}"


@dataclass(frozen=True, eq=False)
class Success:
    """Where in the box runs of all experiments with a target succeed; it has a part for each."""

    problem: Problem
    parts: tuple[Outcomes, ...]

    @classmethod
    def of(cls, problem: Problem, records: Sequence[Record]) -> Success:
        """What these runs say of the experiments that have a target."""
        return cls._of(problem, problem.experiments, records)

    @classmethod
    def of_experiment(cls, problem: Problem, name: str, records: Sequence[Record]) -> Success:
        """What these runs say of a single experiment."""
        return cls._of(problem, [name], records)

    @classmethod
    def _of(cls, problem: Problem, names: Sequence[str], records: Sequence[Record]) -> Success:
        own = by_experiment(problem, records)
        return cls(problem, tuple(Outcomes.of(problem, e, own.get(e, [])) for e in names))

    @property
    def certain(self) -> bool:
        """Whether no run has failed."""
        return all(part.good.all() for part in self.parts)

    @property
    def failed(self) -> np.ndarray:
        """Sets (f, d) of the failed runs; NaN where a parameter does not vary there."""
        none = np.empty((0, len(self.problem.names)))
        return np.concatenate([none, *(part.points[~part.good] for part in self.parts)])

    @cached_property
    def attainable(self) -> float:
        """Probability that can be asked for: nearly the highest that a good run's set has.

        It is low where failures are common everywhere.
        """
        if self.certain:
            return 1.0
        good = np.concatenate([part.points[part.good] for part in self.parts])
        # what does not vary in an experiment may be anything to it
        shares = np.nan_to_num(self.problem.shares_of(good), nan=0.5)
        return NEARLY * float(self._at_shares(shares).max(initial=0.0))

    def probability(self, points: np.ndarray) -> np.ndarray:
        """Probability (k,) that runs succeed at points (k, d), that of the least likely."""
        if self.certain:
            return np.ones(len(points))
        return self._at_shares(self.problem.shares_of(points))

    def _at_shares(self, shares: np.ndarray) -> np.ndarray:
        return np.asarray(np.min([part.probability(shares) for part in self.parts], axis=0))

    def shortfall(self, points: np.ndarray, least: float = LIKELY) -> np.ndarray:
        """By how much the probability (k,) at points (k, d) stays below what is asked for.

        That is least, or what is attainable.
        """
        if self.certain:
            return np.zeros(len(points))
        return np.maximum(0.0, min(least, self.attainable) - self.probability(points))

    def excess(self, points: np.ndarray, least: float = LIKELY) -> np.ndarray:
        """By how much (k,) points (k, d) lie outside what may be chosen; 0 inside.

        Inside, the constraints allow a set, and its runs are likely enough to succeed.
        """
        return np.asarray(self.shortfall(points, least) + self.problem.excess(points))

    def among(self, points: np.ndarray) -> np.ndarray:
        """Those of the points (k, d) that are likely enough; the likeliest where none is."""
        missing = self.shortfall(points)
        return np.asarray(points[missing <= missing.min()])

    def nearest(self, point: np.ndarray) -> list[str]:
        """How the runs nearest to a set (d,) ended, in words, where any failed."""
        shares = self.problem.shares_of(point[None])[0]
        return [words for part in self.parts if (words := part.nearest(shares))]

    @property
    def sentences(self) -> list[str]:
        """How many runs failed, in words, and what follows from it."""
        least = f"{min(HIGH, self.attainable):.0%}"
        return [
            f"{part.said}: candidates keep to where a run succeeds with {least} or more"
            for part in self.parts
            if part.said
        ]


def require_good(problem: Problem, records: Sequence[Record]) -> None:
    """Raise CalibratorError, in one sentence, where all runs of an experiment failed."""
    if words := nothing_good(problem, records):
        raise CalibratorError(words)


def nothing_good(problem: Problem, records: Sequence[Record]) -> str:
    """How an experiment's runs ended where all failed, and what to do; "" where none is such."""
    runs_of = by_experiment(problem, records)
    for experiment in problem.experiments:
        own = runs_of.get(experiment, [])
        if own and all(r.status != "ok" for r in own):
            kinds = Counter(r.status for r in own)
            (kind, _), *others = kinds.most_common()
            remedy = REMEDIES.get(kind, "look at the failures that the verb collect lists")
            runs = (
                f"all {len(own)} {experiment} runs"
                if len(own) > 1
                else f"the only {experiment} run"
            )
            return f"{runs} {_how([r.status for r in own])}: {'first ' if others else ''}{remedy}"
    return ""


def _how(statuses: Sequence[str]) -> str:
    """How failed runs ended, as a verb."""
    verbs = {"clogged": "clogged", "not_settled": "did not settle", "unstable": "were unstable"}
    kinds = set(statuses)
    return verbs.get(kinds.pop(), "failed") if len(kinds) == 1 else "clogged or failed"


@on_one_thread
def _classifier(shares: np.ndarray, good: np.ndarray) -> GaussianProcessClassifier:
    """Gaussian process classifier of good runs (n,) over shares (n, c).

    Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, section 3.4 (Laplace's
    approximation); one length scale per parameter, so that a friction beyond which all runs clog is
    told from parameters that do not matter, and a constant for failures that come by chance.
    """
    rows = _some(good)
    smooth = ConstantKernel(4.0, (0.1, 100.0)) * RBF(np.ones(shares.shape[1]), (0.1, 20.0))
    kernel = smooth + ConstantKernel(4.0, "fixed")
    model = GaussianProcessClassifier(kernel, n_restarts_optimizer=2, random_state=1)
    with warnings.catch_warnings():
        # a parameter without influence rightly drives its length scale to the bound
        warnings.simplefilter("ignore", ConvergenceWarning)
        return model.fit(shares[rows], good[rows])


def _some(good: np.ndarray) -> np.ndarray:
    """Rows for the classifier: all, or MOST_RUNS in about the same proportion."""
    if len(good) <= MOST_RUNS:
        return np.arange(len(good))
    rng, failed = np.random.default_rng(1), np.flatnonzero(~good)
    bad = max(min(len(failed), FEWEST_FAILED), MOST_RUNS * len(failed) // len(good))
    succeeded = np.flatnonzero(good)
    kept = (
        rng.choice(failed, bad, replace=False),
        rng.choice(succeeded, min(len(succeeded), MOST_RUNS - bad), replace=False),
    )
    return np.sort(np.concatenate(kept))
