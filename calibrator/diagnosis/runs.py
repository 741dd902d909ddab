"""The runs that a diagnosis is made from, and the response surfaces through them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibrator.case.case import Case
from calibrator.case.lab import Nuisance, Observable
from calibrator.case.settings import MOST_SETS
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.explanations import Effect, Measured
from calibrator.diagnosis.surfaces import Surfaces, enough_runs, plain_terms
from calibrator.diagnosis.uncertain import uncertain
from calibrator.errors import Mistakes
from calibrator.plan.design import sobol
from calibrator.runs import setups
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
    uncertain : fixed values that may be wrong.
    plain, changes : runs of the model without effects, and of the fingerprints and with these
        values changed, a list per experiment.
    """

    effects: list[Effect]
    uncertain: list[Effect]
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
    points, values = sobol(case.problem, case.diagnosis.sets), uncertain(case)
    return Asked(
        effects,
        values,
        found,
        ex.plain_requests(case, found, points),
        ex.change_requests(case, found, [*effects, *values], points),
    )


@dataclass(frozen=True, eq=False)
class Scene:
    """What a diagnosis looks at.

    Attributes
    ----------
    effects, experiments : what is looked for, and where.
    uncertain : fixed values that may be wrong.
    observables : n, in the order of the surfaces.
    surfaces, measured : what is simulated and what is measured of them.
    used, held : indices of the observables that the diagnosis is made from, and of those held out.
    notes : sentences on runs and observables left out.
    records : finished runs behind the surfaces.
    """

    effects: list[Effect]
    uncertain: list[Effect]
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
    require_diagnosable(case, observables)
    records = carried_out(space, plan.requests, yes, report)
    Database(records.values()).write(space.folder() / "diagnosis.csv", made_by(space, "diagnose"))
    own, changed = by_experiment(records, plan.plain), by_experiment(records, plan.changes)
    changes = [*plan.effects, *plan.uncertain]
    surfaces = observed.surfaces(case, plan.experiments, changes, own, changed)
    ordered = ex.in_order(observables, plan.experiments)
    centre, none = np.full(surfaces.dimensions, 0.5), np.zeros(len(plan.effects))
    if imagined:
        values = surfaces.mean(centre, none)[0]
        ordered = [replace(o, value=float(v)) for o, v in zip(ordered, values, strict=True)]
    kept, notes = observed.distinct(ordered, surfaces)
    notes += ex.not_looked_for(case).values()
    for e, *two in zip(plan.experiments, own, changed, strict=True):
        notes += observed.left_out(e, [*two[0], *two[1]])
    used = np.array([i for i in kept if ordered[i].role != "held_out"], int)
    day = case.diagnosis.day_error
    return Scene(
        plan.effects,
        plan.uncertain,
        plan.experiments,
        ordered,
        surfaces,
        observed.measured_at_fit(ordered, nuisances(case), surfaces, changes, day, used),
        used=used,
        held=np.array([i for i, o in enumerate(ordered) if o.role == "held_out"], int),
        notes=notes,
        records=list(records.values()),
    )


def nuisances(case: Case) -> list[Nuisance]:
    """The errors that observables share; what is calibrated is none.

    The parameter takes up a small amount of its effect, or an uncertain value.
    """
    calibrated = case.problem.names
    return [
        n
        for n in case.nuisances
        if n.effect not in calibrated and (n.fixed is None or n.fixed[1] not in calibrated)
    ]


def require_diagnosable(case: Case, observables: Sequence[Observable]) -> None:
    """Raise CalibratorError with all that stands against a diagnosis, before any run is made."""
    plan, mistakes = asked(case, observables), Mistakes()
    names, known = [e.name for e in plan.effects], ex.not_looked_for(case)
    for nuisance in nuisances(case):
        if nuisance.effect in known:
            words = f"{known[nuisance.effect]}, so that no run says what a small one does"
            mistakes.note([f"nuisance {nuisance.name}: {words}; take that row out"])
            continue
        with mistakes.noted():
            observed.require_effect(nuisance, names)
    for e, own, changed in zip(plan.experiments, plan.plain, plan.changes, strict=True):
        for request in (*own, *changed):
            reasons = setups.impossible(request.setup, setups.numbers(request))
            mistakes.note(f"{e.name}: {reason}" for reason in reasons)
    if few := _too_few(case, plan):
        sets = enough_sets(case, observables)
        mistakes.note(
            [
                f"diagnosis.sets = {case.diagnosis.sets} is too few for the response surfaces of"
                f" {', '.join(few)}: raise it to {sets}"
                if sets <= MOST_SETS
                else f"{len(case.problem.names)} parameters and {len(names)} effects are too many"
                f" for the response surfaces of {', '.join(few)}: fix some, or look for fewer"
            ]
        )
    mistakes.raise_any()


def enough_sets(case: Case, observables: Sequence[Observable]) -> int:
    """The fewest `diagnosis.sets`, not below the case's own, through which all surfaces can go.

    More than MOST_SETS where there are none. Runs that fail are not reckoned with.
    """
    seen = [len(ex.parameters_in(case, e)) for e in ex.experiments(case, observables)]
    sets = max(case.diagnosis.sets, plain_terms(max(seen)))
    while sets <= MOST_SETS:
        more = replace(case, diagnosis=replace(case.diagnosis, sets=sets))
        if not _too_few(more, asked(more, observables)):
            return sets
        sets += 1
    return sets


def _too_few(case: Case, plan: Asked) -> list[str]:
    """Names of the experiments whose planned runs cannot make their surfaces."""
    found = []
    for e, own, changed in zip(plan.experiments, plan.plain, plan.changes, strict=True):
        sizes = ex.amplitudes(e, [*plan.effects, *plan.uncertain], changed)
        none = np.zeros((len(own), sizes.shape[1]))
        if not (
            enough_runs(ex.units(case, e, own), none)
            and enough_runs(ex.units(case, e, changed), sizes)
        ):
            found.append(e.name)
    return found


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
