"""The reference paper's problem and what its tables print of it."""

import numpy as np

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.responses.objectives import OBJECTIVES

PARAMETERS = (
    Parameter("rolling_friction", 0.1, 0.5),
    Parameter("sliding_friction", 0.2, 0.7),
    Parameter("particle_radius", 0.3e-3, 0.4e-3),
    Parameter("particle_density", 2600.0, 2800.0),
    Parameter("young_modulus", 5e6, 500e6),
)
ANGLE, TIME, DENSITY = (
    "hourglass.drained_angle_of_repose_deg",
    "hourglass.discharge_time",
    "hourglass.bulk_density",
)
TARGETS = (
    Target("hourglass", "drained_angle_of_repose_deg", 41.57),
    Target("hourglass", "discharge_time", 6.56),
    Target("hourglass", "bulk_density", 1530.0),
)
PAPER = Problem(PARAMETERS, TARGETS)
FRICTIONS = Problem(PARAMETERS[:2], TARGETS)
INDIVIDUALS = np.array(
    [
        [0.429, 0.351, 0.4e-3, 2712.16, 4.96e7],
        [0.395, 0.377, 0.4e-3, 2741.0, 3.47e7],
        [0.361, 0.403, 0.4e-3, 2770.0, 1.98e7],
        [0.327, 0.429, 0.4e-3, 2800.0, 5e6],
    ]
)  # Table 6
O2 = [0.5294, 0.3529, 0.1765, 0.0]
VERIFIED = {
    ANGLE: np.array([41.60, 41.66, 41.66, 41.71]),
    TIME: np.array([6.54, 6.62, 6.64, 6.66]),
    DENSITY: np.array([1531.0, 1554.0, 1586.0, 1594.0]),
}  # Table 7


class Constant:
    """An interpolant that predicts the targets of Table 3 everywhere."""

    responses = (DENSITY, ANGLE, TIME)

    def predict(self, points):
        return np.tile([1530.0, 41.57, 6.56], (len(points), 1))


def value(name, problem, points, responses=None):
    return OBJECTIVES[name](problem, problem.columns(points), responses or {})
