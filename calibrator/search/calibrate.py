"""The verbs in workflow order.

Each takes a Workspace, does one step, and leaves a machine-readable summary.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.case.case import Case
from calibrator.files import write_text
from calibrator.plan.run import confirmed_set, database_records
from calibrator.responses.fit import fit
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.objectives import evaluation
from calibrator.runs.record import Record
from calibrator.runs.workspace import Workspace, counts
from calibrator.search.front import compromise, spread
from calibrator.search.nsga2 import SearchResult, Settings, generational_distance, search
from calibrator.search.outcome import candidates_of, identified, reached
from calibrator.search.reach import unreachable
from calibrator.search.sensitivity import sensitivity

PARTS = 8  # of the database: each is left out once, for the intervals of the sensitivities


def search_fronts(case: Case, interpolant: Interpolant) -> list[SearchResult]:
    """The search and its repeats with other seeds."""
    evaluate = evaluation(case.problem, interpolant, case.search.objectives)
    s = case.search
    return [
        search(
            case.problem,
            evaluate,
            Settings(
                s.population,
                s.generations,
                s.crossover,
                s.mutation,
                s.seed + i,
                (0, 1, 2, 3, 20, s.generations),
            ),
            s.objectives,
        )
        for i in range(s.repeats)
    ]


def calibrate(space: Workspace) -> dict[str, Any]:
    """Interpolate, search the Pareto front, choose the spread individuals and the compromise, say
    what the data pins down.
    """
    case, problem = space.case, space.case.problem
    records = database_records(space)
    interpolant = fit(case, records)
    fronts = search_fronts(case, interpolant)
    front = fronts[0]
    mean, error = interpolant.predict_with_error(front.points)
    keys = interpolant.responses
    noise = dict(zip(keys, map(float, interpolant.noise), strict=True))
    by_key = [dict(zip(keys, columns.T, strict=True)) for columns in (mean, error)]
    chosen, reason = compromise(
        problem, front.objectives, by_key[0], by_key[1], noise, case.verify.replicates
    )
    individuals = spread(front.objectives).tolist() if len(front.names) > 1 else []
    points = {
        f"individual {chr(ord('A') + i)}": front.points[index]
        for i, index in enumerate(individuals)
    }
    points["compromise"] = front.points[chosen]
    confirmed = confirmed_set(space)
    if confirmed is not None:
        points["compromise"], reason = (
            confirmed,
            "confirmed by the last runs of the adaptive design",
        )
    loo, _ = interpolant.leave_one_out()
    _write_front(space.folder() / "front.csv", case, front, mean)
    return space.note(
        "calibrate",
        {
            "candidates": candidates_of(case, interpolant, points),
            "compromise_reason": reason,
            "front_size": len(front.points),
            "generational_distance": [
                [float(g) for g in generational_distance(f.fronts, f.fronts[-1])] for f in fronts
            ],
            "seed_noise": noise,
            "leave_one_out_rms": _rms(loo - interpolant.values, interpolant.responses),
            "reachability": reached(unreachable(problem, interpolant)),
            "identifiability": identified(problem, interpolant, case.truth),
            "sensitivity": _sensitivity(case, records, interpolant),
            **counts(records),
        },
    )


def _rms(residual: np.ndarray, keys: Sequence[str]) -> dict[str, float]:
    return {k: float(np.sqrt(np.nanmean(residual[:, i] ** 2))) for i, k in enumerate(keys)}


def _sensitivity(case: Case, records: Sequence[Record], interpolant: Interpolant) -> dict[str, Any]:
    """Sobol indices of the targets' responses; on a grid, which must stay whole, without the part
    for the choice of sets.
    """
    sets = sorted({tuple(r.request.value(n) for n in case.problem.names) for r in records})
    part = {one: i % PARTS for i, one in enumerate(sets)}
    folds: list[Interpolant] = []
    if case.interpolation.method == "process" and len(sets) >= 3 * (len(case.problem.names) + 2):
        for left_out in range(PARTS):
            kept = [
                r
                for r in records
                if part[tuple(r.request.value(n) for n in case.problem.names)] != left_out
            ]
            folds.append(fit(case, kept))
    found = sensitivity(case.problem, interpolant, folds)
    arrays = {
        k: getattr(found, k).tolist() for k in ("first", "total", "first_error", "total_error")
    }
    return {"responses": found.responses, "parameters": found.parameters, **arrays}


def _write_front(path: Path, case: Case, front: SearchResult, mean: np.ndarray) -> None:
    header = [*case.problem.names, *front.names, *(t.key for t in case.problem.targets)]
    table = np.column_stack([front.points, front.objectives, mean])
    write_text(
        path,
        "\n".join([",".join(header), *(",".join(map(repr, map(float, row))) for row in table)])
        + "\n",
    )
