"""From records to what a diagnosis compares: averages, surfaces, and errors of measurements."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from calibrator.case.case import Case
from calibrator.case.lab import Nuisance, Observable
from calibrator.case.vocabulary import PARAMETERS
from calibrator.diagnosis.experiments import Experiment, amplitudes, units
from calibrator.diagnosis.explanations import LIKELY, Effect, Measured, explain
from calibrator.diagnosis.gap import repeated
from calibrator.diagnosis.surfaces import Surfaces, fit_surfaces
from calibrator.diagnosis.uncertain import WIDE
from calibrator.errors import CalibratorError
from calibrator.runs.record import Record
from calibrator.runs.request import Request

# weight of the simulation's scatter beside that of a few replicates in the laboratory
PRIOR_DEGREES = 4
LARGER = 0.05  # probability from which replicates scatter more than the simulation
ROOM = 0.5  # shares of a range by which a fit may leave it to see whether the box is too small


def surfaces(
    case: Case,
    found: Sequence[Experiment],
    effects: Sequence[Effect],
    plain: Sequence[Sequence[Record]],
    changes: Sequence[Sequence[Record]],
) -> Surfaces:
    """Response surfaces from finished runs, a list per experiment.

    Runs that lack a response are left out. Raises CalibratorError where too few are left.
    """
    good = [complete(e, records) for e, records in zip(found, plain, strict=True)]
    good_changes = [complete(e, records) for e, records in zip(found, changes, strict=True)]
    return fit_surfaces(
        [(units(case, e, _requests(r)), values_of(e, r)) for e, r in zip(found, good, strict=True)],
        [
            (
                units(case, e, _requests(r)),
                amplitudes(e, effects, _requests(r)),
                values_of(e, r),
            )
            for e, r in zip(found, good_changes, strict=True)
        ],
        [e.name for e in found],
        {int(r.request.parameters["seed"]) for records in good for r in records},
        {int(r.request.parameters["seed"]) for records in good_changes for r in records},
        _wider(case),
    )


def _wider(case: Case) -> np.ndarray:
    """Ends (2, d) beyond the case's box: half a range away, and no further than a run may go."""
    ends = []
    for p in case.problem.parameters:
        known = PARAMETERS[p.name]
        low, high = (math.nan if v is None else v for v in (known.low, known.high))
        with np.errstate(divide="ignore"):  # a log scale never comes to 0
            shares = p.shares_of(np.array([low, high], float))
        ends.append((np.fmax(shares[0], -ROOM), np.fmin(shares[1], 1 + ROOM)))
    return np.array(ends).T


def _requests(records: Sequence[Record]) -> list[Request]:
    return [r.request for r in records]


def complete(experiment: Experiment, records: Sequence[Record]) -> list[Record]:
    """The good runs that have every response of the experiment."""
    return [
        r
        for r in records
        if r.status == "ok" and all(name in r.responses for name in experiment.responses)
    ]


def values_of(experiment: Experiment, records: Sequence[Record]) -> np.ndarray:
    """Responses (runs, n) of the experiment's complete runs."""
    rows = [
        [r.responses[name] for name in experiment.responses] for r in complete(experiment, records)
    ]
    return np.array(rows, float).reshape(-1, len(experiment.responses))


def left_out(experiment: Experiment, records: Sequence[Record]) -> list[str]:
    """A sentence on the runs that could not be used, if there are any, by what became of them."""
    good = {r.run_id for r in complete(experiment, records)}
    bad = [r for r in records if r.run_id not in good]
    kinds = Counter("without every response" if r.status == "ok" else r.status for r in bad)
    listed = ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))
    return (
        [f"{len(bad)} of {len(records)} runs of {experiment.name} are left out: {listed}"]
        if bad
        else []
    )


@dataclass(frozen=True, eq=False)
class Averages:
    """What complete runs say of n observables.

    Attributes
    ----------
    mean : of the runs (n,), in the responses' units.
    count : their number (n,).
    scatter : their standard deviation (n,); 0 of a single one.
    """

    mean: np.ndarray
    count: np.ndarray
    scatter: np.ndarray


def averages(found: Sequence[Experiment], records: Sequence[Sequence[Record]]) -> Averages:
    """Averages over the complete runs.

    Raises CalibratorError where there is no run.
    """
    values, counts, scatters = [], [], []
    for e, own in zip(found, records, strict=True):
        rows = values_of(e, own)
        if not len(rows):
            raise CalibratorError(
                f"no fresh run of {e.name} can be used ({'; '.join(left_out(e, own))}):"
                " diagnosis_confirmed.csv in the results folder lists them; change the experiment"
                " so that it does not clog, or narrow the parameters"
            )
        values.append(rows.mean(axis=0))
        counts.append(np.full(len(e.responses), len(rows)))
        scatters.append(rows.std(axis=0, ddof=1) if len(rows) > 1 else np.zeros(len(e.responses)))
    return Averages(np.concatenate(values), np.concatenate(counts), np.concatenate(scatters))


