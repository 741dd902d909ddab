"""The experiments of a diagnosis: what was measured where, and the runs that imitate it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.case.case import Case
from calibrator.case.lab import Observable
from calibrator.case.problem import Value
from calibrator.case.vocabulary import EFFECTS, SETUPS, effect_of, parameters_of
from calibrator.diagnosis.explanations import LARGEST, Effect
from calibrator.diagnosis.gap import FEWEST_DEGREES
from calibrator.plan.design import cells
from calibrator.plan.requests import make_request
from calibrator.plan.seeds import change_seed, experiment_seed
from calibrator.runs.request import Request

AMPLITUDES = (0.5, 0.75, 1.0, 1.5)  # of an effect's runs, in plausible scales


@dataclass(frozen=True)
class Experiment:
    """A set-up under a condition, and the responses that are compared there.

    Attributes
    ----------
    name, setup : setup@condition, or the set-up's name where there is no condition.
    values : of parameters, where the condition differs from the set-up's own.
    responses : names, in the order of the lab file.
    """

    name: str
    setup: str
    values: dict[str, Value]
    responses: tuple[str, ...]


def library(case: Case) -> list[Effect]:
    """The effects that the case looks for."""
    found = []
    for name in case.diagnosis.effects:
        quantity = EFFECTS[name]
        effect = effect_of(name)
        assert (
            quantity.low is not None
            and quantity.high is not None
            and isinstance(quantity.default, (int, float))
        )
        scale = case.diagnosis.scales.get(name, effect.scale)
        below, above = sorted(
            (bound - quantity.default) / scale for bound in (quantity.low, quantity.high)
        )
        least, largest = max(-LARGEST, below), min(LARGEST, above)
        # a negative size: only that direction is looked into
        sign = effect.sign if scale > 0 else "+"
        found.append(
            Effect(
                name, sign, scale, least, largest, effect.excludes, control=not effect.removed_by
            )
        )
    return found


def experiments(case: Case, observables: Sequence[Observable]) -> list[Experiment]:
    """The experiments of these observables: set-ups first, then the case's conditions."""
    order = [*SETUPS, *(f"{c.setup}@{name}" for name, c in case.conditions.items())]
    found = []
    for name in order:
        responses = tuple(o.response for o in observables if o.experiment == name)
        if responses:
            setup, _, condition = name.partition("@")
            found.append(
                Experiment(
                    name, setup, case.conditions[condition].values if condition else {}, responses
                )
            )
    return found


def further(case: Case) -> list[Observable]:
    """Observables under conditions that nobody has measured: those of their set-ups."""
    rows = case.observables
    measured = {o.condition for o in rows}
    return [
        Observable(c.setup, o.response, 0.0, o.scatter, o.replicates, "diagnose", name)
        for name, c in case.conditions.items()
        if name not in measured
        for o in rows
        if o.setup == c.setup and not o.condition
    ]


def degrees_left(case: Case) -> int:
    """Degrees of freedom that what is not held out leaves beside the parameters."""
    return sum(o.role != "held_out" for o in case.observables) - len(case.problem.names)


def wanted(case: Case) -> bool:
    """Whether the case asks for a diagnosis."""
    diagnosed = any(o.role == "diagnose" for o in case.observables)
    return bool(case.conditions or case.nuisances or diagnosed)


def unmeasured(case: Case) -> list[str]:
    """What the lab file lacks for a diagnosis, a sentence each.

    None where the case asks for no diagnosis.
    """
    rows, parameters = case.observables, len(case.problem.names)
    if not wanted(case):
        return []
    used, found = sum(o.role != "held_out" for o in rows), []
    if (lacks := parameters + FEWEST_DEGREES - used) > 0:
        found.append(
            f"`diagnose` needs {lacks} more rows that are not held out: {used} are too few for"
            f" {parameters} parameters"
        )
    if used == len(rows):
        found.append(
            "no row is held out, so nothing could show that a gap has gone: give some rows the role"
            " held_out"
        )
    if absent := [name for name in case.conditions if all(o.condition != name for o in rows)]:
        found.append(
            f"nothing is measured under {', '.join(absent)}: `preflight` says which of them would"
            " help most"
        )
    if once := sum(o.replicates == 1 for o in rows):
        found.append(
            f"{once} rows are measured once only: the simulation's scatter stands in for theirs;"
            " repeat them"
        )
    if not case.nuisances:
        found.append(
            "there is no nuisance table: errors that observables share can look like an effect;"
            " write one"
        )
    return found


