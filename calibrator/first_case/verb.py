"""The verb `init`: from answers to a case, and what is to be known of it before a run is made."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from calibrator.case.case import Case
from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError, Mistakes
from calibrator.files import own_folder, write_text
from calibrator.first_case.answers import Answers
from calibrator.first_case.files import Draft, case_text, draft, lab_text, laboratory
from calibrator.first_case.knowledge import factors, most_telling
from calibrator.first_case.sizing import Sized, design_of, fit, grains_of, per_run
from calibrator.first_case.vessels import across
from calibrator.foresight.implausible import doubts
from calibrator.foresight.impossible import require_possible
from calibrator.foresight.smallest import small_vessels
from calibrator.foresight.steps import step_doubts
from calibrator.foresight.values import resolved
from calibrator.runs.request import Request
from calibrator.runs.setups import impossible, numbers


@dataclass(frozen=True)
class Vessel:
    """A set-up as it is simulated.

    across, laboratory : grain diameters across the simulated vessel and the laboratory's; grains :
    of a run; core_seconds : of a run, predicted.
    """

    across: float
    laboratory: float
    grains: int
    core_seconds: float


@dataclass(frozen=True, kw_only=True)
class Begun:
    """Outcome of the verb `init`.

    Attributes
    ----------
    case, lab : the files.
    vessels : by set-up; steps : what a smaller vessel does to each measurement, in words; lost :
        why others are left out, both by key.
    held_out : keys of what is predicted and not fitted.
    calibrated, fixed : parameters, with bounds or values; design : of the plan, in words.
    runs : of the plan, at most; core_hours : of plan, verification and validation; budget : as it
        was given.
    particle_steps_per_second : of a core with up to a thousand grains, that these hours count on;
        rate_known : whether it was measured or given, and is not another machine's.
    factors : within which each friction will be known, 95 %; further : the measurement that would
        help most, in words, and the factors with it.
    converted : units; assumed : what nobody said; doubts : what `check` will warn of.
    """

    case: str
    lab: str
    vessels: dict[str, Vessel]
    steps: dict[str, str]
    lost: dict[str, str]
    held_out: tuple[str, ...]
    calibrated: dict[str, tuple[float, float]]
    fixed: dict[str, float]
    design: str
    runs: int
    core_hours: float
    budget: float
    particle_steps_per_second: float
    rate_known: bool
    factors: dict[str, float]
    further: str
    factors_with: dict[str, float]
    converted: tuple[str, ...]
    assumed: tuple[str, ...]
    doubts: tuple[str, ...]

    def lines(self) -> list[str]:
        """The outcome in plain words."""
        said = [f"wrote {self.case} and {self.lab}"]
        for setup, v in self.vessels.items():
            real = v.across >= v.laboratory * (1 - 1e-3)
            size = "as in the laboratory" if real else f"instead of {v.laboratory:.0f}"
            said.append(
                f"  {setup}: {v.across:.0f} grain diameters across, {size};"
                f" {v.grains:,} grains, {_time(v.core_seconds)} a run"
            )
        said += [f"  {key}: {words}" for key, words in self.steps.items()]
        said += [f"  {key} is left out: {words}" for key, words in self.lost.items()]
        if self.held_out:
            said.append(f"  held out, to test the answer: {', '.join(self.held_out)}")
        open_ones = ", ".join(
            f"{n} {low:g} to {high:g}" for n, (low, high) in self.calibrated.items()
        )
        given = ", ".join(f"{n} = {v:g}" for n, v in self.fixed.items())
        said.append(f"  calibrated: {open_ones}; given: {given}")
        said.append(
            f"  {self.design}, {self.runs} runs at most; {self.core_hours:.2g} core-hours with"
            f" verification and validation, of {self.budget:g}"
        )
        said.append(f"  {_counted_on(self)}")
        said += [f"  {words}" for words in _forecast(self)]
        said += [f"  converted: {words}" for words in _grouped(self.converted)]
        said += [f"  assumed: {words}" for words in self.assumed]
        return [*said, *(f"  warning: {words}" for words in self.doubts)]


def _grouped(converted: Sequence[str]) -> list[str]:
    """Conversions `what: how`, those of one kind in one line.

    >>> _grouped(["a: mm to m (x 0.001)", "b: g to kg (x 0.001)", "c: mm to m (x 0.001)"])
    ['a, c: mm to m (x 0.001)', 'b: g to kg (x 0.001)']
    """
    kinds: dict[str, list[str]] = {}
    for words in converted:
        what, _, how = words.partition(": ")
        kinds.setdefault(how, []).append(what)
    return [f"{', '.join(whats)}: {how}" for how, whats in kinds.items()]


def _forecast(begun: Begun) -> list[str]:
    """What the data will pin down, roughly, and what more would."""
    if not begun.factors:
        return ["what the data will pin down is not forecast: no runs of ours say it"]
    said = "; ".join(_known(name, factor) for name, factor in begun.factors.items())
    found = [f"forecast, rough: {said}"]
    if begun.further:
        better = "; ".join(_known(n, f) for n, f in begun.factors_with.items())
        found.append(f"most would be gained by {begun.further}: then {better}")
    return found


def _counted_on(begun: Begun) -> str:
    """What the core-hours rest on."""
    rate = (
        f"{begun.particle_steps_per_second / 1e6:.2g} million particle-steps a second and core with"
        " up to a thousand grains"
    )
    if begun.rate_known:
        return f"core-hours are those of this machine, {rate}"
    return (
        f"core-hours are those of another machine, {rate}, as no run could be timed here; this one"
        " may be three times slower: call this where YADE is (`calibrator doctor`), or give"
        " particle_steps_per_second"
    )


def _known(name: str, factor: float) -> str:
    words = name.replace("_", " ")
    return (
        f"{words} within a factor of {factor:.1f} up or down"
        if factor < 3
        else (f"{words} hardly pinned down")
    )


def _time(seconds: float) -> str:
    return f"{seconds:.0f} core-seconds" if seconds < 120 else f"{seconds / 60:.0f} core-minutes"


def init(
    answers: Answers, folder: Path = Path(), timed: Callable[[], float | None] = lambda: None
) -> Begun:
    """Write a case and a lab file for these answers into a folder, and forecast what they give.

    timed : returns particle-steps a second and core, or None; asked where the answers do not say.

    Raises CalibratorError where files of these names are there, where the budget pays for no plan
    at all, and for a case that could not be run.
    """
    paths = list(_paths(answers, folder))
    for path in paths:
        if path.exists() or path.is_symlink():
            raise CalibratorError(
                f"{path} is there already, and is not overwritten: delete it, give another name, or"
                " another folder with --out"
            )
    _require_possible_vessels(answers)
    if answers.rate is None:
        answers = replace(answers, rate=timed())
    with tempfile.TemporaryDirectory() as place:
        sized, own = _fitted(answers, Path(place))
        texts = [path.read_text() for path in _paths(answers, Path(place))]
        require_possible(sized.case, resolved(sized.case))
    own_folder(folder)
    for path, text in zip(paths[::-1], texts[::-1], strict=True):
        write_text(path, text)
    return _begun(answers, sized, own, paths)


def _require_possible_vessels(answers: Answers) -> None:
    """Raise CalibratorError for a vessel of the laboratory that the scripts would refuse."""
    mistakes = Mistakes()
    for setup in answers.vessels:
        p = numbers(Request.of(setup, **laboratory(answers, setup), seed=1))
        # the case's own comes from its vessels
        longest = {"longest_time": float("inf")}
        mistakes.note(f"{setup}: {words}" for words in impossible(setup, {**p, **longest}))
    mistakes.raise_any()


def _paths(answers: Answers, folder: Path) -> tuple[Path, Path]:
    return folder / f"{answers.name}.toml", folder / f"{answers.name}_lab.csv"


def _fitted(answers: Answers, place: Path) -> tuple[Sized, Draft]:
    """The case that the budget pays for, and its draft; its files lie in a folder."""
    path, lab = _paths(answers, place)
    drafts: dict[tuple[float, float], Draft] = {}

    def build(most: float, softness: float, kind: str, keep: bool) -> Case:
        own = drafts.setdefault((most, softness), draft(answers, most, softness))
        if not own.targets:
            reasons = "; ".join(f"{key}: {why}" for key, why in own.lost.items())
            raise CalibratorError(
                f"nothing is left to calibrate on ({reasons or 'all rows are held out'}): measure"
                " an angle, a density or a rate as well"
            )
        if keep and own.lost:
            raise CalibratorError("some of what was measured says nothing")
        design = design_of(kind, len(own.bounds), own.experiments)
        write_text(lab, lab_text(answers, own))
        write_text(path, case_text(answers, own, design))
        return read_case(path)

    sized = fit(build, answers.budget)  # the last that it builds is the one that fits
    return sized, drafts[sized.across, sized.softness]


def _begun(answers: Answers, sized: Sized, own: Draft, paths: list[Path]) -> Begun:
    case = sized.case
    now = factors(own.targets, own.bounds)
    more = most_telling(own.targets, own.bounds) if now else None
    plan = case.plan
    words = {
        "sobol": f"a Sobol sequence of {plan.sets} sets, {plan.replicates} seeds each",
        "adaptive": f"an adaptive design that starts with {plan.sets} sets",
    }
    return Begun(
        case=str(paths[0]),
        lab=str(paths[1]),
        vessels={
            setup: Vessel(
                across(setup, vessel),
                across(setup, laboratory(answers, setup)),
                grains_of(case, setup),
                per_run(case, setup),
            )
            for setup, vessel in own.vessels.items()
        },
        steps={k: _step(answers, k, own) for k, s in own.steps.items() if s.words},
        lost=own.lost,
        held_out=tuple(r.key for r in own.rows if r.role == "held_out"),
        calibrated=own.bounds,
        fixed=own.fixed,
        design=words[plan.design],
        runs=sized.runs,
        core_hours=sized.hours,
        budget=answers.budget,
        particle_steps_per_second=case.run.particle_steps_per_second,
        rate_known=answers.rate is not None,
        factors=now,
        further=more[1] if more else "",
        factors_with=factors(own.targets, own.bounds, {more[0]: more[2]}) if more else {},
        converted=answers.converted,
        assumed=answers.assumed,
        doubts=tuple(_doubts(case)),
    )


def _doubts(case: Case) -> list[str]:
    """What `check` will warn of, as far as no run has been made and no machine looked at."""
    values = resolved(case)
    return [*doubts(case, values), *small_vessels(case, values), *step_doubts(case, values)]


def _step(answers: Answers, key: str, own: Draft) -> str:
    """What a smaller vessel makes of a measured value, in words."""
    measured = next(r.value for r in answers.rows if r.key == key)
    step = own.steps[key]
    if math.isclose(step.value, measured, rel_tol=1e-4):
        return f"{measured:.4g}, give or take {step.error:.2g}: {step.words}"
    return f"{measured:.4g} becomes {step.value:.4g} +- {step.error:.2g}: {step.words}"
