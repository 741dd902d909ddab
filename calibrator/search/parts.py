"""The parts of a calibration's outcome: candidates, reach, what the data pins down, sensitivities.

They compute nothing and import no search, so that whoever reads an outcome needs none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.case.vocabulary import QUANTITIES

OUT_OF_REACH = 2.0  # combined standard errors
PINNED_SHARE = 0.5  # of the range: a 95 % interval narrower than this pins the parameter

# Units that a number in them is a power of ten of the contract's, by unit and power.
OTHER_UNITS = {
    ("kg/s", 3): "g/s",
    ("kg", 3): "g",
    ("kg/m3", -3): "g/cm3",
    ("s", 3): "ms",
    ("m", 3): "mm",
    ("m", 2): "cm",
    ("1/m", -3): "1/mm",
    ("1/m", -2): "1/cm",
    ("1", 2): "%",
}
POWERS: tuple[int, ...] = (*range(1, 10), *range(-1, -10, -1))
NEAR_A_POWER = 1.5  # a value this many times beside the range is still a question of its unit


@dataclass(frozen=True)
class Promise:
    """A response that the interpolant promises: mean and standard error, in its unit."""

    mean: float
    error: float


@dataclass(frozen=True)
class Candidate:
    """A parameter set of the front that is worth a look.

    Attributes
    ----------
    parameters : value of each calibrated parameter, in its unit; objectives : by name;
    predicted : what the interpolant promises, by experiment.response.
    """

    parameters: dict[str, float]
    objectives: dict[str, float]
    predicted: dict[str, Promise]

    def point(self, names: Sequence[str]) -> np.ndarray:
        """The parameter set (d,) in the order of these names."""
        return np.array([self.parameters[name] for name in names])


@dataclass(frozen=True)
class TargetReach:
    """How close the interpolated response comes to one target anywhere in the box.

    low and high bound the values found, best is the nearest to the target value, gap its distance
    in combined standard errors of target and interpolant; the target is out of reach beyond 2.
    only_failing : it is out of reach, but not where runs are likely to fail.
    """

    DERIVED = ("reachable", "hint", "sentence")

    key: str
    value: float
    low: float
    high: float
    best: float
    gap: float
    only_failing: bool = False

    @property
    def reachable(self) -> bool:
        """Whether the target lies within 2 combined standard errors of a reachable value."""
        return self.gap <= OUT_OF_REACH

    @property
    def sentence(self) -> str:
        """The finding in plain words."""
        span = f"the box reaches {self.low:.4g} to {self.high:.4g}"
        if self.reachable:
            return f"{self.key} = {self.value:.4g} can be reached: {span}"
        if self.only_failing:
            return (
                f"{self.key} = {self.value:.4g} is reached only where runs fail: where they"
                f" succeed, {span}, {self.gap:.1f} standard errors short; change what makes"
                " them fail"
            )
        return (
            f"{self.key} = {self.value:.4g} cannot be reached: {span}, {self.gap:.1f} standard"
            f" errors short; {self.hint or 'widen the bounds'}"
        )

    @property
    def hint(self) -> str:
        """A question about the unit, where a power of ten would bring the target into the box.

        Empty where none does, or none is needed.
        """
        unit = QUANTITIES[self.key.split(".")[1]].unit
        power = _power_of_ten(self.value, self.low, self.high)
        if self.reachable or not power:
            return ""
        times = f"{10.0**power:.15g} times what the box gives"
        if other := OTHER_UNITS.get((unit, power)):
            return f"it is about {times}: is it in {other} instead of {unit}?"
        others = [name for (own, _), name in OTHER_UNITS.items() if own == unit]
        maybe = f", not in {' or '.join(others)}" if others else ""
        return f"it is about {times}: is the decimal point right, and is it in {unit}{maybe}?"


def _power_of_ten(value: float, low: float, high: float) -> int:
    """The power of ten by which a value is off a range, 0 where there is none near."""
    near, far = sorted((abs(low), abs(high)))
    if value == 0 or low * high <= 0 or value * low < 0:
        return 0
    if math.log10(far / near) > 1:  # a range of decades holds some power of any value
        near = far = math.sqrt(near * far)
    for power in POWERS:
        if near / NEAR_A_POWER <= abs(value) * 10.0 ** int(-power) <= far * NEAR_A_POWER:
            return power
    return 0


@dataclass(frozen=True)
class JointReach:
    """The set of the box where the worst-met target is met best.

    misfit : of that target there, in combined standard errors; worst : its key; point : (d,);
    only_failing : the targets are met together only where runs are likely to fail.
    """

    DERIVED = ("reachable", "sentence")

    misfit: float
    worst: str
    point: tuple[float, ...]
    only_failing: bool = False

    @property
    def reachable(self) -> bool:
        """Whether some point meets every target within 2 combined standard errors."""
        return self.misfit <= OUT_OF_REACH

    @property
    def sentence(self) -> str:
        """The finding in plain words."""
        if self.reachable:
            return (
                f"all targets can be met together, the worst ({self.worst}) within"
                f" {self.misfit:.1f} standard errors"
            )
        if self.only_failing:
            return (
                f"the targets are met together only where runs fail: where they succeed,"
                f" {self.worst} stays {self.misfit:.1f} standard errors off at best; change what"
                " makes them fail"
            )
        return (
            f"the targets cannot be met together: {self.worst} stays {self.misfit:.1f} standard"
            " errors off at best"
        )


@dataclass(frozen=True)
class Reachability:
    """Each target by itself, and all of them at one point."""

    DERIVED = ("all", "sentences", "missed")

    targets: tuple[TargetReach, ...]
    joint: JointReach

    @property
    def all(self) -> bool:
        """Whether every target can be met, and all of them together."""
        return self.joint.reachable and not self.missed

    @property
    def sentences(self) -> tuple[str, ...]:
        """The findings in plain words."""
        return (*(t.sentence for t in self.targets), self.joint.sentence)

    @property
    def missed(self) -> tuple[str, ...]:
        """Keys of the targets that nothing in the box reaches."""
        return tuple(t.key for t in self.targets if not t.reachable)

    @property
    def alarms(self) -> tuple[str, ...]:
        """The sentences on what cannot be reached."""
        joint = () if self.joint.reachable else (self.joint.sentence,)
        return (*(t.sentence for t in self.targets if not t.reachable), *joint)


@dataclass(frozen=True, eq=False)
class ParameterProfile:
    """What the targets say about one parameter, the other parameters always adapted.

    Attributes
    ----------
    low, high : bounds of the search; best : value at the smallest chi2.
    interval_68, interval_95 : hull of the values whose chi2 exceeds the smallest by no more than 1
        and 3.84; an end that equals low or high is set by the box, not by the targets.
    positions, chi2 : (b,) profile curve, the smallest chi2 at each position, positions ascending.
    scale : of the parameter, "linear" or "log".
    truth : the value behind a synthetic laboratory, None for a real one.
    refused : whether no set of the box agrees with the targets; the intervals then mean nothing.
    """

    DERIVED = ("pinned", "range", "sentence")

    name: str
    low: float
    high: float
    best: float
    interval_68: tuple[float, float]
    interval_95: tuple[float, float]
    positions: np.ndarray
    chi2: np.ndarray
    scale: str = "linear"
    truth: float | None = None
    refused: bool = False

    @property
    def share(self) -> float:
        """Width of the 95 % interval over the range, both on the parameter's scale."""
        low, high = self.interval_95
        if self.scale == "log":
            return math.log(high / low) / math.log(self.high / self.low)
        return (high - low) / (self.high - self.low)

    @property
    def walled(self) -> tuple[bool, bool]:
        """Whether the 95 % interval ends at the lower and at the upper bound of the search."""
        rounding = 1e-9 * (self.high - self.low)
        low, high = self.interval_95
        return low <= self.low + rounding, high >= self.high - rounding

    @property
    def pinned(self) -> bool:
        """Whether the targets hold the parameter from both sides, within less than half its range.

        An interval that ends at a bound of the search is one-sided: the targets may ask for more.
        """
        return not self.refused and not any(self.walled) and self.share < PINNED_SHARE

    def interval(self, shown: Callable[[float], str]) -> str:
        """The 95 % interval in words: "0.1 to 0.2", or "at least 0.1" where a bound ends it.

        shown : how a number is written.
        """
        low, high = map(shown, self.interval_95)
        if self.refused:
            return "none"
        return {
            (False, True): f"at least {low}",
            (True, False): f"at most {high}",
        }.get(self.walled, f"{low} to {high}")

    @property
    def range(self) -> str:
        """The interval in words, with four digits."""
        return "no interval" if self.refused else self.interval("{:.4g}".format)

    @property
    def sentence(self) -> str:
        """The finding in plain words."""
        if self.refused:
            return (
                f"{self.name} is not pinned down: no parameter set agrees with the targets within"
                " their errors, so there is no interval"
            )
        interval = f"{self.range} (95 %), {self.share:.0%} of its range"
        if self.pinned:
            return f"{self.name} is pinned: {interval}"
        if any(self.walled) and not all(self.walled):
            return f"{self.name} is not pinned down from both sides by these targets: {interval}"
        return f"{self.name} is not pinned down by these targets: {interval}"


