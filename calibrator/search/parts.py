"""The parts of a calibration's outcome: candidates, reach, what the data pins down, sensitivities.

They compute nothing and import no search, so that whoever reads an outcome needs none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

OUT_OF_REACH = 2.0  # combined standard errors
PINNED_SHARE = 0.5  # of the range: a 95 % interval narrower than this pins the parameter


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
    predicted : what the interpolant promises, by setup.response.
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

    DERIVED = ("reachable", "sentence")

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
            " errors short; widen the bounds"
        )


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
    """

    DERIVED = ("pinned", "sentence")

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

    @property
    def share(self) -> float:
        """Width of the 95 % interval over the range, both on the parameter's scale."""
        low, high = self.interval_95
        if self.scale == "log":
            return math.log(high / low) / math.log(self.high / self.low)
        return (high - low) / (self.high - self.low)

    @property
    def pinned(self) -> bool:
        """Whether the 95 % interval covers less than half of the range."""
        return self.share < PINNED_SHARE

    @property
    def sentence(self) -> str:
        """The finding in plain words."""
        interval = (
            f"{self.interval_95[0]:.4g} to {self.interval_95[1]:.4g} (95 %), {self.share:.0%} of"
            " its range"
        )
        return (
            f"{self.name} is {'pinned' if self.pinned else 'not pinned down by these targets'}:"
            f" {interval}"
        )


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
    """

    parameters: tuple[ParameterProfile, ...]
    best: np.ndarray
    chi2: float
    accepted: np.ndarray
    correlation: np.ndarray
    assumed: tuple[str, ...]


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
