"""What the verbs `preflight` and `diagnose` found, as values.

`Workspace.note` writes them into summary.json and `Workspace.outcome` reads them back. None stands
for what is no number there: an infinite size, or the gap on data held out where none are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from calibrator.case.fingerprint import Fingerprint
from calibrator.case.vocabulary import effect_of
from calibrator.diagnosis.gap import Detection, Location
from calibrator.diagnosis.verdict import NAMED, TWO_EFFECTS


@dataclass(frozen=True, kw_only=True)
class Power:
    """What an effect would have to be to be seen and to be named.

    Attributes
    ----------
    effect, called : its column, and its name in words.
    unit : of the column, scale, smallest_detectable and smallest_nameable; scale : plausible size.
    smallest_detectable, smallest_nameable : sizes seen in 80, and named in 95 of 100 cases; None
        where no size is.
    absorbed : share of its squared length that recalibration hides.
    alias, alias_cosine : the effect that it is most like, "" where there is no other, and how much.
    """

    effect: str
    called: str
    unit: str
    scale: float
    smallest_detectable: float | None
    smallest_nameable: float | None
    absorbed: float
    alias: str
    alias_cosine: float

    @property
    def sizes(self) -> tuple[float, float]:
        """Sizes that are seen and named, over the plausible one; infinite where none is."""
        seen, named = self.smallest_detectable, self.smallest_nameable
        return (
            math.inf if seen is None else seen / self.scale,
            math.inf if named is None else named / self.scale,
        )

    @property
    def detectable(self) -> str:
        """The smallest size that is seen, in words with its unit."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.called} of {_size(self.smallest_detectable)}{unit}"

    @property
    def line(self) -> str:
        """All of it in one line."""
        unit = "" if self.unit == "1" else f" [{self.unit}]"
        alias = f", most like {self.alias} ({self.alias_cosine:.2f})" if self.alias else ""
        return (
            f"{self.called} ({self.effect}{unit}, plausible {self.scale:g}):"
            f" seen from {_size(self.smallest_detectable)},"
            f" named from {_size(self.smallest_nameable)};"
            f" recalibration hides {self.absorbed:.0%}{alias}"
        )


def _size(value: float | None) -> str:
    return "no size" if value is None else f"{value:.2g}"


@dataclass(frozen=True, kw_only=True)
class Preflight:
    """What observables could show of a missing effect, whatever their values are.

    Attributes
    ----------
    observables : keys of those that do not repeat others.
    degrees : degrees of freedom that they leave beside the parameters.
    effects : what each of the k effects would have to be.
    confusability : |cos| (k, k) of the angles between the effects after recalibration.
    self_test : counts of verdicts on imagined measurements, by what is hidden in them.
    further_experiments : mean logarithm by which the nameable sizes fall, by experiment.
    notes : sentences on runs and observables left out.
    fingerprint : of what all this was computed from.
    """

    observables: tuple[str, ...]
    degrees: int
    effects: tuple[Power, ...]
    confusability: tuple[tuple[float, ...], ...]
    self_test: dict[str, dict[str, int]]
    further_experiments: dict[str, float]
    notes: tuple[str, ...]
    fingerprint: Fingerprint

    def lines(self) -> list[str]:
        """The pre-flight in words, one line each."""
        return [
            f"{len(self.observables)} observables, {self.degrees} degrees of freedom",
            *(f"  {effect.line}" for effect in self.effects),
            *(f"  imagined {hidden}: {_counted(n)}" for hidden, n in self.self_test.items()),
            *self._advice,
            *(f"  note: {note}" for note in self.notes),
        ]

    @property
    def _advice(self) -> list[str]:
        gains = self.further_experiments
        if not gains:
            return []
        best = max(gains, key=gains.__getitem__)
        return [
            f"  of the experiments not measured yet, {best} helps most: nameable sizes fall to"
            f" {math.exp(-gains[best]):.0%} on average"
        ]


def _counted(verdicts: dict[str, int]) -> str:
    ranked = sorted(verdicts.items(), key=lambda verdict: -verdict[1])
    return ", ".join(f"{count} x {said}" for said, count in ranked)


@dataclass(frozen=True, kw_only=True)
class ObservableRow:
    """A measurement beside fresh YADE runs at each explanation that was tried.

    Attributes
    ----------
    key, experiment, role : as in the lab file.
    used : whether the diagnosis is made from it.
    measured, error : value and standard error, in the response's unit.
    simulated : mean of the fresh runs, in that unit, by explanation.
    z : residual in standard errors, by explanation.
    """

    key: str
    experiment: str
    role: str
    used: bool
    measured: float
    error: float
    simulated: tuple[float, ...]
    z: tuple[float, ...]

    @property
    def held_out(self) -> bool:
        """Whether it can only take a name back."""
        return self.role == "held_out"


@dataclass(frozen=True)
class Amplitude:
    """Value of an effect's column with its standard error and, where it is named, 95 % interval.

    All are in the column's unit; None : not known.
    """

    value: float
    error: float | None
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, kw_only=True)
class ExplanationRun:
    """An explanation, and what fresh YADE runs at its best parameters say of it.

    Attributes
    ----------
    effects : columns of the added effects; none for the model as it is.
    parameters_unit : best parameters (d,), as shares of their ranges.
    amplitudes : of the added effects, by column.
    chi2, deviance, degrees, adequacy : of the fit to the surfaces; adequacy is its probability.
    fresh_probability : of fresh runs that miss the measurements by as much as these do.
    most_scattered, scatter_probability : the observable whose fresh runs scatter most for what
        replicates of the laboratory do, and the probability of as much.
    gap_used, gap_held_out : root mean square residual of the fresh runs, in standard errors, of the
        data used and held out; None where none are.
    floor_used, floor_held_out : what noise alone would leave of these.
    """

    effects: tuple[str, ...]
    parameters_unit: tuple[float, ...]
    amplitudes: dict[str, Amplitude]
    chi2: float
    deviance: float
    degrees: int
    adequacy: float
    fresh_probability: float
    most_scattered: str
    scatter_probability: float
    gap_used: float
    floor_used: float
    gap_held_out: float | None
    floor_held_out: float

    @property
    def called(self) -> str:
        """Its effects in words."""
        return " and ".join(effect_of(name).called for name in self.effects) or "model as it is"


