"""The errors that a laboratory has, which its verdict is not told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from calibrator.case.lab import Nuisance
from calibrator.diagnosis.explanations import KNOWN_WITHIN

DAYS = 3  # on which the replicates of an experiment are made
FIRST_SEED = 50_000


@dataclass(frozen=True)
class Errors:
    """What is wrong beside the scatter of runs.

    Attributes
    ----------
    day : error of each day of an experiment, in scatters of one replicate, as correlated as these.
    days : on which the replicates are made, in turn, and which the laboratory states.
    times : shared errors over those of the nuisance table, by name; 1 for those not here.
    """

    day: float = 0.0
    days: int = 1
    times: Mapping[str, float] = field(default_factory=dict)

    def drawn(self, nuisances: Sequence[Nuisance], rng: np.random.Generator) -> dict[str, float]:
        """One draw of every shared error, in standard deviations of the table."""
        return {n.name: self.times.get(n.name, 1.0) * rng.standard_normal() for n in nuisances}

    def of_days(
        self, values: np.ndarray, noise: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """Runs (r, n) with the errors of their days; noise (n, n) : covariance of one run."""
        if not self.day:
            return values
        own = self.day * rng.multivariate_normal(np.zeros(len(noise)), noise, self.days)
        return np.asarray(values + own[np.arange(len(values)) % self.days])


def errors_of(nuisances: Sequence[Nuisance], index: int) -> Errors:
    """The errors of the laboratory of this index: days of one scatter, and a table that is off."""
    rng = np.random.default_rng(FIRST_SEED + index)
    ends = np.log(KNOWN_WITHIN)
    times = {n.name: float(np.exp(rng.uniform(-ends, ends))) for n in nuisances}
    return Errors(1.0, DAYS, times)
