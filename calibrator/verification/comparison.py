"""Did YADE give what the interpolant promised, and does either agree with the measurement?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.case.problem import Target
from calibrator.runs.record import Record


@dataclass(frozen=True)
class Check:
    """One response at one candidate: target, promise and fresh runs, all in the response's unit.

    predicted and predicted_error are the interpolant's mean and its standard error (None for a
    response that was not interpolated); simulated, scatter and runs are mean, standard deviation
    and number of the fresh runs; noise is the standard deviation of one run that the band uses: the
    database's where there is one, else the larger of `scatter` and the measurement's own.
    """

    target: Target
    predicted: float | None
    predicted_error: float | None
    simulated: float
    scatter: float
    noise: float
    runs: int

    @property
    def band(self) -> float:
        """How far from the target still counts as met: the tolerance or twice the seed noise,
        whichever is larger.
        """
        return max(self.target.tolerance * abs(self.target.value), 2 * self.noise)

    @property
    def relative_error(self) -> float:
        """(simulated - target)/target."""
        return (self.simulated - self.target.value) / abs(self.target.value)

    @property
    def passed(self) -> bool:
        """True if the mean of the fresh runs lies within the band around the target."""
        return abs(self.simulated - self.target.value) <= self.band

    @property
    def standard_error(self) -> float:
        """Standard error of the mean of the fresh runs."""
        return self.noise / math.sqrt(self.runs)

    @property
    def promise_kept(self) -> bool | None:
        """True if simulation and prediction agree within two combined standard errors;

        None without a prediction.
        """
        if self.predicted is None or self.predicted_error is None:
            return None
        return abs(self.simulated - self.predicted) <= 2 * math.hypot(
            self.predicted_error, self.standard_error
        )


def check(
    targets: Sequence[Target],
    records: Sequence[Record],
    predicted: dict[str, tuple[float, float]] | None = None,
    noise: dict[str, float] | None = None,
) -> list[Check]:
    """Compare the good runs among the records with the targets.

    predicted : {key: (mean, standard error)} of the interpolant; noise : {key: standard deviation
    of one run}. Targets without a single good run are left out; the caller tells the user how many
    runs failed and why.
    """
    checks = []
    for target in targets:
        values = [
            r.responses[target.response]
            for r in records
            if r.status == "ok"
            and r.request.setup == target.setup
            and target.response in r.responses
        ]
        if not values:
            continue
        scatter = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
        mean, error = (predicted or {}).get(target.key, (None, None))
        # Where the database knows nothing, the larger of two scatters: that of a few runs alone can
        # be small by chance.
        one_run = (noise or {}).get(target.key, max(scatter, target.scatter))
        checks.append(
            Check(target, mean, error, float(np.mean(values)), scatter, one_run, len(values))
        )
    return checks


def error_o1(checks: Sequence[Check]) -> float:
    """O1 of Eq. (3)-(4) at the mean of the fresh runs."""
    return sum(c.target.weight * abs(c.relative_error) for c in checks)
