"""The experiments of a diagnosis: what was measured where, the runs that imitate it, and the errors of the measurements."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.case import Case
from calibrator.design import cells
from calibrator.discrepancy import FEWEST_DEGREES, repeated
from calibrator.errors import CalibratorError
from calibrator.identification import LARGEST, Effect, Measured
from calibrator.lab import Nuisance, Observable
from calibrator.plan import make_request
from calibrator.problem import Value
from calibrator.quantities import EFFECTS, SETUPS, effect_of, parameters_of
from calibrator.records import Record
from calibrator.surface import Surfaces, fit_surfaces
from calibrator.table import Request

EXPERIMENT_STRIDE = 1_000_000  # between the first seeds of experiments: a filling must not be the same in two of them
CHANGE_SEED = 200_000_000  # added to the seeds of the fingerprints' runs
SET_STRIDE = 100  # between the seeds of neighbouring sets, for their replicates
AMPLITUDES = (0.5, 0.75, 1.0, 1.5)  # of an effect's runs, in plausible scales
PRIOR_DEGREES = 4  # weight of the simulation's scatter beside that of a few replicates in the laboratory


@dataclass(frozen=True)
class Experiment:
    """A set-up under a condition, whose values differ from the set-up's own, and the responses that are compared there."""

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
        assert quantity.low is not None and quantity.high is not None and isinstance(quantity.default, (int, float))
        scale = case.diagnosis.scales.get(name, effect.scale)
        below, above = sorted((bound - quantity.default) / scale for bound in (quantity.low, quantity.high))
        least, largest = max(-LARGEST, below), min(LARGEST, above)
        sign = effect.sign if scale > 0 else "+"  # a negative size: only that direction is looked into
        found.append(Effect(name, sign, scale, least, largest, effect.excludes, control=not effect.removed_by))
    return found


def experiments(case: Case, observables: Sequence[Observable]) -> list[Experiment]:
    """The experiments of these observables, in the order of set-ups and then of the case's conditions."""
    order = [*SETUPS, *(f"{c.setup}@{name}" for name, c in case.conditions.items())]
    found = []
    for name in order:
        responses = tuple(o.response for o in observables if o.experiment == name)
        if responses:
            setup, _, condition = name.partition("@")
            found.append(Experiment(name, setup, case.conditions[condition].values if condition else {}, responses))
    return found


def unmeasured(case: Case) -> list[str]:
    """What the lab file lacks for a diagnosis, a sentence each; none where the case asks for no diagnosis."""
    rows, parameters = case.observables, len(case.problem.names)
    if not case.conditions and not case.nuisances and all(o.role != "diagnose" for o in rows):
        return []
    used, found = sum(o.role != "held_out" for o in rows), []
    if (lacks := parameters + FEWEST_DEGREES - used) > 0:
        found.append(f"`diagnose` needs {lacks} more rows that are not held out: {used} are too few for {parameters} parameters")
    if used == len(rows):
        found.append("no row is held out, so nothing could show that a gap has gone: give some rows the role held_out")
    if absent := [name for name in case.conditions if all(o.condition != name for o in rows)]:
        found.append(f"nothing is measured under {', '.join(absent)}: `preflight` says which of them would help most")
    if once := sum(o.replicates == 1 for o in rows):
        found.append(f"{once} rows are measured once only: the simulation's scatter stands in for theirs; repeat them")
    if not case.nuisances:
        found.append("there is no nuisance table: errors that observables share can look like an effect; write one")
    return found


def in_order(observables: Sequence[Observable], found: Sequence[Experiment]) -> list[Observable]:
    """The observables in the order of the experiments, which is that of the surfaces."""
    by_key = {o.key: o for o in observables}
    return [by_key[f"{e.name}.{response}"] for e in found for response in e.responses]


def request(case: Case, experiment: Experiment, point: np.ndarray, seed: int, effects: dict[str, float] | None = None) -> Request:
    """One run of an experiment at parameters (d,), with effects by column; those the set-up does not know are left out."""
    return make_request(case, experiment.setup, point, seed, {**(effects or {}), **experiment.values})


def plain_requests(case: Case, found: Sequence[Experiment], points: np.ndarray) -> list[list[Request]]:
    """Runs of the model without effects, a list per experiment: sets (n, d) with their replicates."""
    settings = case.diagnosis
    return [
        [
            request(case, e, point, _first_seed(case, i) + SET_STRIDE * j + k)
            for j, point in enumerate(points)
            for k in range(settings.replicates)
        ]
        for i, e in enumerate(found)
    ]


