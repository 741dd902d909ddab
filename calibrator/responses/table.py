"""From records to arrays: parameter points and raw responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calibrator.case.problem import Problem
from calibrator.runs.record import Record


def response_table(
    problem: Problem, records: Sequence[Record], keys: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Parameter points (n, d) and raw responses (n, m) of the good runs; keys are setup.response.

    Runs of different set-ups are different rows; a response that a row does not have is NaN.
    """
    good = [r for r in records if r.status == "ok"]
    points = np.array([[r.request.value(n) for n in problem.names] for r in good], float).reshape(
        -1, len(problem.names)
    )
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
