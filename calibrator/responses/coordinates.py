"""The coordinates in which raw responses are interpolated.

Log scales, and the density that similarity makes superfluous. Grains that differ only in density
and Young's modulus, with the same E / rho_p, move in exactly the same way: every force in the model
(Hertz-Mindlin contacts, damping set by restitution, the rolling cap, gravity) and the mass scale
with rho_p, so accelerations, trajectories, times, angles and overlaps are the same, and masses
scale with rho_p. In dimensionless terms only E / (rho_p g d) matters, beside the frictions and the
ratios of lengths. What this needs is the same number of grains and a rest threshold that scales
with rho_p as well; at a fixed filled mass the number of grains changes as 1 / rho_p instead, which
shows only in responses that depend on how much was filled. tests/test_real_yade.py holds the proof
on a pair of runs, benchmarks/runs/similarity.py measures it on pairs of the reduced case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.case.problem import Problem
from calibrator.case.vocabulary import PARAMETERS, QUANTITIES
from calibrator.errors import CalibratorError
from calibrator.responses.box import inside
from calibrator.responses.interpolant import Around, Interpolant

DENSITY, MODULUS = "particle_density", "young_modulus"

# Parameters that bring a force, an energy or a time of their own, which does not scale with the
# density; of adhesion nothing has shown that it does.
OWN_SCALE = ("bed_viscosity", "bond_number", "time_step", "filling_kinetic_energy")


@dataclass(frozen=True)
class Coordinates:
    """Change from parameters (k, d) to the interpolant's coordinates, and back to raw responses.

    collapsed : whether the particle density is taken out by similarity. Coordinates are then those
    of a sand with the mean density of the box: Young's modulus becomes E rho_mean / rho_p, and the
    column of the density is dropped. Raises CalibratorError where one of the two is not calibrated.
    """

    problem: Problem
    collapsed: bool = False

    def __post_init__(self) -> None:
        if self.collapsed and not {DENSITY, MODULUS} <= set(self.problem.names):
            raise CalibratorError(
                f"interpolation.similarity needs both {DENSITY} and {MODULUS} calibrated: add them,"
                " or remove it"
            )
        if self.collapsed and (own := scales_of_their_own(self.problem)):
            raise CalibratorError(
                f"interpolation.similarity does not hold beside {' and '.join(own)}, which has a"
                " scale of its own: remove similarity, or leave that at its default"
            )

    @property
    def changed(self) -> bool:
        """False where the coordinates are the parameters themselves."""
        return self.collapsed or any(p.scale == "log" for p in self.problem.parameters)

    @property
    def names(self) -> list[str]:
        """Names of the coordinates, those of the parameters behind them."""
        return [n for n in self.problem.names if not (self.collapsed and n == DENSITY)]

    @property
    def bounds(self) -> np.ndarray:
        """Box (2, c) of the coordinates."""
        corners = np.array([self.problem.low, self.problem.high])
        box = self.inward(corners)
        if self.collapsed:  # the softest coordinate is the softest grain of the largest density
            column, density = self.names.index(MODULUS), self.problem.names.index(DENSITY)
            swapped = corners.copy()
            swapped[:, density] = swapped[::-1, density]
            box[:, column] = self.inward(swapped)[:, column]
        return box

    def density_ratio(self, points: np.ndarray) -> np.ndarray:
        """Particle density over the box's mean (k,) where it is collapsed, else ones."""
        if not self.collapsed:
            return np.ones(len(points))
        column = self.problem.names.index(DENSITY)
        both = self.problem.low[column] + self.problem.high[column]
        return np.asarray(points[:, column] / both * 2)

    def inward(self, points: np.ndarray) -> np.ndarray:
        """Coordinates (k, c) of points (k, d)."""
        points = np.array(np.atleast_2d(points), float)
        if self.collapsed:
            points[:, self.problem.names.index(MODULUS)] /= self.density_ratio(points)
        points = self.problem.scaled(points)
        return points[:, [i for i, n in enumerate(self.problem.names) if n in self.names]]

    def factors(self, points: np.ndarray, keys: Sequence[str]) -> np.ndarray:
        """What a response (k, m) of the sand of mean density has to be multiplied by.

        That is the density ratio where masses enter, else one. points : (k, d); keys : m of
        responses.
        """
        massive = np.array(["kg" in QUANTITIES[key.split(".")[1]].unit for key in keys])
        return np.where(massive, self.density_ratio(np.atleast_2d(points))[:, None], 1.0)


def scales_of_their_own(problem: Problem) -> list[str]:
    """Parameters, calibrated or fixed off their default, that similarity does not hold beside."""
    given = [problem.fixed, *problem.setups.values(), *map(problem.values_of, problem.experiments)]
    off = {n for one in given for n, value in one.items() if value != PARAMETERS[n].default}
    return [name for name in OWN_SCALE if name in off or name in problem.names]


@dataclass(frozen=True, eq=False)
class Changed(Around):
    """An interpolant in other coordinates, seen from the problem's parameters.

    It offers what the `Interpolant` protocol asks for. points (p, d) and values (p, m) are the
    distinct parameter sets and their mean responses; two sets that similarity makes one are two
    here and one inside.
    """

    coordinates: Coordinates
    inner: Interpolant
    points: np.ndarray
    values: np.ndarray

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Mean responses (k, m) at points (k, d); CalibratorError outside the box."""
        points = self._inside(points)
        mean = self.inner.predict(self.coordinates.inward(points))
        return np.asarray(mean * self.coordinates.factors(points, self.responses))

    def predict_with_error(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean responses and their standard deviations, both (k, m).

        Raises CalibratorError outside the box.
        """
        points = self._inside(points)
        mean, error = self.inner.predict_with_error(self.coordinates.inward(points))
        factors = self.coordinates.factors(points, self.responses)
        return mean * factors, error * factors

    def _inside(self, points: np.ndarray) -> np.ndarray:
        """The points, checked in the user's own units before they become logarithms."""
        problem = self.coordinates.problem
        return inside(points, problem.low, problem.high, problem.names)

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Each distinct point predicted without the runs at its coordinates.

        The prediction, and the scatter that is expected of it, both (p, m).
        """
        mean, error = self.inner.leave_one_out()
        _, row = np.unique(self.coordinates.inward(self.points), axis=0, return_inverse=True)
        factors = self.coordinates.factors(self.points, self.responses)
        return mean[row] * factors, error[row] * factors
