"""Every value that a run of a case gets, with where it comes from."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

from calibrator.case.case import Case
from calibrator.case.experiment import experiment_name, ordered, parts_of
from calibrator.case.values import Value
from calibrator.case.vocabulary import PARAMETERS, PLAIN_UNITS, parameters_of
from calibrator.diagnosis.experiments import wanted

CALIBRATED, DEFAULT = "calibrated", "default"


@dataclass(frozen=True)
class Resolved:
    """A value of an experiment: the value itself, or both bounds of a calibrated one; unit; source.

    source : "calibrated", "default", or the table of the case file that gives it.
    """

    value: float | int | str | tuple[float, float]
    unit: str
    source: str

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value, of a number."""
        if isinstance(self.value, tuple):
            return self.value
        assert not isinstance(self.value, str)
        return float(self.value), float(self.value)

    def __str__(self) -> str:
        unit = "" if self.unit in ("1", *PLAIN_UNITS) else f" {self.unit}"
        if isinstance(self.value, tuple):
            return f"{self.value[0]:g} to {self.value[1]:g}{unit}"
        return f"{self.value if isinstance(self.value, str) else f'{self.value:g}'}{unit}"


Values = dict[str, Resolved]
"""Values of an experiment by parameter."""


def resolved(case: Case) -> dict[str, Values]:
    """The values of every experiment that a verb of the case will run, by its name.

    Effects and options that are off are left out.
    """
    used = [*case.problem.experiments, *case.problem.held_out_experiments]
    if wanted(case):
        used += [o.setup for o in case.observables]
        used += [experiment_name(c.setup, name) for name, c in case.conditions.items()]
    return {name: _values(case, name) for name in ordered(used, case.conditions)}


def _values(case: Case, experiment: str) -> Values:
    """The values of an experiment."""
    problem, found = case.problem, {}
    setup, condition = parts_of(experiment)
    changed = case.conditions[condition].values if condition else {}
    calibrated = {p.name: p for p in problem.parameters}
    for name, quantity in parameters_of(setup).items():
        if name == "seed":
            continue
        value: Value | tuple[float, float]
        if name in changed:
            value, origin = changed[name], f"[conditions.{condition}]"
        elif name in problem.setups.get(setup, {}):
            value, origin = problem.setups[setup][name], f"[setups.{setup}]"
        elif name in calibrated:
            value, origin = (calibrated[name].low, calibrated[name].high), CALIBRATED
        elif name in problem.fixed:
            value, origin = problem.fixed[name], "[fixed]"
        elif quantity.unmentioned:
            continue
        else:
            assert quantity.default is not None
            value, origin = quantity.default, DEFAULT
        found[name] = Resolved(value, quantity.unit, origin)
    return found


def table(values: dict[str, Values]) -> list[str]:
    """The values in words, a line for each source: those that all share, then each one's own."""
    shared = dict(next(iter(values.values()), {}))
    for own in values.values():
        shared = {n: r for n, r in shared.items() if own.get(n) == r}
    lines = []
    for experiment, own in {"every set-up": shared, **values}.items():
        setup, condition = parts_of(experiment)
        plain = {} if own is shared else shared
        known = values.get(setup, plain) if condition else plain
        new = {n: r for n, r in own.items() if known.get(n) != r}
        for source in dict.fromkeys(r.source for r in new.values()):
            said = ", ".join(f"{n} {r}" for n, r in new.items() if r.source == source)
            lines.append(f"  {experiment}, {source}: {said}")
    return lines


def corners(setup: str, values: Values) -> Iterator[dict[str, float]]:
    """The numbers of a set-up at every corner of the box that its geometry knows.

    Only lengths, the density and the effects go to their bounds; others stay in the middle.
    """
    numbers, ends = {}, {}
    for name, quantity in parameters_of(setup).items():
        if isinstance(quantity.default, (int, float)):
            numbers[name] = float(quantity.default)
    for name, one in values.items():
        if isinstance(one.value, str):
            continue
        numbers[name] = sum(one.bounds) / 2
        quantity = PARAMETERS[name]
        if one.source == CALIBRATED and (
            quantity.unit == "m" or quantity.effect or name == "particle_density"
        ):
            ends[name] = one.bounds
    for corner in itertools.product(*ends.values()):
        yield {**numbers, **dict(zip(ends, corner, strict=True))}
