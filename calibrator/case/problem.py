"""What is calibrated against what: parameters with bounds, fixed values, targets.

Values that cannot be invalid.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calibrator.case.constraints import Constraint, require_room
from calibrator.case.curve import MeasuredCurve
from calibrator.case.experiment import Condition, experiment_name, ordered, parts_of
from calibrator.case.values import LARGEST, SMALLEST, Value, checked_value, known
from calibrator.case.vocabulary import PARAMETERS, PLAIN_UNITS, QUANTITIES, SETUPS
from calibrator.errors import CalibratorError, Mistakes, shown

WIDEST_LOG_SCALE = 1e12
USUAL_TOLERANCE = 0.03  # relative error at which a target counts as met unless the case says so
UNMENTIONED = {"unmentioned": True}  # of a field: at its default it is not written (see `codec`)
# numpy's own differs in the last digit between processors, and planned runs with it
_power = np.vectorize(math.pow, otypes=[float])
NEAR_ZERO = 10.0  # standard errors: a measured value closer to zero than that is near it


@dataclass(frozen=True)
class Parameter:
    """A calibrated parameter: bounds, samples per axis of a full grid, bits of its genetic code.

    scale is the coordinate in which everything happens: designs, interpolation, genetic encoding,
    distances, samples, intervals and the share of O2. It is "linear", as in the reference paper, or
    "log" where the bounds span a decade, as those of Young's modulus often do. Raises
    CalibratorError for bounds outside the contract's, a name that is no number, and a scale that
    the bounds do not allow.
    """

    name: str
    low: float
    high: float
    samples: int = 5
    bits: int = 8
    scale: str = "linear"

    def __post_init__(self) -> None:
        for bound in (self.low, self.high):
            checked_value(self.name, bound)
        if PARAMETERS[self.name].unit in PLAIN_UNITS:
            raise CalibratorError(
                f"{self.name} is not a number that can be calibrated: move it to [fixed]"
            )
        if self.low == self.high:
            raise CalibratorError(
                f"{self.name}: low and high are both {self.low:g}; give a wider interval, or move"
                " it to [fixed]"
            )
        if not self.low < self.high:
            raise CalibratorError(
                f"{self.name}: low = {self.low:g} is not below high = {self.high:g}; swap them"
            )
        mistakes = Mistakes()
        if not 2 <= self.samples <= 1000:
            mistakes.note([f"{self.name}: samples = {self.samples}; give 2 to 1000"])
        if not 1 <= self.bits <= 32:
            mistakes.note([f"{self.name}: bits = {self.bits}; give 1 to 32"])
        with mistakes.noted():
            known(self.scale, ("linear", "log"), f"scale of {self.name}")
        if self.scale == "log" and self.low <= 0:
            mistakes.note([f"{self.name}: a log scale needs low above zero, it is {self.low:g}"])
        elif self.scale == "log" and self.high / self.low > WIDEST_LOG_SCALE:
            mistakes.note(
                [
                    f"{self.name}: high is {self.high / self.low:.1g} times low; narrow the bounds"
                    " of a log scale"
                ]
            )
        mistakes.raise_any()

    def values_at(self, shares: np.ndarray) -> np.ndarray:
        """Values at shares 0 to 1 of the way from low to high on its scale, the shape of shares.

        >>> modulus = Parameter("young_modulus", 1e6, 1e8, scale="log")
        >>> modulus.values_at(np.array([0.0, 0.5, 1.0])).tolist()
        [1000000.0, 10000000.0, 100000000.0]
        """
        if self.scale == "log":
            values = self.low * _power(self.high / self.low, shares)
            return np.asarray(np.clip(values, self.low, self.high))
        return self.low + shares * (self.high - self.low)

    def shares_of(self, values: np.ndarray) -> np.ndarray:
        """The inverse of `values_at`."""
        if self.scale == "log":
            return np.asarray(np.log(values / self.low) / np.log(self.high / self.low))
        return (values - self.low) / (self.high - self.low)


@dataclass(frozen=True)
class Target:
    """A measured bulk response of one set-up, under one of the case's conditions or none ("").

    value and scatter (standard deviation of one replicate) are in the response's unit; replicates
    is how many measurements the value averages; tolerance is the relative error at which the target
    counts as met; weight is its share of the objective O1; size is what relative errors refer to
    where that is not |value|. A target with a curve is the curve as a whole, its value the mean
    height: the machinery sees the targets that stand for its components (`responses.curves`).
    """

    setup: str
    response: str
    value: float
    scatter: float = 0.0
    replicates: int = 1
    weight: float = 1.0
    tolerance: float = USUAL_TOLERANCE
    condition: str = field(default="", metadata=UNMENTIONED)
    size: float = field(default=0.0, metadata=UNMENTIONED)
    curve: MeasuredCurve | None = field(default=None, metadata=UNMENTIONED)

    def __post_init__(self) -> None:
        known(self.setup, SETUPS, "set-up")
        known(self.response, QUANTITIES, "response")
        if self.setup not in QUANTITIES[self.response].setups:
            raise CalibratorError(
                f"{self.setup} does not measure {self.response}: use"
                f" {' or '.join(QUANTITIES[self.response].setups)}"
            )
        if not (self.value == 0 or SMALLEST <= abs(self.value) <= LARGEST):
            raise CalibratorError(f"target {self.key} = {self.value}: give a finite value")
        for name, most in (("scatter", LARGEST), ("weight", 1e6), ("tolerance", 1e6)):
            if not 0 <= getattr(self, name) <= most:
                raise CalibratorError(
                    f"target {self.key}: {name} = {getattr(self, name)}; give zero or a positive"
                    f" number, at most {most:g}"
                )
        if self.scatter == 0 and self.value == 0 and not (self.size or self.curve):
            raise CalibratorError(
                f"target {self.key} is zero: give its scatter, as a share of zero says nothing"
            )
        if self.scatter == 0 and self.tolerance == 0 and not self.curve:
            raise CalibratorError(
                f"target {self.key} has neither scatter nor tolerance: give at least one of them"
            )
        if not 1 <= self.replicates <= 1_000_000:
            raise CalibratorError(
                f"target {self.key}: replicates = {shown(self.replicates)}; give 1 to 1000000"
            )

    @property
    def experiment(self) -> str:
        """setup, or setup@condition: what one run simulates."""
        return experiment_name(self.setup, self.condition)

    @property
    def key(self) -> str:
        """experiment.response, the name under which the response is interpolated and reported."""
        return f"{self.experiment}.{self.response}"

    @property
    def standard_error(self) -> float:
        """Standard error of the measured mean; 0 where the scatter is not known."""
        return self.scatter / math.sqrt(self.replicates)

    @property
    def scale(self) -> float:
        """Size that relative errors refer to, in the response's unit, above zero.

        It is |value|, as in Eq. (3) of the reference paper, unless the target has a size. Within
        NEAR_ZERO standard errors of zero a share of the value says nothing; there it is the size
        whose tolerance is two standard errors of the measurement.
        """
        if self.size:
            return self.size
        if abs(self.value) >= NEAR_ZERO * self.standard_error:
            return abs(self.value)
        return 2 * self.standard_error / (self.tolerance or USUAL_TOLERANCE)


@dataclass(frozen=True)
class Problem:
    """What is calibrated against what: parameters, targets used and held out, fixed values.

    fixed : values of all set-ups by name; setups : values of single set-ups, which win over those;
    constraints : what the parameters' values must fulfil together; conditions : variants of set-ups
    by name, whose values win over all others, those of calibrated parameters too. Raises
    CalibratorError where a name is given twice, nothing is to be calibrated, a target has a
    condition that is none of its set-up's, or constraints leave next to nothing.
    """

    parameters: tuple[Parameter, ...]
    targets: tuple[Target, ...]
    held_out: tuple[Target, ...] = ()
    fixed: dict[str, Value] = field(default_factory=dict)
    setups: dict[str, dict[str, Value]] = field(default_factory=dict)
    constraints: tuple[Constraint, ...] = ()
    conditions: dict[str, Condition] = field(default_factory=dict)

    def __post_init__(self) -> None:
        mistakes = Mistakes()
        if not self.parameters:
            words = "nothing to calibrate: add a [parameters.<name>] table with low and high"
            mistakes.note([words])
        if not self.targets:
            mistakes.note(["no target: give the measured file a row with role calibrate"])
        elif all(t.weight == 0 for t in self.targets):
            mistakes.note(
                ["every target has weight 0, and would be reported only: give one of them a weight"]
            )
        names = [p.name for p in self.parameters]
        keys = [t.key for t in (*self.targets, *self.held_out)]
        for what in (names, keys):
            twice = [x for x in what if what.count(x) > 1]
            mistakes.note(f"{x} is given twice: keep one of them" for x in twice)
        mistakes.note(
            f"{name} is both calibrated and fixed: remove it from one of the two"
            for name in names
            if name in self.fixed
        )
        for setup, own in self.setups.items():
            # it would silently win over every set's own value
            mistakes.note(
                f"setups.{setup}.{name} is what the plan sets: remove it"
                for name in sorted(own.keys() & {*names, "seed"})
            )
        for target in (*self.targets, *self.held_out):
            with mistakes.noted():
                self._require_condition(target)
        mistakes.raise_any()
        require_room(
            self.constraints, lambda shares: self.excess(self.values_at(shares)), len(names)
        )

    def _require_condition(self, target: Target) -> None:
        """Raise CalibratorError where a target's condition is none, or one of another set-up."""
        if not target.condition:
            return
        setup = self.conditions[known(target.condition, self.conditions, "condition")].setup
        if setup != target.setup:
            raise CalibratorError(
                f"{target.key}: the condition belongs to {setup}; correct the lab file"
            )

    def excess(self, points: np.ndarray) -> np.ndarray:
        """By how much (n,) points (n, d) break the constraints; 0 where all hold.

        The worst one counts, in shares of the parameters' scales. NaN breaks nothing.
        """
        columns = dict(zip(self.names, np.asarray(points, float).T, strict=True))
        slopes = {
            p.name: columns[p.name] * math.log(p.high / p.low)
            if p.scale == "log"
            else p.high - p.low
            for p in self.parameters
        }
        found = [c.excess(columns, slopes) for c in self.constraints]
        return np.asarray(np.max([np.zeros(len(points)), *found], axis=0))

    @property
    def names(self) -> list[str]:
        """Names of the calibrated parameters, in order."""
        return [p.name for p in self.parameters]

    def seen_by(self, experiment: str) -> list[str]:
        """Names of the calibrated parameters that vary in an experiment, in order.

        They are those that its set-up takes, without those that its condition fixes.
        """
        (setup, _), held = parts_of(experiment), self.values_of(experiment)
        return [n for n in self.names if setup in PARAMETERS[n].setups and n not in held]

    def values_of(self, experiment: str) -> dict[str, Value]:
        """Values that an experiment has of its own: its set-up's, and its condition's, which win.

        The name of a set-up alone is that of the set-up without a condition.
        """
        setup, condition = parts_of(experiment)
        own = self.conditions[condition].values if condition else {}
        return {**self.setups.get(setup, {}), **own}

    def only(self, names: Sequence[str]) -> Problem:
        """The same problem with these of its parameters alone, and without constraints."""
        own = tuple(p for p in self.parameters if p.name in names)
        return replace(self, parameters=own, constraints=())

    @property
    def low(self) -> np.ndarray:
        """Lower bounds, shape (d,)."""
        return np.array([p.low for p in self.parameters])

    @property
    def high(self) -> np.ndarray:
        """Upper bounds, shape (d,)."""
        return np.array([p.high for p in self.parameters])

    @property
    def scaled_bounds(self) -> np.ndarray:
        """Box (2, d) on the parameters' scales: bounds, or their logarithms."""
        return self.scaled(np.array([self.low, self.high]))

    def scaled(self, points: np.ndarray) -> np.ndarray:
        """Points (n, d) on the parameters' scales: values, or their logarithms."""
        points = np.array(points, float)
        points[:, self._logs] = np.log(points[:, self._logs])
        return points

    def unscaled(self, points: np.ndarray) -> np.ndarray:
        """The inverse of `scaled`, for points (n, d) of the box."""
        points, logs = np.array(points, float), self._logs
        low, high, inner = self.low[logs], self.high[logs], np.exp(points[:, logs])
        for bound in (low, high):  # met exactly, whatever rounding makes of its logarithm
            inner = np.where(points[:, logs] == np.log(bound), bound, inner)
        points[:, logs] = np.clip(inner, low, high)
        return points

    def values_at(self, shares: np.ndarray) -> np.ndarray:
        """Points (n, d) at shares (n, d), each 0 to 1 of the way along a parameter's scale."""
        both = zip(self.parameters, np.asarray(shares, float).T, strict=True)
        return np.column_stack([p.values_at(share) for p, share in both])

    def shares_of(self, points: np.ndarray) -> np.ndarray:
        """The inverse of `values_at`: where points (n, d) lie along the parameters' scales."""
        both = zip(self.parameters, np.asarray(points, float).T, strict=True)
        return np.column_stack([p.shares_of(values) for p, values in both])

    @property
    def _logs(self) -> np.ndarray:
        """Which parameters (d,) have a log scale."""
        return np.array([p.scale == "log" for p in self.parameters])

    @property
    def experiments(self) -> list[str]:
        """Experiments that have a target, set-ups first, then those under conditions."""
        return ordered((t.experiment for t in self.targets), self.conditions)

    @property
    def held_out_experiments(self) -> list[str]:
        """Experiments that have a target held out, in the same order."""
        return ordered((t.experiment for t in self.held_out), self.conditions)

    def columns(self, points: np.ndarray) -> dict[str, np.ndarray | float]:
        """Every numeric parameter at points (n, d): calibrated ones (n,), the others scalars."""
        columns: dict[str, np.ndarray | float] = {
            n: q.default for n, q in PARAMETERS.items() if isinstance(q.default, (int, float))
        }
        columns.update({n: v for n, v in self.fixed.items() if not isinstance(v, str)})
        columns.update({name: np.asarray(points, float)[:, i] for i, name in enumerate(self.names)})
        return columns
