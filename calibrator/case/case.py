"""Everything one calibration needs, in one value."""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass, field
from pathlib import Path

from calibrator.case.experiment import Condition, parts_of
from calibrator.case.fidelity import Fidelity, cheap_problem
from calibrator.case.lab import Nuisance, Observable
from calibrator.case.problem import Problem
from calibrator.case.settings import (
    MOST_RUNS,
    Cluster,
    Diagnosis,
    Interpolation,
    Plan,
    Replicates,
    Running,
    Search,
    Validation,
)
from calibrator.case.vocabulary import PARAMETERS, RESPONSES, SETUPS
from calibrator.errors import CalibratorError, Mistakes
from calibrator.files import named_file

CHEAP_SEED = 5_000_000
"""From the plan's first seed to that of its cheap runs."""
MOST_CHEAP_SETS = 10_000


@dataclass(frozen=True)
class Case:
    """Everything one calibration needs.

    path : the TOML file; measured : the lab file; truth : the known answer of a synthetic lab (or
    empty). Raises CalibratorError for a plan of more than MOST_RUNS runs, and for a shipped
    database outside the case's folder.
    """

    name: str
    path: Path
    problem: Problem
    plan: Plan = field(default_factory=Plan)
    interpolation: Interpolation = field(default_factory=Interpolation)
    search: Search = field(default_factory=Search)
    verify: Replicates = field(default_factory=Replicates)
    validate: Validation = field(default_factory=Validation)
    run: Running = field(default_factory=Running)
    cluster: Cluster = field(default_factory=Cluster)
    truth: dict[str, float] = field(default_factory=dict)
    about: str = ""
    measured: Path = Path()
    observables: tuple[Observable, ...] = ()
    diagnosis: Diagnosis = field(default_factory=Diagnosis)
    nuisances: tuple[Nuisance, ...] = ()
    fidelity: Fidelity | None = None

    def __post_init__(self) -> None:
        sets = (
            math.prod(p.samples for p in self.problem.parameters)
            if self.plan.design == "grid"
            else self.plan.sets
        )
        runs = sets * self.plan.replicates * len(self.problem.experiments)
        _require_seen(self.problem)
        _require_whole_grid(self)
        _require_two_kinds(self)
        if self.plan.design == "adaptive":
            _require_start(self)
        if runs > MOST_RUNS:
            raise CalibratorError(
                f"the plan has {runs:,} runs: lower samples, sets or replicates to at most"
                f" {MOST_RUNS:,} runs"
            )
        for key, settings in (
            ("run", self.run),
            ("verify", self.verify),
            ("validate", self.validate),
            ("diagnosis", self.diagnosis),
        ):
            if settings.shipped:
                named_file(self.path, settings.shipped, f"{key}.shipped")

    @property
    def conditions(self) -> dict[str, Condition]:
        """Variants of set-ups by name."""
        return self.problem.conditions

    @functools.cached_property
    def cheap(self) -> Case | None:
        """The cheaper version of itself that [fidelity] describes; None where there is none.

        Its seeds are its own: runs of one filling would have more in common than their set.
        """
        if self.fidelity is None:
            return None
        return dataclasses.replace(
            self,
            problem=cheap_problem(self.problem, self.fidelity),
            plan=dataclasses.replace(self.plan, seed=self.plan.seed + CHEAP_SEED),
            fidelity=None,
        )

    def without_fidelity(self) -> Case:
        """The same case, which knows of no cheap runs."""
        return dataclasses.replace(self, fidelity=None)

    @property
    def has_curves(self) -> bool:
        """Whether a target is a curve, or stands for a part of one."""
        problem = self.problem
        return any(t.response not in RESPONSES for t in (*problem.targets, *problem.held_out))

    @property
    def shipped(self) -> Path | None:
        """The response database that may serve as a start; None where none is named.

        Its path is taken relative to the case file.
        """
        return named_file(self.path, self.run.shipped, "shipped") if self.run.shipped else None

    def without_shipped_verification(self) -> Case:
        """The same case, for which verification and validation have to be run here."""
        verify = dataclasses.replace(self.verify, shipped="")
        validate = dataclasses.replace(self.validate, shipped="")
        return dataclasses.replace(self, verify=verify, validate=validate)