def change_requests(
    case: Case, found: Sequence[Experiment], effects: Sequence[Effect], points: np.ndarray
) -> list[list[Request]]:
    """Runs of the fingerprints, a list per experiment: the sets (n, d) without effects, then runs with each of them."""
    return [_changes(case, i, e, effects, points) for i, e in enumerate(found)]


def effects_in(experiment: Experiment, effects: Sequence[Effect]) -> list[Effect]:
    """The effects that an experiment can show: known to its set-up, and not held at a value, as moisture is by drying."""
    return [e for e in effects if e.name in parameters_of(experiment.setup) and e.name not in experiment.values]


def _changes(case: Case, index: int, experiment: Experiment, effects: Sequence[Effect], points: np.ndarray) -> list[Request]:
    seed, count = _first_seed(case, index) + CHANGE_SEED, case.diagnosis.effect_sets
    shares = cells(len(case.problem.names) + 1, count)  # of the parameters and of the amplitude, which must not go together
    requests = [request(case, experiment, p, seed + SET_STRIDE * j) for j, p in enumerate(points)]
    for effect in effects_in(experiment, effects):
        k = effects.index(effect)
        for j, own in enumerate(shares):
            added = {effect.name: column_value(effect, amplitude(effect, own[-1]))}
            first = seed + SET_STRIDE * (len(points) + count * k + j)
            requests.append(request(case, experiment, point(case, own[:-1]), first, added))
    return requests


def amplitude(effect: Effect, share: float) -> float:
    """Amplitude at a share of their range; of both signs, where both make sense, and within the effect's bounds."""
    signs = (1,) if effect.sign == "+" else (-1, 1)  # both of one size share its places in the box
    levels = [sign * size for size in AMPLITUDES for sign in signs]
    return min(max(levels[int(share * len(levels))], effect.least), effect.largest)


def column_value(effect: Effect, size: float) -> float:
    """Value of the effect's column at an amplitude in plausible scales."""
    default = EFFECTS[effect.name].default
    assert isinstance(default, (int, float))
    return float(default + size * effect.scale)


def _first_seed(case: Case, index: int) -> int:
    return case.diagnosis.seed + EXPERIMENT_STRIDE * index


def units(case: Case, requests: Iterable[Request]) -> np.ndarray:
    """Parameters (n, d) of the runs as shares of their ranges, on each parameter's scale."""
    rows = [[float(one.value(name)) for name in case.problem.names] for one in requests]
    values = np.array(rows, float).reshape(-1, len(case.problem.names))
    return np.column_stack([p.shares_of(column) for p, column in zip(case.problem.parameters, values.T, strict=True)])


def point(case: Case, unit: np.ndarray) -> np.ndarray:
    """Parameters (d,) at shares of their ranges (d,)."""
    return np.array([float(p.values_at(np.asarray(share))) for p, share in zip(case.problem.parameters, unit, strict=True)])


def amplitudes(effects: Sequence[Effect], requests: Iterable[Request]) -> np.ndarray:
    """Amplitudes (n, k) of the runs, in plausible scales."""
    rows = [[(float(r.value(e.name)) - float(EFFECTS[e.name].default or 0.0)) / e.scale for e in effects] for r in requests]
    return np.array(rows, float).reshape(-1, len(effects))


def surfaces(
    case: Case,
    found: Sequence[Experiment],
    effects: Sequence[Effect],
    plain: Sequence[Sequence[Record]],
    changes: Sequence[Sequence[Record]],
) -> Surfaces:
    """Response surfaces from finished runs, a list per experiment; runs that lack a response are left out."""
    good = [complete(e, records) for e, records in zip(found, plain, strict=True)]
    good_changes = [complete(e, records) for e, records in zip(found, changes, strict=True)]
    return fit_surfaces(
        [(units(case, _requests(r)), values_of(e, r)) for e, r in zip(found, good, strict=True)],
        [
            (units(case, _requests(r)), amplitudes(effects, _requests(r)), values_of(e, r))
            for e, r in zip(found, good_changes, strict=True)
        ],
        [e.name for e in found],
        {int(r.request.parameters["seed"]) for records in good for r in records},
        {int(r.request.parameters["seed"]) for records in good_changes for r in records},
    )


def _requests(records: Sequence[Record]) -> list[Request]:
    return [r.request for r in records]


def complete(experiment: Experiment, records: Sequence[Record]) -> list[Record]:
    """The good runs that have every response of the experiment."""
    return [r for r in records if r.status == "ok" and all(name in r.responses for name in experiment.responses)]


def values_of(experiment: Experiment, records: Sequence[Record]) -> np.ndarray:
    """Responses (runs, n) of the experiment's complete runs."""
    rows = [[r.responses[name] for name in experiment.responses] for r in complete(experiment, records)]
    return np.array(rows, float).reshape(-1, len(experiment.responses))


