"""Whether YADE gave what was promised, and whether either agrees with the measurement."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from calibrator.case.problem import Target
from calibrator.responses.targets import bands, met
from calibrator.runs.record import Record
from calibrator.search.parts import Promise
from calibrator.verification.outcome import Comparison


def compare(
    targets: Sequence[Target],
    records: Sequence[Record],
    promised: Mapping[str, Promise] | None = None,
    noise: Mapping[str, float] | None = None,
) -> tuple[Comparison, ...]:
    """Compare fresh runs with the targets, one comparison per target.

    promised : what the interpolant said, by key; noise : standard deviation of one run in the
    response's unit, by key. Where the database knows no noise it is the larger of the fresh runs'
    own scatter, which can be small by chance, and the measurement's.
    """
    return tuple(
        _compared(target, records, (promised or {}).get(target.key), (noise or {}).get(target.key))
        for target in targets
    )


def _compared(
    target: Target, records: Sequence[Record], promise: Promise | None, noise: float | None
) -> Comparison:
    """One target against the fresh runs of its set-up."""
    own = [r for r in records if r.request.setup == target.setup]
    values = [
        r.responses[target.response]
        for r in own
        if r.status == "ok" and target.response in r.responses
    ]
    scatter = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
    one_run = max(scatter, target.scatter) if noise is None else noise
    mean = float(np.mean(values)) if values else None
    error = one_run / math.sqrt(len(values)) if values else None
    shape, runs = (target,), max(len(values), 1)
    passed = mean is not None and bool(met(shape, np.array([mean]), np.array([one_run]), runs)[0])
    return Comparison(
        key=target.key,
        target=target.value,
        target_error=target.standard_error,
        scale=target.scale,
        predicted=promise.mean if promise else None,
        predicted_error=promise.error if promise else None,
        simulated=mean,
        scatter=scatter if values else None,
        standard_error=error,
        runs=len(values),
        attempted=len(own),
        relative_error=None if mean is None else (mean - target.value) / target.scale,
        band=float(bands(shape, np.array([one_run]), runs)[0]),
        passed=passed,
        promise_kept=_kept(promise, mean, error),
    )


def _kept(promise: Promise | None, mean: float | None, error: float | None) -> bool | None:
    """Whether simulation and promise agree within two combined standard errors.

    None unless both are there.
    """
    if promise is None or mean is None or error is None:
        return None
    return abs(mean - promise.mean) <= 2 * math.hypot(promise.error, error)


def error_o1(targets: Sequence[Target], comparisons: Sequence[Comparison]) -> float | None:
    """O1 at the mean of the fresh runs (Eqs. 3 and 4); None where a target was not measured."""
    errors = [c.relative_error for c in comparisons]
    if any(e is None for e in errors):
        return None
    return sum(t.weight * abs(e) for t, e in zip(targets, errors, strict=True) if e is not None)
