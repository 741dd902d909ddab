"""What a run will cost: particles x steps over a measured rate.

The rate falls with the number of grains, as they no longer fit the processor's cache. How fast
differs between machines (benchmarks/runs/rate.py): with 3,500 grains one had about 0.8 of its rate
with a thousand, with 4,000 another 0.43. What is taken lies between; finished runs correct it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from calibrator.case.settings import PARTICLE_STEPS_PER_SECOND
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.setups import particles, steps

FALL = 0.3
"""Power of the number of grains that the rate falls with, from a thousand to MANY."""
MANY = 12_000
"""Grains that fit no cache: each costs what it costs among more of them."""


def core_seconds(
    requests: Sequence[Request],
    finished: Iterable[Record] = (),
    rate: float = PARTICLE_STEPS_PER_SECOND,
) -> np.ndarray:
    """Predicted core-seconds (n,) of each request.

    rate : particle-steps a second and core of this machine, with up to a thousand grains.

    What finished runs took corrects them, by the median of its ratio to the prediction, per set-up.
    A set-up that has none yet is corrected by those that have: the core is as slow for it.
    """
    ratios: dict[str, list[float]] = {}
    for record in finished:
        spent = spent_seconds(record)
        if record.status == "ok" and spent > 0:
            ratio = spent / _predicted(record.request, rate)
            ratios.setdefault(record.request.setup, []).append(ratio)
    correction = {setup: float(np.median(values)) for setup, values in ratios.items()}
    others = float(np.median(list(correction.values()))) if correction else 1.0
    return np.array([_predicted(r, rate) * correction.get(r.setup, others) for r in requests])


def core_hours(record: Record) -> float:
    """What a finished run took [h]; the prediction where it did not say."""
    return (spent_seconds(record) or _predicted(record.request)) / 3600


def spent_seconds(record: Record) -> float:
    """Core-seconds of the stages that a run has been through."""
    return sum(float(record.diagnostics.get(k, 0)) for k in ("filling_cpu", "release_cpu"))


def _predicted(request: Request, rate: float = PARTICLE_STEPS_PER_SECOND) -> float:
    start_up, grains = 2.0, particles(request)
    return start_up + grains * steps(request) / rate * _slowed(grains)


def _slowed(grains: int) -> float:
    """How much longer a grain's step takes than among a thousand grains."""
    return float((min(max(grains, 1000), MANY) / 1000) ** FALL)
