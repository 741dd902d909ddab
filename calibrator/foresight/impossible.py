"""What cannot work in a case: all that a later verb, or YADE's scripts, would refuse."""

from __future__ import annotations

import numpy as np

from calibrator.case.case import Case
from calibrator.case.experiment import parts_of
from calibrator.case.settings import ADAPTIVE_REPLICATED
from calibrator.case.values import known
from calibrator.case.vocabulary import PARAMETERS
from calibrator.diagnosis.experiments import wanted
from calibrator.diagnosis.runs import require_diagnosable
from calibrator.errors import CalibratorError, Mistakes
from calibrator.foresight.values import CALIBRATED, Values, corners, resolved
from calibrator.plan.requests import design_points
from calibrator.plan.seeds import overlapping
from calibrator.responses.coordinates import Coordinates
from calibrator.responses.gaussian_process import require_points
from calibrator.responses.interpolant import FEWEST_DEGREES
from calibrator.responses.objectives import OBJECTIVES
from calibrator.runs import setups


def require_possible(case: Case, values: dict[str, Values]) -> None:
    """Raise CalibratorError with everything that cannot work; values : see `resolved`."""
    mistakes = Mistakes()
    for name in case.search.objectives:
        with mistakes.noted():
            known(name, OBJECTIVES, "objective")
    mistakes.note(overlapping(case))
    for experiment, own in values.items():
        mistakes.note(_geometry(experiment, own))
    if case.cheap is not None:
        cheap = resolved(case.cheap)
        for experiment in case.problem.experiments:
            mistakes.note(_geometry(experiment, cheap[experiment], "a cheap run of "))
    mistakes.note(_density(case, values))
    mistakes.note(_curves(case))
    with mistakes.noted():
        _require_interpolable(case, mistakes)
    if wanted(case):
        with mistakes.noted():
            require_diagnosable(case, case.observables)
    mistakes.raise_any()


def _geometry(experiment: str, values: Values, what: str = "") -> list[str]:
    """What the scripts refuse at any corner of the box; each reason once, at its first corner.

    what : words before the experiment's name.
    """
    setup, found = parts_of(experiment)[0], dict[str, str]()
    moved = [n for n, r in values.items() if r.source == CALIBRATED and PARAMETERS[n].unit == "m"]
    words = {
        n
        for n, r in values.items()
        if isinstance(r.value, str) and r.value != PARAMETERS[n].default
    }
    for p in corners(setup, values):
        place = ", ".join(f"{n} = {p[n]:g}" for n in moved)
        for reason in setups.impossible(setup, p, words):
            found.setdefault(
                reason, f"{what}{experiment}{f' at {place}' if place else ''}: {reason}"
            )
    return list(found.values())


def _density(case: Case, values: dict[str, Values]) -> list[str]:
    """Measured bulk densities above the grains' own."""
    found = []
    for target in (*case.problem.targets, *case.problem.held_out):
        densest = values[target.experiment]["particle_density"].bounds[1]
        if target.response == "bulk_density" and target.value > densest:
            found.append(
                f"{target.key} = {target.value:g} kg/m3 is above the density of the grains,"
                f" {densest:g}: correct the row, or particle_density"
            )
    return found


def _curves(case: Case) -> list[str]:
    """Curves to calibrate of which too few runs will be repeated to see their points scatter."""
    plan, curves = case.plan, [t.key for t in case.problem.targets if t.curve]
    # the many runs are those that give the shapes
    sets = len(design_points(case.cheap or case)) if curves else 0
    replicated = min(plan.replicated_sets or sets, sets)
    if plan.design == "adaptive":
        replicated = min(plan.replicated_sets or ADAPTIVE_REPLICATED, sets)
    degrees = replicated * (plan.replicates - 1)
    if degrees >= FEWEST_DEGREES:
        return []
    return [
        f"{key} is a curve, and {degrees} repeated runs do not show how its points scatter"
        f" together: raise plan.replicates or plan.replicated_sets until there are {FEWEST_DEGREES}"
        for key in curves
    ]


def _require_interpolable(case: Case, mistakes: Mistakes) -> None:
    """Note, or raise, what stands against an interpolation of the planned sets."""
    if case.cheap is not None:  # the full runs lean on those of the cheap ones
        return _require_interpolable(case.cheap, mistakes)
    change = Coordinates(case.problem, case.interpolation.similarity)
    points = np.unique(change.inward(design_points(case)), axis=0)
    if case.interpolation.method == "multilinear":
        if case.plan.design != "grid":
            raise CalibratorError(
                'interpolation.method = "multilinear" needs a full grid, and plan.design is'
                f' "{case.plan.design}": set that to "grid", or the method to "process"'
            )
        if change.collapsed:
            raise CalibratorError(
                "interpolation.similarity makes the grid one with holes, and the multilinear method"
                ' needs a full one: remove similarity, or set interpolation.method = "process"'
            )
        return
    key = "the samples of the grid" if case.plan.design == "grid" else "plan.sets"
    for experiment in case.problem.experiments:
        response = next(t.key for t in case.problem.targets if t.experiment == experiment)
        seen = case.problem.seen_by(experiment)
        own = [i for i, name in enumerate(change.names) if name in seen]
        with mistakes.noted():  # a condition may fix what similarity needs to vary
            Coordinates(case.problem.only(seen), change.collapsed)
        try:
            require_points(response, len(np.unique(points[:, own], axis=0)), len(own))
        except CalibratorError as error:
            mistakes.note([f"as planned, {error}; change {key}"])
