"""A cheaper version of a case: the same parameters and targets, run with other fixed values."""

from __future__ import annotations

from dataclasses import dataclass, replace

from calibrator.case.experiment import parts_of
from calibrator.case.problem import Problem
from calibrator.case.settings import require_within
from calibrator.case.values import Value, checked_value, known
from calibrator.case.vocabulary import PARAMETERS, parameters_of
from calibrator.errors import Mistakes


@dataclass(frozen=True)
class Fidelity:
    """What a cheap run has instead, and how many full ones the plan may spend.

    values : of fixed parameters by name, such as coarser grains, a smaller vessel or fewer turns,
    which win over all others. dear_sets : of the plan's sets, how many are run in full as well, the
    first ones; dear_runs : most full runs that an adaptive design makes, of all set-ups. Raises
    CalibratorError for unknown names, values out of range, and none at all.
    """

    values: dict[str, Value]
    dear_sets: int = 8
    dear_runs: int = 40

    def __post_init__(self) -> None:
        mistakes, values = Mistakes(), dict[str, Value]()
        if not self.values:
            mistakes.note(["fidelity.values is empty: name what makes the cheap runs cheap"])
        for name, value in self.values.items():
            with mistakes.noted():
                own = known(name, PARAMETERS, "parameter in [fidelity.values]")
                values[own] = checked_value(own, value)
        if "seed" in self.values:
            mistakes.note(["fidelity.values.seed is what the plan sets: remove it"])
        with mistakes.noted():
            require_within("fidelity", self, dear_sets=(3, 10_000), dear_runs=(3, 1_000_000))
        mistakes.raise_any()
        object.__setattr__(self, "values", values)


def cheap_problem(problem: Problem, fidelity: Fidelity) -> Problem:
    """The problem of the cheap runs.

    Raises CalibratorError where a value is calibrated or set by a condition, and where it changes
    nothing in an experiment that has a target.
    """
    mistakes, given = Mistakes(), fidelity.values
    varied = {n: c for c, one in problem.conditions.items() for n in one.values}
    for name in given:
        if name in problem.names:
            mistakes.note([f"fidelity.values.{name} is calibrated: remove it there"])
        elif name in varied:
            mistakes.note([f"fidelity.values.{name} is set by condition {varied[name]}: remove it"])
    for experiment in problem.experiments:
        setup, _ = parts_of(experiment)
        now = {**problem.fixed, **problem.values_of(experiment)}
        own = _known_to(setup, given).items()
        if all(now.get(name, PARAMETERS[name].default) == value for name, value in own):
            mistakes.note(
                [
                    f"fidelity.values change nothing in {experiment}, whose cheap runs would be the"
                    " full ones: add a value that makes them cheaper"
                ]
            )
    mistakes.raise_any()
    setups = {s: {**own, **_known_to(s, given)} for s, own in problem.setups.items()}
    return replace(problem, fixed={**problem.fixed, **given}, setups=setups)


def _known_to(setup: str, given: dict[str, Value]) -> dict[str, Value]:
    """Those of the values that a set-up has."""
    own = parameters_of(setup)
    return {name: value for name, value in given.items() if name in own}
