"""The verb `calibrate`: from the database to candidates, and to what the data pins down."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence
from functools import partial

import numpy as np

from calibrator.case.case import Case
from calibrator.case.codec import finite
from calibrator.case.experiment import parts_of
from calibrator.case.problem import Problem
from calibrator.case.vocabulary import PARAMETERS
from calibrator.files import packed, write_bytes, write_text
from calibrator.plan.run import cheap_records, confirmed_set, database_records, with_curves
from calibrator.responses.fit import fit
from calibrator.responses.interpolant import (
    FEWEST_DEGREES,
    Interpolant,
    alike_seeds,
    known_noise,
    seed_noise,
)
from calibrator.responses.objectives import evaluation
from calibrator.responses.success import HIGH, Success
from calibrator.responses.table import by_experiment, points_of, response_table
from calibrator.runs.record import Record
from calibrator.runs.workspace import Workspace, counts
from calibrator.search.fidelity import compared, left_out_errors
from calibrator.search.front import compromise, spread
from calibrator.search.identifiability import identify
from calibrator.search.nsga2 import SearchResult, Settings, generational_distance, search
from calibrator.search.outcome import (
    COMPROMISE,
    Calibration,
    Traces,
    arrays_path,
    hash_of,
    rests_on,
)
from calibrator.search.parts import Candidate, Identifiability, Promise, Sensitivity
from calibrator.search.reach import unreachable
from calibrator.search.sensitivity import sensitivity

PARTS = 8  # of the database: each is left out once, for the intervals of the sensitivities
ACCEPTED = 1000  # parameter sets of the accepted region that are kept, for the picture of the ridge
SNAPSHOTS = (0, 1, 2, 3, 20)  # generations whose population is kept, beside the last


def calibrate(space: Workspace) -> Calibration:
    """Interpolate, search the Pareto front, choose candidates, say what the data pins down.

    Leaves front.csv and calibration.npz in the folder of the results, and notes its outcome.
    Raises CalibratorError where the database is too small or has no good run.
    """
    space = with_curves(space)
    case, problem = space.case, space.case.problem
    records = database_records(space)
    cheap = cheap_records(space)
    interpolant = fit(case, records, cheap=cheap)
    success = Success.of(problem, records)
    fronts = search_fronts(case, interpolant, success)
    points, reason = _chosen(space, interpolant, success, fronts[0])
    found = Calibration(
        candidates=_candidates(case, interpolant, points),
        compromise_reason=reason,
        front_size=len(fronts[0].points),
        generational_distance=tuple(
            tuple(map(float, generational_distance(f.fronts, f.fronts[-1]))) for f in fronts
        ),
        seed_noise=_noise(problem, records, interpolant),
        replicated=_replicated(problem, records),
        leave_one_out_rms=left_out_errors(interpolant),
        reachability=unreachable(problem, interpolant, success),
        identifiability=_identified(problem, records, interpolant, success, case.truth),
        sensitivity=_sensitivity(case, records, interpolant, cheap),
        fidelity=compared(case, interpolant, records, cheap),
        unseen=_unseen(problem),
        failures=_failures(success, points),
        arrays=_write_arrays(space, interpolant, fronts[0]),
        fingerprint=rests_on(case, [*records, *cheap]),
        **counts(records),
    )
    return space.note("calibrate", found)


def _unseen(problem: Problem) -> tuple[str, ...]:
    """A sentence for each experiment with a target in which not every parameter varies."""
    found = []
    for experiment in problem.experiments:
        setup, _ = parts_of(experiment)
        own = [n for n in problem.names if setup in PARAMETERS[n].setups]
        lacks = [n for n in problem.names if n not in own]
        held = [n for n in own if n not in problem.seen_by(experiment)]
        for verb, names in (("does not have", lacks), ("fixes", held)):
            if names:
                said = f"{experiment} {verb} {' and '.join(names)}"
                found.append(f"{said}: its responses are interpolated without")
    return tuple(found)


def _failures(success: Success, points: dict[str, np.ndarray]) -> tuple[str, ...]:
    """How runs failed, overall and around each candidate (d,), in words."""
    around = [
        f"{label}: {words}" for label, point in points.items() for words in success.nearest(point)
    ]
    return (*success.sentences, *around)


def search_fronts(case: Case, interpolant: Interpolant, success: Success) -> list[SearchResult]:
    """The search and its repeats with other seeds, among sets that are likely to run."""
    evaluate = evaluation(case.problem, interpolant, case.search.objectives)
    s = case.search
    first = Settings(
        s.population, s.generations, s.crossover, s.mutation, s.seed, (*SNAPSHOTS, s.generations)
    )
    settings = [dataclasses.replace(first, seed=s.seed + i) for i in range(s.repeats)]
    beyond = partial(success.excess, least=HIGH)
    return [search(case.problem, evaluate, own, s.objectives, beyond) for own in settings]


def _chosen(
    space: Workspace, interpolant: Interpolant, success: Success, front: SearchResult
) -> tuple[dict[str, np.ndarray], str]:
    """Parameter sets (d,) of the candidates by label, and why the compromise is one."""
    case, keys = space.case, interpolant.responses
    predicted, error = (
        dict(zip(keys, columns.T, strict=True))
        for columns in interpolant.predict_with_error(front.points)
    )
    noise = dict(zip(keys, map(float, known_noise(interpolant)), strict=True))
    index, reason = compromise(
        case.problem,
        front.objectives,
        predicted,
        error,
        noise,
        case.verify.replicates,
        front.names,
        success.probability(front.points),
    )
    individuals = spread(front.objectives).tolist() if len(front.names) > 1 else []
    points = {f"individual {chr(ord('A') + i)}": front.points[k] for i, k in enumerate(individuals)}
    points[COMPROMISE] = front.points[index]
    if (confirmed := confirmed_set(space)) is not None:
        points[COMPROMISE] = confirmed
        reason = "confirmed by the last runs of the adaptive design"
    return points, reason


def _candidates(
    case: Case, interpolant: Interpolant, points: dict[str, np.ndarray]
) -> dict[str, Candidate]:
    """Parameters, objectives and promised responses of each labelled set (d,)."""
    sets = np.array(list(points.values()))
    objectives = evaluation(case.problem, interpolant, case.search.objectives)(sets)
    mean, error = interpolant.predict_with_error(sets)
    return {
        label: Candidate(
            dict(zip(case.problem.names, map(float, sets[i]), strict=True)),
            dict(zip(case.search.objectives, map(float, objectives[i]), strict=True)),
            {
                key: Promise(float(m), float(e))
                for key, m, e in zip(interpolant.responses, mean[i], error[i], strict=True)
            },
        )
        for i, label in enumerate(points)
    }


def _noise(
    problem: Problem, records: Sequence[Record], interpolant: Interpolant
) -> dict[str, float | None]:
    """Seed noise of a single run by response, also of those held out that the runs measured.

    None where there are too few replicates to say.
    """
    found = dict(zip(interpolant.responses, known_noise(interpolant), strict=True))
    keys = [t.key for t in (*problem.targets, *problem.held_out)]
    pooled, degrees = seed_noise(*response_table(problem, records, keys))
    pooled[degrees < FEWEST_DEGREES] = np.nan
    both = dict(zip(keys, pooled, strict=True)) | found
    return {key: finite(float(noise)) for key, noise in both.items()}


def _replicated(problem: Problem, records: Sequence[Record]) -> tuple[int, int]:
    """Sets of an experiment's own parameters with several good runs, and all with one or more."""
    good = [r for r in records if r.status == "ok"]
    counted = Counter(
        (experiment, *(r.request.value(n) for n in problem.seen_by(experiment)))
        for experiment, own in by_experiment(problem, good).items()
        for r in own
    )
    return sum(count > 1 for count in counted.values()), len(counted)


