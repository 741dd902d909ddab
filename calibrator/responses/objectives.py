"""Named objectives of the search: numbers to be made small.

An objective is a function (problem, columns, responses) -> (n,), where columns is
`problem.columns(points)` and responses maps each response key to its predictions (n,). Register
your own with the decorator and use it by its name:

>>> @objective("softness", symbol="S", about="Young's modulus, to prefer soft grains [Pa]")
... def softness(problem, columns, responses):
...     return columns["young_modulus"]
>>> OBJECTIVES.pop("softness").symbol
'S'
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calibrator.case.physics import Columns, rayleigh_time
from calibrator.case.problem import Problem
from calibrator.case.values import known
from calibrator.errors import CalibratorError
from calibrator.responses.targets import Responses, relative_errors, target_columns

if TYPE_CHECKING:
    from calibrator.responses.interpolant import Interpolant

Function = Callable[[Problem, Columns, Responses], np.ndarray]
_COSTS = ("time_cost", "rayleigh_cost")
_COST_SIGNS = {"particle_radius": -1, "particle_density": -1, "young_modulus": 1}  # of Eq. (5)


@dataclass(frozen=True)
class Objective:
    """A function to be minimised under the name that cases and plots use."""

    name: str
    symbol: str
    about: str
    function: Function

    def __call__(self, problem: Problem, columns: Columns, responses: Responses) -> np.ndarray:
        """Values (n,) of the objective."""
        return self.function(problem, columns, responses)


OBJECTIVES: dict[str, Objective] = {}


def objective(name: str, *, symbol: str, about: str) -> Callable[[Function], Function]:
    """Decorator that registers a function as the objective called name.

    symbol, about : how plots and the page name it. Raises CalibratorError if the name is taken.
    """

    def register(function: Function) -> Function:
        if name in OBJECTIVES:
            raise CalibratorError(f"an objective called {name} exists: choose another name")
        OBJECTIVES[name] = Objective(name, symbol, about, function)
        return function

    return register


def costly(problem: Problem, names: Sequence[str]) -> bool:
    """Whether any of the named objectives but the error differs between sets: it costs to choose.

    The costs depend on grain size, density and Young's modulus alone; an objective that a user has
    registered is taken to differ.
    """
    moving = bool(_COST_SIGNS.keys() & set(problem.names))
    return any(name != "error" and (moving or name not in _COSTS) for name in names)


def evaluation(
    problem: Problem, interpolant: Interpolant, names: Sequence[str]
) -> Callable[[np.ndarray], np.ndarray]:
    """Function that maps points (n, d) to the named objectives (n, k).

    It goes by way of the interpolated raw responses. Raises CalibratorError for an unknown
    objective or a target whose response is not interpolated.
    """
    chosen = [OBJECTIVES[known(name, OBJECTIVES, "objective")] for name in names]
    target_columns(problem, interpolant.responses)

    def evaluate(points: np.ndarray) -> np.ndarray:
        columns = problem.columns(points)
        responses = dict(zip(interpolant.responses, interpolant.predict(points).T, strict=True))
        return np.column_stack([one(problem, columns, responses) for one in chosen])

    return evaluate


@objective("error", symbol="O1", about="sum of the weighted relative errors of all targets")
def error(problem: Problem, columns: Columns, responses: Responses) -> np.ndarray:
    """O1 of the paper, its Eqs. 3 and 4: sum of w_i |y_i - t_i| / |t_i|, shape (n,).

    Weights are 1 unless given; what stands for |t_i| near zero says `Target.scale`.
    """
    weights = np.array([target.weight for target in problem.targets])
    return np.asarray(relative_errors(problem, responses) @ weights)


@objective(
    "time_cost",
    symbol="O2",
    about="linear measure of the computing time, 0 at the box's cheapest corner",
)
def time_cost(problem: Problem, columns: Columns, responses: Responses) -> np.ndarray:
    """O2 of the paper, its Eqs. 5 to 7, shape (n,).

    Each calibrated one among particle radius, particle density (large is cheap) and Young's modulus
    (small is cheap) adds its position on its scale, 0 at the cheap end and 1 at the dear end.
    With all three this is Eq. (5) with its constant 2 and a range of 0 to 3; with fewer the range
    ends at their number; with none it is 0 everywhere.
    """
    cost = np.zeros(_count(problem, columns))
    for parameter in problem.parameters:
        sign = _COST_SIGNS.get(parameter.name, 0)
        share = parameter.shares_of(np.asarray(columns[parameter.name]))
        cost += {-1: 1 - share, 0: 0 * share, 1: share}[sign]
    return cost


@objective(
    "rayleigh_cost",
    symbol="O_R",
    about="largest Rayleigh time in the box over Rayleigh time: 1 at the cheapest corner",
)
def rayleigh_cost(problem: Problem, columns: Columns, responses: Responses) -> np.ndarray:
    """Largest Rayleigh time of the box over the Rayleigh time, shape (n,).

    It is the number of time steps relative to the fewest. Unlike `time_cost` it weighs radius,
    density and Young's modulus as the time step does. The Rayleigh time is monotonic in each
    parameter, so its largest value lies at a corner of the box.
    """
    corners = np.array(list(itertools.product(*zip(problem.low, problem.high, strict=True))))
    largest = np.max(rayleigh_time(problem.columns(corners)))
    return np.broadcast_to(largest / rayleigh_time(columns), _count(problem, columns)).copy()


def _count(problem: Problem, columns: Columns) -> int:
    """The number of points that the columns hold."""
    return len(np.atleast_1d(columns[problem.names[0]]))