def measured(
    observables: Sequence[Observable],
    nuisances: Sequence[Nuisance],
    found: Surfaces,
    effects: Sequence[Effect],
    day_error: float,
    unit: np.ndarray,
) -> Measured:
    """The measurements with the covariance of all their errors, at parameters (d,).

    observables : n, in the order of the surfaces; effects : all changes that the surfaces have,
    those of uncertain fixed values last. Some observables scatter ten times as much in one
    corner of the box as in another, and a small tilt or neck does more there, so errors are those
    of a place. The scatter of a few replicates is itself uncertain and is pooled with the
    simulation's. All observables of an experiment come from the same replicates, so their errors
    are taken to be correlated as those of the simulation's runs. Beside the scatter of replicates
    each day of an experiment has an error that they share, of day_error times that scatter, and as
    correlated. What the table of nuisances states is taken to be right within a factor of
    KNOWN_WITHIN.
    """
    noise, none = found.noise_at(unit), np.zeros(len(effects))
    seed_scatter = np.sqrt(np.diag(noise))
    correlation = noise / np.outer(seed_scatter, seed_scatter)
    own, replicates = (
        np.array([o.scatter for o in observables]),
        np.array([o.replicates for o in observables]),
    )
    scatter, days = pooled_scatter(own, replicates, seed_scatter), [o.days for o in observables]
    error, day = scatter / np.sqrt(replicates), day_error * scatter / np.sqrt(days)
    covariance = correlation * (np.outer(error, error) + np.outer(day, day))
    slopes = found.jacobian(unit, none)[:, found.dimensions :]
    columns = [_nuisance_column(one, observables, slopes, effects) for one in nuisances]
    shared = np.array(columns, float).reshape(-1, len(observables)).T
    values = np.array([o.value for o in observables])
    return Measured(values, covariance + LIKELY * shared @ shared.T, replicates, shared)


def measured_at_fit(
    observables: Sequence[Observable],
    nuisances: Sequence[Nuisance],
    found: Surfaces,
    effects: Sequence[Effect],
    day_error: float,
    used: np.ndarray,
) -> Measured:
    """The measurements with their errors where the model without effects fits them best.

    As in `measured`; the place is that of a fit to the observables at the indices `used` with the
    errors at the centre of the box.
    """
    rest = (observables, nuisances, found, effects, day_error)
    first = measured(*rest, np.full(found.dimensions, 0.5)).only(used)
    return measured(*rest, explain(found, first, effects, kept=used).unit)


def pooled_scatter(own: np.ndarray, replicates: np.ndarray, simulated: np.ndarray) -> np.ndarray:
    """Scatter (n,) of one replicate, from that of a few and the simulation's.

    The two are pooled, unless the replicates' own is larger by more than chance (Fisher's F).
    Always to take the larger one would pad the errors: by a fifth with five replicates. own,
    replicates, simulated : (n,), scatters in the observables' units.
    """
    degrees = np.where(own > 0, replicates - 1, 0)
    pooled = (degrees * own**2 + PRIOR_DEGREES * simulated**2) / (degrees + PRIOR_DEGREES)
    p = stats.f.sf((own / simulated) ** 2, np.maximum(degrees, 1), PRIOR_DEGREES)
    return np.asarray(np.where((degrees > 0) & (p < LARGER), own, np.sqrt(pooled)))


def require_effect(nuisance: Nuisance, effects: Sequence[str]) -> None:
    """Raise CalibratorError for a nuisance that is a small effect, but none of these."""
    if nuisance.effect and nuisance.effect not in effects:
        raise CalibratorError(
            f"nuisance {nuisance.name} is a small {nuisance.effect}, which diagnosis.effects"
            " lacks: add it there"
        )


def _nuisance_column(
    nuisance: Nuisance,
    observables: Sequence[Observable],
    slopes: np.ndarray,
    effects: Sequence[Effect],
) -> np.ndarray:
    if nuisance.fixed:
        index = [e.nuisance for e in effects].index(nuisance.observables)
        return np.asarray(slopes[:, index] / WIDE)
    if nuisance.effect:
        names = [e.name for e in effects if not e.nuisance]
        require_effect(nuisance, names)
        index = names.index(nuisance.effect)
        return np.asarray(slopes[:, index] * nuisance.error / effects[index].scale)
    sizes = [abs(o.value) / 100 if nuisance.unit == "%" else 1.0 for o in observables]
    return np.array(
        [
            nuisance.error * s if nuisance.touches(o) else 0.0
            for o, s in zip(observables, sizes, strict=True)
        ]
    )


def distinct(observables: Sequence[Observable], found: Surfaces) -> tuple[list[int], list[str]]:
    """Indices of observables that repeat no others of the run, and a sentence on each that does."""
    scatter = np.sqrt(np.diag(found.noise))
    pairs = repeated(found.noise / np.outer(scatter, scatter))
    left_out = {later for later, _ in pairs}
    sentences = [f"{observables[a].key} repeats {observables[b].key}: left out" for a, b in pairs]
    return [i for i in range(len(observables)) if i not in left_out], sentences
