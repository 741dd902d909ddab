"""Whether YADE gave what was promised, and whether either agrees with the measurement."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import t as student

from calibrator.case.problem import Target
from calibrator.responses.targets import bands
from calibrator.runs.record import Record
from calibrator.search.parts import Promise
from calibrator.verification.outcome import Comparison


def compare(
    targets: Sequence[Target],
    runs: Mapping[str, Sequence[Record]],
    promised: Mapping[str, Promise] | None = None,
    noise: Mapping[str, float | None] | None = None,
) -> tuple[Comparison, ...]:
    """Compare fresh runs with the targets, one comparison per target.

    runs : by experiment; promised : what the interpolant said, by key; noise : standard deviation
    of one run in the response's unit, by key, None or absent where the database knows none.
    """
    return tuple(
        _compared(
            target,
            runs.get(target.experiment, ()),
            (promised or {}).get(target.key),
            (noise or {}).get(target.key),
        )
        for target in targets
    )


def _compared(
    target: Target, own: Sequence[Record], promise: Promise | None, noise: float | None
) -> Comparison:
    """One target against the fresh runs of its own experiment.

    The band does not grow with the scatter of the runs that it judges (see `targets.bands`); their
    mean counts as met only if its own standard error is no wider than the band.
    """
    values = [
        r.responses[target.response]
        for r in own
        if r.status == "ok" and target.response in r.responses
    ]
    mean = float(np.mean(values)) if values else None
    scatter = float(np.std(values, ddof=1)) if len(values) > 1 else None
    error = _error_of_mean(len(values), scatter, noise)
    judged = (dataclasses.replace(target, weight=1.0),)  # of weight 0 it has no band
    one_run = np.array([math.nan if noise is None else noise])
    band = float(bands(judged, one_run, max(len(values), 1))[0])
    off = math.inf if mean is None else abs(mean - target.value)
    sure = error is not None and error <= band
    inside = off <= band and sure
    unclear = not inside and off <= max(band, 2 * math.hypot(target.standard_error, error or 0.0))
    return Comparison(
        key=target.key,
        target=target.value,
        target_error=target.standard_error,
        scale=target.scale,
        predicted=promise.mean if promise else None,
        predicted_error=promise.error if promise else None,
        simulated=mean,
        scatter=scatter,
        standard_error=error,
        runs=len(values),
        attempted=len(own),
        relative_error=None if mean is None else (mean - target.value) / target.scale,
        band=band,
        passed=inside,
        undecided=mean is not None and unclear,
        reported_only=target.weight == 0,
        promise_kept=_kept(promise, mean, error),
    )


def _error_of_mean(runs: int, scatter: float | None, noise: float | None) -> float | None:
    """Standard error of the mean of so many runs, None where nothing says how much one scatters.

    It is that of the database's noise or of the runs' own scatter, whichever is larger. Where there
    is no noise the scatter of few runs is small by chance too often: it is widened so that two
    standard errors hold the mean in 95 % of cases (Student's t).
    """
    if not runs or (scatter is None and noise is None):
        return None
    if noise is None and scatter is not None:
        return scatter / math.sqrt(runs) * float(student.ppf(0.975, runs - 1)) / 1.96
    return max(scatter or 0.0, noise or 0.0) / math.sqrt(runs)


def _kept(promise: Promise | None, mean: float | None, error: float | None) -> bool | None:
    """Whether simulation and promise agree within two combined standard errors.

    None unless both are there.
    """
    if promise is None or mean is None or error is None:
        return None
    return abs(mean - promise.mean) <= 2 * math.hypot(promise.error, error)


def error_o1(targets: Sequence[Target], comparisons: Sequence[Comparison]) -> float | None:
    """O1 at the mean of the fresh runs (Eqs. 3 and 4); None where a target was not measured."""
    ruling = [(t, c) for t, c in zip(targets, comparisons, strict=True) if t.weight > 0]
    errors = [abs(c.relative_error) for _, c in ruling if c.relative_error is not None]
    if len(errors) < len(ruling):
        return None
    return sum(t.weight * e for (t, _), e in zip(ruling, errors, strict=True))