def _require_seen(problem: Problem) -> None:
    """Raise CalibratorError for a target that no parameter moves, and one that moves no target."""
    for experiment in problem.experiments:
        if not problem.seen_by(experiment):
            lacks = "has none of" if experiment in SETUPS else "has none, or fixes all, of"
            raise CalibratorError(
                f"{experiment} {lacks} the calibrated parameters, so that its targets say nothing"
                " of them: give these targets the role held_out"
            )
    for name in problem.names:
        if not any(name in problem.seen_by(e) for e in problem.experiments):
            raise CalibratorError(_unmoving(problem, name))


def _unmoving(problem: Problem, name: str) -> str:
    """Why a calibrated parameter moves no target, and what to do."""
    takers = PARAMETERS[name].setups
    if held := [e for e in problem.experiments if parts_of(e)[0] in takers]:
        return (
            f"{name} is fixed by the condition of {' and '.join(held)}, and no other target moves"
            " with it: remove it from the parameters, or calibrate a target without that condition"
        )
    return (
        f"{name} is no parameter of {' or '.join(problem.experiments)}, and no other set-up has a"
        f" target: remove it, or calibrate a target of {' or '.join(takers)}"
    )


def _require_whole_grid(case: Case) -> None:
    """Raise CalibratorError for a multilinear interpolant of a grid that constraints cut into."""
    if case.interpolation.method == "multilinear" and case.problem.constraints:
        raise CalibratorError(
            "multilinear interpolation needs every set of the grid, also those that the constraints"
            ' rule out: set interpolation.method = "process", or remove the constraints'
        )


def _require_start(case: Case) -> None:
    """Raise CalibratorError where an adaptive design begins with more runs than it may make."""
    plan, experiments = case.plan, len(case.problem.experiments)
    runs = plan.adaptive_start(experiments)
    if case.fidelity is not None:
        full = dataclasses.replace(plan, sets=case.fidelity.dear_sets).adaptive_start(experiments)
        if full > case.fidelity.dear_runs:
            raise CalibratorError(
                f"the adaptive design starts with {full} full runs, more than fidelity.dear_runs ="
                f" {case.fidelity.dear_runs}: raise it, or lower fidelity.dear_sets"
            )
        runs += full
    if runs > plan.most_runs:
        raise CalibratorError(
            f"the adaptive design starts with {runs} runs, more than plan.most_runs ="
            f" {plan.most_runs}: raise it, or lower plan.sets or plan.replicates"
        )


def _require_two_kinds(case: Case) -> None:
    """Raise CalibratorError for cheap runs that could carry no full ones as the case is."""
    if case.fidelity is None:
        return
    mistakes, plan = Mistakes(), case.plan
    if plan.design == "grid" or case.interpolation != Interpolation():
        mistakes.note(
            [
                '[fidelity] needs plan.design = "sobol" or "adaptive" and the [interpolation] that'
                " is the default: change these, or remove [fidelity]"
            ]
        )
    if plan.sets < case.fidelity.dear_sets:
        mistakes.note(
            [
                f"plan.sets = {plan.sets} is below fidelity.dear_sets = {case.fidelity.dear_sets}:"
                " the cheap sets are the many ones"
            ]
        )
    if plan.seed > CHEAP_SEED * 5 or plan.sets > MOST_CHEAP_SETS:
        mistakes.note(
            [
                f"[fidelity] takes plan.seed up to {CHEAP_SEED * 5:,} and plan.sets up to"
                f" {MOST_CHEAP_SETS:,}: lower them"
            ]
        )
    mistakes.raise_any()
    cheap_problem(case.problem, case.fidelity)