def _identified(
    problem: Problem,
    records: Sequence[Record],
    interpolant: Interpolant,
    success: Success,
    truth: dict[str, float],
) -> Identifiability:
    """Profiles with the truth of a synthetic laboratory, and as many accepted sets as are drawn."""
    alike = alike_seeds(*response_table(problem, records, interpolant.responses))
    found = identify(problem, interpolant, success, alike=alike)
    profiles = tuple(dataclasses.replace(p, truth=truth.get(p.name)) for p in found.parameters)
    accepted = found.accepted[:: max(1, len(found.accepted) // ACCEPTED)]
    return dataclasses.replace(found, parameters=profiles, accepted=accepted)


def _sensitivity(
    case: Case, records: Sequence[Record], interpolant: Interpolant, cheap: Sequence[Record]
) -> Sensitivity:
    """Sobol indices of the targets' responses.

    On a grid, which must stay whole, without the part of their intervals for the choice of sets.
    """
    names = case.problem.names
    points = np.nan_to_num(points_of(case.problem, [r.request for r in records]))
    sets, own = np.unique(points, axis=0, return_inverse=True)
    folds: list[Interpolant] = []
    if case.interpolation.method == "process" and len(sets) >= 3 * (len(names) + 2):
        for left_out in range(PARTS):
            inside = own % PARTS != left_out
            kept = [record for record, inner in zip(records, inside, strict=True) if inner]
            folds.append(fit(case, kept, cheap=cheap))
    return sensitivity(case.problem, interpolant, folds)


def _write_arrays(space: Workspace, interpolant: Interpolant, front: SearchResult) -> str:
    """Write front.csv and calibration.npz; returns the hash of the latter."""
    problem, folder = space.case.problem, space.folder()
    header = [*problem.names, *front.names, *(t.key for t in problem.targets)]
    mean = interpolant.predict(front.points)
    table = np.column_stack([front.points, front.objectives, mean])
    rows = [",".join(header), *(",".join(map(repr, map(float, row))) for row in table)]
    write_text(folder / "front.csv", "\n".join(rows) + "\n")
    snapshots = {g: objectives for g, (_, objectives) in front.snapshots.items()}
    learnt = interpolant.learnt
    traces = Traces(front.points, front.objectives, snapshots, learnt.kernels, learnt.noise)
    raw = packed(traces.named())
    write_bytes(arrays_path(space), raw)
    return hash_of(raw)
