"""The verb `check`: everything that can be wrong before a run is made."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from calibrator.case.case import Case
from calibrator.case.physics import (
    LARGEST_SHARE,
    damped_steps,
    floored,
    rayleigh_time,
    time_step_warning,
)
from calibrator.diagnosis.experiments import unmeasured
from calibrator.errors import Mistakes
from calibrator.foresight.implausible import doubts, odd_materials
from calibrator.foresight.impossible import require_possible
from calibrator.foresight.values import Resolved, resolved, table
from calibrator.plan.requests import design_points, plan_requests
from calibrator.runs.machine import examine
from calibrator.runs.workspace import Workspace, beyond, for_new_seeds


@dataclass(frozen=True)
class Checked:
    """Outcome of the verb `check`: runs of the plan, keys of the targets, warnings in words.

    values : every value of each set-up, or set-up@condition, with where it comes from.
    """

    runs: int
    targets: tuple[str, ...]
    warnings: tuple[str, ...]
    values: dict[str, dict[str, Resolved]] = field(default_factory=dict)

    def lines(self) -> list[str]:
        """The outcome in plain words."""
        doubts = f", {len(self.warnings)} warnings" if self.warnings else ""
        first = f"good; {self.runs} runs, targets {', '.join(self.targets)}{doubts}"
        return [first, *(f"  warning: {w}" for w in self.warnings), *table(self.values)]


def check_case(space: Workspace) -> Checked:
    """Everything that can be wrong before a run is made.

    Raises CalibratorError with all that a later verb or YADE's scripts would refuse, and for a YADE
    that is missing or cannot be used; warns of what is implausible, and of what the machine lacks.
    """
    case, mistakes = space.case, Mistakes()
    values = resolved(case)
    space.folder()
    with mistakes.noted():
        require_possible(case, values)
    if mistakes.messages:
        mistakes.note(odd_materials(case, values))
    with mistakes.noted():
        space.shipped()
    for settings in (case.verify, case.validate, case.diagnosis):
        with mistakes.noted():
            for_new_seeds(space, settings).shipped()
    lacks: list[str] = []
    with mistakes.noted():
        lacks = examine(space.path, space.engine, case.run.yade).warnings()
    mistakes.raise_any()
    requests = plan_requests(case)
    warnings = [*doubts(case, values), *_step_warnings(case), *unmeasured(case), *lacks]
    if dear := beyond(space, requests):
        warnings.append(f"`run` will refuse: {dear}")
    targets = tuple(t.key for t in case.problem.targets)
    return space.note("check", Checked(len(requests), targets, tuple(warnings), values))


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