def left_out(experiment: Experiment, records: Sequence[Record]) -> list[str]:
    """A sentence on the runs that could not be used, if there are any, by what became of them."""
    good = {r.run_id for r in complete(experiment, records)}
    bad = [r for r in records if r.run_id not in good]
    kinds = Counter("without every response" if r.status == "ok" else r.status for r in bad)
    listed = ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))
    return [f"{len(bad)} of {len(records)} runs of {experiment.name} are left out: {listed}"] if bad else []


@dataclass(frozen=True, eq=False)
class Averages:
    """Mean of complete runs, their number and their standard deviation (0 of a single one), of every observable (n,)."""

    mean: np.ndarray
    count: np.ndarray
    scatter: np.ndarray


def averages(found: Sequence[Experiment], records: Sequence[Sequence[Record]]) -> Averages:
    """Averages over the complete runs. Raises CalibratorError where there is no run."""
    values, counts, scatters = [], [], []
    for e, own in zip(found, records, strict=True):
        rows = values_of(e, own)
        if not len(rows):
            raise CalibratorError(
                f"no fresh run of {e.name} can be used ({'; '.join(left_out(e, own))}): diagnosis_confirmed.csv in the results "
                "folder lists them; change the experiment so that it does not clog, or narrow the parameters"
            )
        values.append(rows.mean(axis=0))
        counts.append(np.full(len(e.responses), len(rows)))
        scatters.append(rows.std(axis=0, ddof=1) if len(rows) > 1 else np.zeros(len(e.responses)))
    return Averages(np.concatenate(values), np.concatenate(counts), np.concatenate(scatters))


def measured(
    observables: Sequence[Observable],
    nuisances: Sequence[Nuisance],
    found: Surfaces,
    slopes: np.ndarray,
    effects: Sequence[Effect],
) -> Measured:
    """The measurements with the covariance of all their errors.

    observables : n, in the order of the surfaces; slopes (n, k) : changes by each effect per plausible scale, for nuisances
    that are a small effect. The scatter of a few replicates is itself uncertain: where it is the smaller one, it is pooled
    with the simulation's. All observables of an experiment come from the same replicates, so their errors are taken to be
    correlated as those of the simulation's runs.
    """
    noise = found.noise
    seed_scatter = np.sqrt(np.diag(noise))
    correlation = noise / np.outer(seed_scatter, seed_scatter)
    own, replicates = np.array([o.scatter for o in observables]), np.array([o.replicates for o in observables])
    error = pooled_scatter(own, replicates, seed_scatter) / np.sqrt(replicates)
    covariance = correlation * np.outer(error, error)
    for nuisance in nuisances:
        column = _nuisance_column(nuisance, observables, slopes, effects)
        covariance = covariance + np.outer(column, column)
    return Measured(np.array([o.value for o in observables]), covariance, replicates)


def pooled_scatter(own: np.ndarray, replicates: np.ndarray, simulated: np.ndarray) -> np.ndarray:
    """Scatter (n,) of one replicate: that of a few is pooled with the simulation's, unless it is the larger one."""
    degrees = np.where(own > 0, replicates - 1, 0)
    pooled = (degrees * own**2 + PRIOR_DEGREES * simulated**2) / (degrees + PRIOR_DEGREES)
    return np.asarray(np.maximum(np.sqrt(pooled), own))


def _nuisance_column(
    nuisance: Nuisance, observables: Sequence[Observable], slopes: np.ndarray, effects: Sequence[Effect]
) -> np.ndarray:
    if nuisance.effect:
        names = [e.name for e in effects]
        if nuisance.effect not in names:
            raise CalibratorError(
                f"nuisance {nuisance.name} is a small {nuisance.effect}, which diagnosis.effects lacks: add it there"
            )
        index = names.index(nuisance.effect)
        return np.asarray(slopes[:, index] * nuisance.error / effects[index].scale)
    sizes = [abs(o.value) / 100 if nuisance.unit == "%" else 1.0 for o in observables]
    return np.array([nuisance.error * s if nuisance.touches(o) else 0.0 for o, s in zip(observables, sizes, strict=True)])


def distinct(observables: Sequence[Observable], found: Surfaces) -> tuple[list[int], list[str]]:
    """Indices of the observables that do not repeat others of the same run, and a sentence on each that does."""
    scatter = np.sqrt(np.diag(found.noise))
    pairs = repeated(found.noise / np.outer(scatter, scatter))
    left_out = {later for later, _ in pairs}
    sentences = [f"{observables[a].key} repeats {observables[b].key}: left out" for a, b in pairs]
    return [i for i in range(len(observables)) if i not in left_out], sentences