@dataclass(frozen=True, kw_only=True)
class FingerprintTable:
    """How k effects of plausible size show in the n used observables.

    Attributes
    ----------
    effects : their columns (k,).
    shifts : changes (n, k) of the observables in standard errors, before recalibration.
    confusability : |cos| (k, k) of the angles between the effects, after it.
    amplitudes : least-squares amplitude (k,) of each alone; None where it does not show.
    likelihood_ratios : fall (k,) of chi2 by each alone.
    """

    effects: tuple[str, ...]
    shifts: tuple[tuple[float, ...], ...]
    confusability: tuple[tuple[float, ...], ...]
    amplitudes: tuple[float | None, ...]
    likelihood_ratios: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Ghosts:
    """Shares of chi2 that the best effect removes, and that ghosts of the library do.

    Attributes
    ----------
    effect : of the best true effect.
    ghost_median, ghost_95 : median and 95 % quantile of the ghosts' (see `gap.ghost_shares`).
    """

    effect: float
    ghost_median: float
    ghost_95: float


@dataclass(frozen=True, kw_only=True)
class BoundedFit:
    """Whether the model as it is meets the measurements within the bounds of its parameters.

    Attributes
    ----------
    p, p_wider : probabilities of as large a chi2 within the bounds, and up to half a range beyond
        them; the second is None where no parameter is at a bound.
    at_bounds : parameters at a bound in the fit, each with the bound in words.
    beyond : where those would be that leave their bounds, in words.
    """

    p: float
    p_wider: float | None
    at_bounds: tuple[str, ...]
    beyond: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class ErrorSize:
    """A shared error of the measurement, and how large it would have to be to explain the gap.

    Attributes
    ----------
    name, unit : as in the table of nuisances.
    stated : its standard deviation there.
    needed : the size that explains the gap best, with its sign; None where it touches nothing used.
    p : probability of what is then left.
    """

    name: str
    unit: str
    stated: float
    needed: float | None
    p: float

    @property
    def words(self) -> str:
        """The size in words."""
        if self.needed is None:
            return self.name
        unit = self.unit if self.unit == "%" else f" {self.unit}"
        times = abs(self.needed) / self.stated
        return (
            f"{self.name} off by {abs(self.needed):.2g}{unit} ({times:.1f} times its stated error)"
        )


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """A verdict on a gap, and what it rests on.

    Where the measurements cannot tell, nothing but the verdict, its sentence, notes and fingerprint
    is there; all else is None or empty.

    Attributes
    ----------
    verdict : "no gap", "out of bounds", "named", "ambiguous", "two effects", "unknown" or "cannot
        tell".
    effects : the name, the pair, or the set that cannot be told apart.
    sentence : the verdict in words with its numbers.
    notes : sentences on runs and observables left out, and on names taken back.
    fingerprint : of what all this was computed from.
    detection : the test for a gap.
    bounded : the fit of the model as it is within its bounds, and beyond them.
    errors : shared errors of the measurement, and the size of each that would explain a gap.
    day_error : of what the replicates of a day share, over the scatter of one, as it was allowed.
    ghost_probability : of a ghost library that explains as much as the best effect.
    held_out_probability : of the data held out, under what would be named.
    posterior : probability of no effect, each effect and the unknown one; none without a gap.
    adequacy : probability of each effect's fit; none without a gap.
    observables : n rows in the order of the experiments.
    locations : experiments that disagree with the others, the worst first.
    explanations : those run on YADE, the model as it is first, then the named one.
    fingerprints, ghosts, powers : of the effects.
    new_case : path of the case with the named effect, and following : the command that runs it; ""
        where there is none.
    """

    verdict: str
    effects: tuple[str, ...]
    sentence: str = ""
    notes: tuple[str, ...] = ()
    fingerprint: Fingerprint = field(default_factory=dict)
    detection: Detection | None = None
    bounded: BoundedFit | None = None
    errors: tuple[ErrorSize, ...] = ()
    day_error: float | None = None
    ghost_probability: float | None = None
    held_out_probability: float | None = None
    posterior: dict[str, float] = field(default_factory=dict)
    adequacy: dict[str, float] = field(default_factory=dict)
    observables: tuple[ObservableRow, ...] = ()
    locations: tuple[Location, ...] = ()
    explanations: tuple[ExplanationRun, ...] = ()
    fingerprints: FingerprintTable | None = None
    ghosts: Ghosts | None = None
    powers: tuple[Power, ...] = ()
    new_case: str = ""
    following: str = ""

    @property
    def explained(self) -> bool:
        """Whether an effect, or a pair of them, is named."""
        return self.verdict in (NAMED, TWO_EFFECTS)

    def lines(self) -> list[str]:
        """The diagnosis in words, one line each, with what to call next."""
        following = [f"  next: {self.following}"] if self.following else []
        return [self.sentence, *following, *(f"  note: {note}" for note in self.notes)]
