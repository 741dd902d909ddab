"""What another engine's responses may differ by from YADE's, from runs that were shipped before.

grid/rolling_stiffness.csv and grid/rolling_stiffness_engines.csv hold the three set-ups at four
friction pairs, five seeds each, by YADE at its default rolling stiffness and by LIGGGHTS with
epsd2. The mean square of the gaps between the two means, less what the scatter of the seeds alone
would give, is the square of the engine-to-engine standard error of a response. Responses that were
not compared there get none, but for the emptying time, which goes with the inverse of the rate.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np

from benchmarks.runs import rolling_stiffness
from calibrator.case.lab import Observable

RELATIVE = ("bulk_density", "mass_flow_rate")  # as a share of the value; angles are in degrees
SAME = {"emptying_time": "mass_flow_rate"}
YADE, OTHER = "4", "LIGGGHTS"  # labels of rolling_stiffness.samples


@cache  # hundreds of files are read for it
def standard_errors() -> dict[str, float]:
    """Engine-to-engine standard error by setup.response: a share of the value, or degrees."""
    found = {}
    for setup, names in rolling_stiffness.RESPONSES.items():
        for name in names:
            squares = []
            for own in rolling_stiffness.samples(setup, name).values():
                if YADE in own and OTHER in own:
                    unit = own[YADE].mean() if name in RELATIVE else 1.0
                    variance, _ = rolling_stiffness.pooled(own)
                    noise = variance * (1 / len(own[YADE]) + 1 / len(own[OTHER]))
                    squares.append(((own[YADE].mean() - own[OTHER].mean()) ** 2 - noise) / unit**2)
            found[f"{setup}.{name}"] = float(np.sqrt(max(np.mean(squares), 0.0)))
    return found


def variances(observables: Sequence[Observable], values: np.ndarray) -> np.ndarray:
    """Variance (n,) that is added to each observable's own, independently of the others."""
    errors, found = standard_errors(), []
    for one, value in zip(observables, values, strict=True):
        name = SAME.get(one.response, one.response)
        size = abs(float(value)) if name in RELATIVE else 1.0
        found.append((errors.get(f"{one.setup}.{name}", 0.0) * size) ** 2)
    return np.array(found)