def in_order(observables: Sequence[Observable], found: Sequence[Experiment]) -> list[Observable]:
    """The observables in the order of the experiments, which is that of the surfaces."""
    by_key = {o.key: o for o in observables}
    return [by_key[f"{e.name}.{response}"] for e in found for response in e.responses]


def request(
    case: Case,
    experiment: Experiment,
    point: np.ndarray,
    seed: int,
    effects: dict[str, float] | None = None,
) -> Request:
    """One run of an experiment at parameters (d,), with effects by column.

    Effects that the set-up does not know are left out.
    """
    return make_request(
        case, experiment.setup, point, seed, {**(effects or {}), **experiment.values}
    )


def plain_requests(
    case: Case, found: Sequence[Experiment], points: np.ndarray
) -> list[list[Request]]:
    """Runs without effects at sets (n, d), with their replicates, a list per experiment."""
    settings = case.diagnosis
    return [
        [
            request(case, e, point, experiment_seed(case, i, j, k))
            for j, point in enumerate(points)
            for k in range(settings.replicates)
        ]
        for i, e in enumerate(found)
    ]


def change_requests(
    case: Case, found: Sequence[Experiment], effects: Sequence[Effect], points: np.ndarray
) -> list[list[Request]]:
    """Runs of the fingerprints, a list per experiment.

    First the sets (n, d) without effects, then runs with each of them.
    """
    return [_changes(case, i, e, effects, points) for i, e in enumerate(found)]


def effects_in(experiment: Experiment, effects: Sequence[Effect]) -> list[Effect]:
    """The effects that an experiment can show.

    Those that its set-up knows and that are not held at a value, as moisture is by drying.
    """
    return [
        e
        for e in effects
        if e.name in parameters_of(experiment.setup) and e.name not in experiment.values
    ]


def _changes(
    case: Case, index: int, experiment: Experiment, effects: Sequence[Effect], points: np.ndarray
) -> list[Request]:
    count = case.diagnosis.effect_sets
    # of the parameters and of the amplitude, which must not go together
    shares = cells(len(case.problem.names) + 1, count)
    requests = [
        request(case, experiment, p, change_seed(case, index, j)) for j, p in enumerate(points)
    ]
    for effect in effects_in(experiment, effects):
        k = effects.index(effect)
        for j, own in enumerate(shares):
            added = {effect.name: column_value(effect, amplitude(effect, own[-1]))}
            seed = change_seed(case, index, len(points) + count * k + j)
            requests.append(request(case, experiment, point(case, own[:-1]), seed, added))
    return requests


def amplitude(effect: Effect, share: float) -> float:
    """Amplitude at a share of their range, within the effect's bounds.

    It is of both signs, where both make sense.
    """
    signs = (1,) if effect.sign == "+" else (-1, 1)  # both of one size share its places in the box
    levels = [sign * size for size in AMPLITUDES for sign in signs]
    return min(max(levels[int(share * len(levels))], effect.least), effect.largest)


def column_value(effect: Effect, size: float) -> float:
    """Value of the effect's column at an amplitude in plausible scales."""
    default = EFFECTS[effect.name].default
    assert isinstance(default, (int, float))
    return float(default + size * effect.scale)


def point(case: Case, unit: np.ndarray) -> np.ndarray:
    """Parameters (d,) at shares of their ranges (d,)."""
    return np.array(
        [
            float(p.values_at(np.asarray(share)))
            for p, share in zip(case.problem.parameters, unit, strict=True)
        ]
    )
