"""What verification and validation found, as values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from calibrator.case.fingerprint import Fingerprint
from calibrator.runs.workspace import Counts
from calibrator.search.outcome import COMPROMISE
from calibrator.verification.curve import CurveComparison


@dataclass(frozen=True)
class Comparison:
    """One response at one candidate: target, promise and fresh runs, all in the response's unit.

    Attributes
    ----------
    target, target_error : measured mean and its standard error; scale : what relative errors refer
        to (see `problem.Target.scale`).
    predicted, predicted_error : the interpolant's mean and standard error; None for a response that
        was not interpolated.
    simulated, scatter, standard_error : mean of the fresh runs, standard deviation of one (None of
        fewer than two), and standard error of the mean; None where nothing says what it is.
    runs : fresh runs that measured it; attempted : all that were made.
    relative_error : (simulated - target) / scale; band : how far from the target counts as met.
    passed : whether the mean lies within the band, and is known to better than the band; what
        nothing measured is missed.
    undecided : whether the mean is too uncertain to call the target met or missed: not passed.
    reported_only : whether the target has weight 0 and rules nothing.
    promise_kept : whether simulation and prediction agree within two combined standard errors.
    """

    key: str
    target: float
    target_error: float
    scale: float
    predicted: float | None
    predicted_error: float | None
    simulated: float | None
    scatter: float | None
    standard_error: float | None
    runs: int
    attempted: int
    relative_error: float | None
    band: float
    passed: bool
    undecided: bool
    reported_only: bool
    promise_kept: bool | None

    @property
    def verdict(self) -> str:
        """What became of the target, in a word or two."""
        if self.reported_only:
            return "reported only (weight 0)"
        if self.undecided:
            return "CANNOT TELL, its mean is too uncertain: more replicates"
        return "met" if self.passed else "MISSED"

    @property
    def line(self) -> str:
        """The comparison in plain words."""
        promise = "" if self.predicted is None else f", predicted {self.predicted:.5g}"
        start = f"{self.key}: target {self.target:.5g}{promise}, "
        if self.simulated is None or self.relative_error is None:
            return f"{start}not measured by any of {self.attempted} fresh runs: {self.verdict}"
        error = (
            " +- unknown (a single run)"
            if self.standard_error is None
            else f" +- {self.standard_error:.2g}"
        )
        return (
            f"{start}simulated {self.simulated:.5g}{error} ({self.relative_error:+.1%}, band"
            f" {self.band / self.scale:.1%}): {self.verdict}"
        )


@dataclass(frozen=True, kw_only=True)
class Verdict(Counts):
    """The fresh runs of one candidate against its targets.

    responses : one comparison per target, and of a curve one per component; curves : those curves
    as a whole; most_failed : share of an experiment's runs that may
    fail;
    passed : whether every target is met, and no more runs failed, None where there is no target;
    o1 : Eq. (3)-(4) at the mean of the fresh runs, None where a target was not measured;
    from_shipped_database : runs that come with the project; statuses, failed and yade are those of
    the fresh runs.
    """

    responses: tuple[Comparison, ...]
    most_failed: float
    passed: bool | None
    o1: float | None
    from_shipped_database: int
    curves: tuple[CurveComparison, ...] = ()

    @property
    def missed(self) -> tuple[str, ...]:
        """Keys of the targets that are not met."""
        return tuple(r.key for r in self.responses if not (r.passed or r.reported_only))

    @property
    def unmeasured(self) -> tuple[str, ...]:
        """Keys of the targets that no fresh run measured."""
        return tuple(r.key for r in self.responses if r.simulated is None)

    @property
    def unreliable(self) -> tuple[str, ...]:
        """Experiments of which more runs failed, or lacked a response, than may."""
        return too_many_failed(self.responses, self.most_failed)

    @property
    def undecided(self) -> tuple[str, ...]:
        """Keys of the targets whose mean is too uncertain to call them met or missed."""
        return tuple(r.key for r in self.responses if r.undecided and not r.reported_only)

    @property
    def endings(self) -> str:
        """How the runs ended, where not all ended well: "1 ok, 3 clogged"."""
        return ", ".join(f"{n} {kind}" for kind, n in self.statuses.items())

    def lines(self) -> list[str]:
        """The verdict in plain words."""
        o1 = "O1 not known" if self.o1 is None else f"O1 = {self.o1:.4f}"
        runs = "" if self.good == self.total else f"; runs: {self.endings}"
        shipped = (
            f" ({self.from_shipped_database} of its runs come with the project)"
            if self.from_shipped_database
            else ""
        )
        first = f"{'passed' if self.passed else 'NOT passed'}, {o1}{runs}{shipped}"
        first += "".join(
            f"; no recommendation, as more than {self.most_failed:.0%} of the {setup} runs failed"
            for setup in self.unreliable
        )
        if self.undecided:
            more = f"{len(self.undecided)} of {len(self.responses)} targets undecided"
            first += f"; {more}: give more replicates"
        failed = [f"  {run_id} {why}" for run_id, why in self.failed.items()]
        said = [*(r.line for r in self.responses), *(curve.line for curve in self.curves)]
        return [first, *(f"  {line}" for line in said), *failed]


@dataclass(frozen=True)
class Verification:
    """Outcome of the verb `verify`: a verdict for each candidate; passed is the compromise's."""

    passed: bool
    candidates: dict[str, Verdict]
    fingerprint: Fingerprint

    def lines(self) -> list[str]:
        """The verdicts in plain words, and what to do where the compromise failed."""
        said = _by_label(self.candidates)
        if not self.passed:
            said.append(
                "  to go on: name a copy of database.csv as run.shipped and set plan.design ="
                ' "adaptive" in the case; the verb run then adds runs where they decide'
            )
        return said


