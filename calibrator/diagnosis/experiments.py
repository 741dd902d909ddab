"""The experiments of a diagnosis: what was measured where, and the runs that imitate it.

What the case says of an effect is known, and not looked for: a calibrated column is a parameter
like any other, and one that is fixed off its default is part of the model. What a condition sets is
fixed in its experiment alone, which then knows neither that parameter nor that effect.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.case.case import Case
from calibrator.case.experiment import ordered, parts_of
from calibrator.case.lab import Observable
from calibrator.case.values import Value
from calibrator.case.vocabulary import EFFECTS, PARAMETERS, effect_of, parameters_of
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
    """The effects that the case looks for, those left out of which it says what they are."""
    found = []
    for name in case.diagnosis.effects:
        if name in not_looked_for(case):
            continue
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
                name,
                sign,
                scale,
                least,
                largest,
                effect.excludes,
                control=not effect.removed_by,
                base=float(quantity.default),
            )
        )
    return found


def not_looked_for(case: Case) -> dict[str, str]:
    """Effects of the case's library that it says the size of, or that cannot stand beside such.

    By name, with a sentence.
    """
    problem, known = case.problem, dict[str, str]()
    for own in (problem.fixed, *problem.setups.values()):
        known |= dict.fromkeys(_switched_on(own), "fixed")
    known |= dict.fromkeys((name for name in problem.names if name in EFFECTS), "calibrated")
    found = {}
    for name in case.diagnosis.effects:
        what = f"{effect_of(name).called} ({name}) is not looked for"
        if name in known:
            found[name] = f"{what}: it is {known[name]}"
        elif rival := next((other for other in known if never_together(name, other)), ""):
            found[name] = f"{what}: it cannot stand beside {rival}, which is {known[rival]}"
    return found


def _switched_on(values: Mapping[str, Value]) -> list[str]:
    """What may be off, and is not at its default."""
    quantities = ((n, v, PARAMETERS[n]) for n, v in values.items() if n in PARAMETERS)
    return [n for n, v, quantity in quantities if quantity.unmentioned and v != quantity.default]


def never_together(one: str, other: str) -> bool:
    """Whether the scripts cannot combine two effects, or an effect and an option."""
    return one in PARAMETERS[other].excludes or other in PARAMETERS[one].excludes


def experiments(case: Case, observables: Sequence[Observable]) -> list[Experiment]:
    """The experiments of these observables: set-ups first, then the case's conditions."""
    found = []
    for name in ordered((o.experiment for o in observables), case.conditions):
        responses = tuple(o.response for o in observables if o.experiment == name)
        setup, condition = parts_of(name)
        values = case.conditions[condition].values if condition else {}
        found.append(Experiment(name, setup, values, responses))
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
    """Whether the case asks for a diagnosis.

    It does with rows or nuisances for one, and with conditions that no calibration uses.
    """
    diagnosed = any(o.role == "diagnose" for o in case.observables)
    used = {o.condition for o in case.observables}
    return bool(case.conditions.keys() - used or case.nuisances or diagnosed)


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
    elif silent := _not_in_table(case):
        found.append(
            f"the nuisance table says nothing of {', '.join(silent)}: add what you know of it, as"
            " an error that nobody states looks like an effect"
        )
    return found


def _not_in_table(case: Case) -> list[str]:
    """Errors that most laboratories have and the nuisance table lacks, in words."""
    table, rows = case.nuisances, case.observables

    def stated(fragment: str, unit: str) -> bool:
        """Whether an error in this unit touches what is measured of it, or nothing is."""
        own = [o for o in rows if fragment in o.response]
        return not own or any(n.unit == unit and n.touches(o) for n in table for o in own)

    kinds = {
        "the scale of angles (*_angle*_deg, in %)": stated("angle", "%"),
        "the zero of the clock (*_time, in s)": stated("_time", "s"),
        "fixed values (such as fixed:restitution)": any(n.fixed for n in table),
    }
    return [kind for kind, is_there in kinds.items() if not is_there]


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

    Effects that the experiment does not show are left out.
    """
    added = {name: size for name, size in (effects or {}).items() if _shows(experiment, name)}
    return make_request(case, experiment.name, point, seed, added)


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

    Those that its set-up knows, that are not held at a value, as moisture is by drying, and that
    can be combined with what its condition has.
    """
    return [
        e
        for e in effects
        if (not e.setups or experiment.setup in e.setups) and _shows(experiment, e.name)
    ]


def _shows(experiment: Experiment, effect: str) -> bool:
    known = effect in parameters_of(experiment.setup) and effect not in experiment.values
    if effect not in EFFECTS:  # a fixed value that is changed
        return known
    return known and not any(never_together(effect, one) for one in _switched_on(experiment.values))


def parameters_in(case: Case, experiment: Experiment) -> list[str]:
    """The calibrated parameters that an experiment has: its set-up's but for its condition's."""
    return case.problem.seen_by(experiment.name)


def units(case: Case, experiment: Experiment, requests: Iterable[Request]) -> np.ndarray:
    """Parameters (n, d) of an experiment's runs as shares of their ranges, on their scales.

    One that the experiment does not have stands in the middle: it moves nothing there.
    """
    runs, seen = list(requests), parameters_in(case, experiment)
    found = np.full((len(runs), len(case.problem.names)), 0.5)
    for i, parameter in enumerate(case.problem.parameters):
        if parameter.name in seen:
            values = np.array([float(r.value(parameter.name)) for r in runs])
            found[:, i] = parameter.shares_of(values)
    return found


def amplitudes(
    experiment: Experiment, effects: Sequence[Effect], requests: Iterable[Request]
) -> np.ndarray:
    """Amplitudes (n, k) of an experiment's runs, in plausible scales; 0 of what it cannot show."""
    runs, shown = list(requests), effects_in(experiment, effects)
    found = np.zeros((len(runs), len(effects)))
    for k, effect in enumerate(effects):
        if effect in shown:
            sizes = np.array([float(r.value(effect.name)) for r in runs])
            found[:, k] = (sizes - effect.base) / effect.scale
    return found


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
    return float(effect.base + size * effect.scale)


def point(case: Case, unit: np.ndarray) -> np.ndarray:
    """Parameters (d,) at shares of their ranges (d,)."""
    return np.array(
        [
            float(p.values_at(np.asarray(share)))
            for p, share in zip(case.problem.parameters, unit, strict=True)
        ]
    )