@dataclass(frozen=True, eq=False)
class Identifiability:
    """Profiles of all parameters and how the accepted parameter sets hang together.

    Attributes
    ----------
    best : (d,) parameter set of the smallest chi2; chi2 : its value, a sum over the targets: well
        above their number it says that the targets contradict the model, and the intervals then
        mean little.
    accepted : (k, d) parameter sets of the box distributed as exp(-chi2 / 2).
    correlation : (d, d) of the accepted sets: near 1 or -1 along a ridge of sets that fit equally
        well.
    assumed : targets without scatter, whose standard error was taken as half their tolerance.
    refused : whether chi2 is beyond its 99 % quantile: no parameter set agrees with the targets.
    """

    parameters: tuple[ParameterProfile, ...]
    best: np.ndarray
    chi2: float
    accepted: np.ndarray
    correlation: np.ndarray
    assumed: tuple[str, ...]
    refused: bool = False


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Shares of the variance of each response, parameters uniform on their scale over the box.

    Attributes
    ----------
    responses : m keys; parameters : d names.
    first, total : (m, d) share due to the parameter alone, and with all its interactions.
    first_error, total_error : (m, d) half widths of the 95 % intervals.
    """

    responses: tuple[str, ...]
    parameters: tuple[str, ...]
    first: np.ndarray
    total: np.ndarray
    first_error: np.ndarray
    total_error: np.ndarray
