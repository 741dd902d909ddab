"""Errors of the measurement as rivals of a missing effect.

An error that the replicates of an experiment share, such as that of a day, of an operator or of a
scale, looks like a physical effect. How large such errors are is what a laboratory knows least, so
a gap is also looked at as one of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calibrator.diagnosis.explanations import tail
from calibrator.diagnosis.gap import Projection


@dataclass(frozen=True)
class SharedError:
    """The size of one shared error that would come nearest to explaining a gap by itself.

    Attributes
    ----------
    times : that size over the stated one, with its sign.
    p : probability of what is then left, if nothing else is missing.
    """

    times: float
    p: float


def explaining_errors(
    residual: np.ndarray, shared: np.ndarray, project: Projection, noise_degrees: float
) -> list[SharedError]:
    """For each shared error (columns (n, m)) the size that explains a projected residual best.

    Generalised least squares; that the covariance holds the stated error already does not change
    the estimate.
    """
    columns = project(shared)
    found = []
    for column in columns.T:
        length = float(column @ column)
        times = float(column @ residual) / length if length > 0 else float("nan")
        left = residual - times * column if length > 0 else residual
        degrees = max(len(residual) - 1, 1)
        found.append(SharedError(times, tail(float(left @ left), degrees, noise_degrees)))
    return found
