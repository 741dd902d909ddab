"""The runs that a diagnosis is made from, and the response surfaces through them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibrator.case.case import Case
from calibrator.case.lab import Observable
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.explanations import Effect, Measured
from calibrator.diagnosis.surfaces import Surfaces, fewest_runs
from calibrator.errors import CalibratorError
from calibrator.plan.design import sobol
from calibrator.runs.database import Database
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.workspace import (
    Budget,
    Report,
    Workspace,
    carry_out,
    for_new_seeds,
    made_by,
    silent,
)


@dataclass(frozen=True, eq=False)
class Asked:
    """The runs that the surfaces of some observables need.

    Attributes
    ----------
    effects, experiments : what is looked for, and where.
    plain, changes : runs of the model without effects and of the fingerprints, a list per
        experiment.
    """

    effects: list[Effect]
    experiments: list[ex.Experiment]
    plain: list[list[Request]]
    changes: list[list[Request]]

    @property
    def requests(self) -> list[Request]:
        """All of them."""
        return [r for own in (*self.plain, *self.changes) for r in own]


def asked(case: Case, observables: Sequence[Observable]) -> Asked:
    """The runs that the surfaces of these observables need."""
    effects, found = ex.library(case), ex.experiments(case, observables)
    points = sobol(case.problem, case.diagnosis.sets)
    return Asked(
        effects,
        found,
        ex.plain_requests(case, found, points),
        ex.change_requests(case, found, effects, points),
    )


@dataclass(frozen=True, eq=False)
class Scene:
    """What a diagnosis looks at.

    Attributes
    ----------
    effects, experiments : what is looked for, and where.
    observables : n, in the order of the surfaces.
    surfaces, measured : what is simulated and what is measured of them.
    used, held : indices of the observables that the diagnosis is made from, and of those held out.
    notes : sentences on runs and observables left out.
    records : finished runs behind the surfaces.
    """

    effects: list[Effect]
    experiments: list[ex.Experiment]
    observables: list[Observable]
    surfaces: Surfaces
    measured: Measured
    used: np.ndarray
    held: np.ndarray
    notes: list[str]
    records: list[Record]


def prepare(
    space: Workspace,
    observables: Sequence[Observable],
    yes: bool,
    report: Report = silent,
    imagined: bool = False,
) -> Scene:
    """Carry out the runs of the surfaces and fit them.

    imagined : take the values at the centre of the box for the measured ones, which then play no
    part. Raises CalibratorError where the runs are too few, or beyond the budget unless `yes`.
    """
    case, plan = space.case, asked(space.case, observables)
    require_enough(case, plan)
    records = carried_out(space, plan.requests, yes, report)
    Database(records.values()).write(space.folder() / "diagnosis.csv", made_by(space, "diagnose"))
    own, changed = by_experiment(records, plan.plain), by_experiment(records, plan.changes)
    surfaces = observed.surfaces(case, plan.experiments, plan.effects, own, changed)
    ordered = ex.in_order(observables, plan.experiments)
    centre, none = np.full(surfaces.dimensions, 0.5), np.zeros(len(plan.effects))
    if imagined:
        values = surfaces.mean(centre, none)[0]
        ordered = [replace(o, value=float(v)) for o, v in zip(ordered, values, strict=True)]
    slopes = surfaces.jacobian(centre, none)[:, surfaces.dimensions :]
    kept, notes = observed.distinct(ordered, surfaces)
    for e, *two in zip(plan.experiments, own, changed, strict=True):
        notes += observed.left_out(e, [*two[0], *two[1]])
    return Scene(
        plan.effects,
        plan.experiments,
        ordered,
        surfaces,
        observed.measured(
            ordered, case.nuisances, surfaces, slopes, plan.effects, case.diagnosis.day_error
        ),
        used=np.array([i for i in kept if ordered[i].role != "held_out"], int),
        held=np.array([i for i, o in enumerate(ordered) if o.role == "held_out"], int),
        notes=notes,
        records=list(records.values()),
    )


def require_enough(case: Case, plan: Asked) -> None:
    """Raise CalibratorError where the runs are too few for the surfaces, before any is made.

    So also for a nuisance that none of the effects stands for.
    """
    parameters, names = len(case.problem.names), [e.name for e in plan.effects]
    for nuisance in case.nuisances:
        observed.require_effect(nuisance, names)
    for e, own, changed in zip(plan.experiments, plan.plain, plan.changes, strict=True):
        if len(own) < (least := fewest_runs(parameters, 0)):
            raise CalibratorError(
                f"diagnosis.sets x replicates gives {e.name} {len(own)} runs, below {least}: raise"
                " one of them"
            )
        if len(changed) < (least := fewest_runs(parameters, len(ex.effects_in(e, plan.effects)))):
            raise CalibratorError(
                f"diagnosis.sets + effects x effect_sets gives {e.name} {len(changed)} runs, below"
                f" {least}: raise one of them"
            )


def carried_out(
    space: Workspace, requests: Sequence[Request], yes: bool, report: Report
) -> dict[str, Record]:
    """Finished records of the requests by run id.

    Raises CalibratorError where they are beyond the budget, unless `yes`.
    """
    space = for_new_seeds(space, space.case.diagnosis)
    hours = math.inf if yes else space.case.diagnosis.budget_core_hours
    remedy = "call again with --yes, raise that budget, or ask for fewer sets"
    budget = Budget("diagnosis.budget_core_hours", hours, remedy)
    return {r.run_id: r for r in carry_out(space, requests, report, budget)}


def by_experiment(
    records: dict[str, Record], requests: Sequence[Sequence[Request]]
) -> list[list[Record]]:
    """The records of these requests, a list per experiment."""
    return [[records[r.run_id] for r in own if r.run_id in records] for own in requests]
