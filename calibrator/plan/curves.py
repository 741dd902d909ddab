"""A case with curves as targets, once there are runs: with the targets that stand for them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.case.problem import Problem, Target
from calibrator.errors import CalibratorError, Mistakes
from calibrator.responses.curves import Components, components
from calibrator.responses.interpolant import FEWEST_DEGREES
from calibrator.responses.table import experiment_of, points_of
from calibrator.runs.curves import companion
from calibrator.runs.record import Record
from calibrator.runs.workspace import Workspace


@dataclass(frozen=True, eq=False)
class OnCurves:
    """What a workspace measures on the curves of runs: the components of each."""

    problem: Problem
    found: tuple[Components, ...]

    def __call__(self, space: Workspace, records: Sequence[Record]) -> list[Record]:
        """The records with the components of their curves as responses."""
        curves = space.curves([r for r in records if r.status == "ok"])
        return [
            dataclasses.replace(r, responses={**r.responses, **self._of(r, curves[r.run_id])})
            if r.run_id in curves
            else r
            for r in records
        ]

    def _of(self, record: Record, curves: dict[str, np.ndarray]) -> dict[str, float]:
        """The components of one run, by name."""
        experiment, responses = experiment_of(self.problem, record.request), dict[str, float]()
        for one in self.found:
            if one.curve.experiment == experiment and one.curve.response in curves:
                responses |= one.of(curves[one.curve.response])
        return responses


def components_of(space: Workspace) -> tuple[Components, ...]:
    """The components that a workspace measures on curves."""
    return space.measure.found if isinstance(space.measure, OnCurves) else ()


def with_components(
    space: Workspace, records: Sequence[Record], held_out: bool = False
) -> Workspace:
    """The workspace in which each curve to calibrate is the targets that stand for it.

    Its finished runs have the responses as well. The shapes are those of these records. held_out :
    the same for the curves held out. The workspace itself where there is no such curve. Raises
    CalibratorError where good runs have no such curve, or where none of those to calibrate was
    repeated.
    """
    problem = space.case.problem
    targets = problem.held_out if held_out else problem.targets
    if not any(t.curve for t in targets):
        return space
    look = _of_held_out if held_out else _of_curve
    found = {t.key: own for t in targets if t.curve and (own := look(space, t, records))}
    parts = [found[t.key].targets if t.key in found else (t,) for t in targets]
    all_parts = tuple(t for own in parts for t in own)
    expanded = (
        dataclasses.replace(problem, held_out=all_parts)
        if held_out
        else dataclasses.replace(problem, targets=all_parts)
    )
    return dataclasses.replace(
        space,
        case=dataclasses.replace(space.case, problem=expanded),
        measure=OnCurves(expanded, (*components_of(space), *found.values())),
    )


def require_curves(space: Workspace, records: Sequence[Record]) -> None:
    """Raise CalibratorError where any of these runs lacks a curve that is a target."""
    mistakes = Mistakes()
    for target in (t for t in space.case.problem.targets if t.curve):
        own, curves = _runs_of(space, target, records)
        if len(curves) < len(own):
            mistakes.note([_missing(space, target, len(own) - len(curves), len(own))])
    mistakes.raise_any()


def _of_curve(space: Workspace, target: Target, records: Sequence[Record]) -> Components:
    """The components of a curve to calibrate."""
    own, curves = _runs_of(space, target, records)
    if len(curves) < len(own) or not own:
        raise CalibratorError(_missing(space, target, len(own) - len(curves), len(own)))
    points = points_of(space.case.problem, [r.request for r in own])
    sets = len({tuple(row) for row in np.nan_to_num(points).tolist()})
    if len(own) - sets < FEWEST_DEGREES:
        raise CalibratorError(
            f"{target.key}: {len(own)} runs at {sets} sets do not show how its points scatter"
            " together; set plan.replicates = 2 or more, and plan.replicated_sets to"
            f" {FEWEST_DEGREES} or more"
        )
    return components(target, points, [curves[r.run_id] for r in own])


def _of_held_out(space: Workspace, target: Target, records: Sequence[Record]) -> Components | None:
    """The components of a curve held out; None where no run has it."""
    own, curves = _runs_of(space, target, records)
    own = [r for r in own if r.run_id in curves]
    points = points_of(space.case.problem, [r.request for r in own])
    return components(target, points, [curves[r.run_id] for r in own]) if own else None


def _runs_of(
    space: Workspace, target: Target, records: Sequence[Record]
) -> tuple[list[Record], dict[str, np.ndarray]]:
    """The good runs of a curve's experiment, and the curve of each that left it, by run id."""
    problem = space.case.problem
    own = [
        r
        for r in records
        if r.status == "ok" and experiment_of(problem, r.request) == target.experiment
    ]
    found = {run_id: curves.get(target.response) for run_id, curves in space.curves(own).items()}
    return own, {run_id: curve for run_id, curve in found.items() if curve is not None}


def _missing(space: Workspace, target: Target, lacking: int, runs: int) -> str:
    """What to say where runs have no curve."""
    if not runs:
        return f"no good run of {target.experiment}: look at the failures that collect lists"
    path = space.case.shipped
    where = f"; those of a shipped database lie in {companion(path).name}" if path else ""
    return (
        f"{lacking} of {runs} good runs of {target.experiment} left no {target.response}{where}:"
        f" make them here, `{space.command('run')} --fresh`"
    )
