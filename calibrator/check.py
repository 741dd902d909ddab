"""The verb `check`: everything that can be wrong before a run is made."""

from __future__ import annotations

from dataclasses import dataclass, field

from calibrator.diagnosis.experiments import unmeasured
from calibrator.errors import Mistakes
from calibrator.foresight.implausible import doubts, odd_materials
from calibrator.foresight.impossible import require_possible
from calibrator.foresight.smallest import small_vessels
from calibrator.foresight.steps import step_doubts
from calibrator.foresight.values import Resolved, resolved, table
from calibrator.plan.curves import require_curves
from calibrator.plan.requests import plan_requests
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
        require_curves(space, space.shipped().find(plan_requests(case)))
    for settings in (case.verify, case.validate, case.diagnosis):
        with mistakes.noted():
            for_new_seeds(space, settings).shipped()
    lacks: list[str] = []
    with mistakes.noted():
        lacks = examine(space.path, space.engine, case.run.yade).warnings()
    mistakes.raise_any()
    requests = plan_requests(case)
    warnings = [*doubts(case, values), *small_vessels(case, values), *step_doubts(case, values)]
    warnings += [*unmeasured(case), *lacks]
    if dear := beyond(space, requests):
        warnings.append(f"`run` will refuse: {dear}")
    targets = tuple(t.key for t in case.problem.targets)
    return space.note("check", Checked(len(requests), targets, tuple(warnings), values))