@dataclass(frozen=True, kw_only=True)
class Validation(Verdict):
    """Outcome of the verb `validate`: the compromise's verdict on the targets held out.

    candidates : verdicts of the other candidates, where they were asked for.
    """

    candidates: dict[str, Verdict]
    fingerprint: Fingerprint

    @property
    def by_candidate(self) -> dict[str, Verdict]:
        """All verdicts, the compromise's first."""
        return {COMPROMISE: self, **self.candidates}

    def lines(self) -> list[str]:
        """The verdicts in plain words."""
        if not self.responses:
            return [
                "nothing to validate: no measurement is held out; give a row of the lab file the"
                " role held_out"
            ]
        return [*super().lines(), *_by_label(self.candidates)]


def _by_label(verdicts: dict[str, Verdict]) -> list[str]:
    """The lines of all verdicts, each with its candidate."""
    said: list[str] = []
    for label, verdict in verdicts.items():
        first, *others = verdict.lines()
        said += [f"{label}: {first}", *others]
    return said


def too_many_failed(comparisons: Sequence[Comparison], most: float) -> tuple[str, ...]:
    """Experiments of which a larger share of the runs than this failed, or lacked a response."""
    ruling = [c for c in comparisons if not c.reported_only]
    least = {c.key.split(".")[0]: 0.0 for c in ruling}
    for c in ruling:
        experiment = c.key.split(".")[0]
        lost = 1 - c.runs / c.attempted if c.attempted else 1.0
        least[experiment] = max(least[experiment], lost)
    return tuple(experiment for experiment, lost in least.items() if lost > most)


def all_passed(comparisons: Sequence[Comparison], most_failed: float) -> bool | None:
    """Whether every target that has a weight is met, by enough runs; None where there is none."""
    ruling = [c for c in comparisons if not c.reported_only]
    if not ruling:
        return None
    return all(c.passed for c in ruling) and not too_many_failed(ruling, most_failed)


def worst_verdict(comparisons: Sequence[Comparison]) -> str:
    """What became of several comparisons together: the word of the worst one."""

    def badness(one: Comparison) -> tuple[bool, bool, bool]:
        return (not one.reported_only, not one.passed, not one.undecided)

    return max(comparisons, key=badness).verdict
