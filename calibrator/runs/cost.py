"""What a run will cost: particles x steps over a measured rate."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.setups import particles, steps

PARTICLE_STEPS_PER_SECOND = 1.9e6
"""Particle-steps a second and core: grains at the start times steps, measured on 1,400 of them by
benchmarks/runs/rate.py.
"""


def core_seconds(requests: Sequence[Request], finished: Iterable[Record] = ()) -> np.ndarray:
    """Predicted core-seconds (n,) of each request.

    What finished runs took corrects them, by the median of its ratio to the prediction, per set-up.
    A set-up that has none yet is corrected by those that have: the core is as slow for it.
    """
    ratios: dict[str, list[float]] = {}
    for record in finished:
        spent = _measured(record)
        if record.status == "ok" and spent > 0:
            ratios.setdefault(record.request.setup, []).append(spent / _predicted(record.request))
    correction = {setup: float(np.median(values)) for setup, values in ratios.items()}
    others = float(np.median(list(correction.values()))) if correction else 1.0
    return np.array([_predicted(r) * correction.get(r.setup, others) for r in requests])


def core_hours(record: Record) -> float:
    """What a finished run took [h]; the prediction where it did not say."""
    return (_measured(record) or _predicted(record.request)) / 3600


def _measured(record: Record) -> float:
    """Core-seconds of the stages that a run has been through."""
    return sum(float(record.diagnostics.get(k, 0)) for k in ("filling_cpu", "release_cpu"))


def _predicted(request: Request) -> float:
    start_up = 2.0
    return start_up + particles(request) * steps(request) / PARTICLE_STEPS_PER_SECOND
