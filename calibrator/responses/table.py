"""From records to arrays: parameter points and raw responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calibrator.case.problem import Problem
from calibrator.runs.record import Record
from calibrator.runs.request import Request


def response_table(
    problem: Problem, records: Sequence[Record], keys: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Parameter points (n, d) and raw responses (n, m) of the good runs; keys are setup.response.

    Runs of different set-ups are different rows. What a row does not have is NaN: the responses of
    other set-ups, and the parameters that its set-up does not take.
    """
    good = [r for r in records if r.status == "ok"]
    points = points_of(problem, [r.request for r in good])
    values = np.array(
        [
            [
                (
                    r.responses.get(k.split(".")[1], np.nan)
                    if k.split(".")[0] == r.request.setup
                    else np.nan
                )
                for k in keys
            ]
            for r in good
        ]
    )
    return points, values.reshape(-1, len(keys))


def points_of(problem: Problem, requests: Sequence[Request]) -> np.ndarray:
    """Parameter points (n, d) of runs; NaN where a run's set-up does not take a parameter."""
    rows = [
        [r.value(n) if n in problem.seen_by(r.setup) else np.nan for n in problem.names]
        for r in requests
    ]
    return np.array(rows, float).reshape(-1, len(problem.names))
