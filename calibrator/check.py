"""The verb `check`: everything that can be wrong before a run is made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calibrator.case.case import Case
from calibrator.case.physics import (
    LARGEST_SHARE,
    damped_steps,
    floored,
    rayleigh_time,
    time_step_warning,
)
from calibrator.case.problem import known
from calibrator.case.vocabulary import SETUPS
from calibrator.diagnosis.experiments import unmeasured
from calibrator.errors import CalibratorError
from calibrator.plan.requests import design_points, plan_requests
from calibrator.plan.seeds import overlapping
from calibrator.responses.objectives import OBJECTIVES
from calibrator.runs.engines import ENGINES
from calibrator.runs.setups import geometry_warnings
from calibrator.runs.workspace import Workspace


@dataclass(frozen=True)
class Checked:
    """Outcome of the verb `check`: runs of the plan, keys of the targets, warnings in words."""

    runs: int
    targets: tuple[str, ...]
    warnings: tuple[str, ...]

    def lines(self) -> list[str]:
        """The outcome in plain words."""
        first = f"good; {self.runs} runs, targets {', '.join(self.targets)}"
        return [first, *(f"  warning: {w}" for w in self.warnings)]


def check_case(space: Workspace) -> Checked:
    """Everything that can be wrong before a run is made.

    Time steps, narrow necks, what a diagnosis lacks; raises CalibratorError for an unknown
    objective or a missing YADE.
    """
    case = space.case
    for name in case.search.objectives:
        known(name, OBJECTIVES, "objective")
    if meeting := overlapping(case):
        raise CalibratorError("; ".join(meeting[:3]))
    requests = plan_requests(case)
    probes = [next((r for r in requests if r.setup == setup), None) for setup in SETUPS]
    warnings = [w for probe in probes if probe is not None for w in geometry_warnings(probe)]
    warnings += _step_warnings(case)
    ENGINES[space.engine](case).require()
    warnings += unmeasured(case)
    targets = tuple(t.key for t in case.problem.targets)
    return space.note("check", Checked(len(requests), targets, tuple(warnings)))


def _step_warnings(case: Case) -> list[str]:
    """What a time step does that is longer than the reference paper's, or than contacts bear."""
    columns = case.problem.columns(design_points(case))
    fraction = float(np.max(columns["rayleigh_fraction"]))
    fixed_step = float(np.max(columns["time_step"]))
    crossing, damped = rayleigh_time(columns), damped_steps(columns)
    shortest = float(np.min(crossing))
    step = fixed_step or fraction * shortest
    share = damped / crossing
    worst = int(np.argmin(damped if fixed_step else share))
    restitution = float(np.broadcast_to(columns["restitution"], damped.shape)[worst])
    warnings = [w for w in [time_step_warning(step * (1 - 1e-9), columns)] if w]
    if fixed_step > damped[worst] * (1 + 1e-9):
        bound = floored(min(float(damped[worst]), LARGEST_SHARE * shortest))
        return [
            f"time_step = {fixed_step:.3g} s is unstable for a restitution of {restitution:g}:"
            f" lower it to {bound} s, or set time_step = 0 and let each run take its own"
        ]
    if not fixed_step and fraction > share[worst] * (1 + 1e-9):
        warnings = [
            f"rayleigh_fraction = {fraction:g} would be unstable for a restitution of"
            f" {restitution:g}: its runs take at most {floored(float(share[worst]))} of the"
            " Rayleigh time instead, which the forecast knows"
        ]
    taken = (
        np.full(crossing.shape, fixed_step)
        if fixed_step
        else np.minimum(fraction * crossing, damped)
    )
    coarse = (taken > 0.2 * crossing * (1 + 1e-9)) & (columns["restitution"] < 0.6)
    if np.any(coarse):
        warnings.append(
            "impacts with a restitution below 0.6 lose too much speed at a time step of"
            f" {np.max((taken / crossing)[coarse]):.0%} of the Rayleigh time: set rayleigh_fraction"
            " = 0.2 (or a smaller time_step) under [fixed]"
        )
    return warnings
