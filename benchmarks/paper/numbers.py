"""Blocks of statistics: interpolation, coverage, sensitivity, similarity."""

from typing import Any

import numpy as np

from benchmarks.paper.sources import GRID, Sources, table, workspace
from calibrator.case.problem import Problem
from calibrator.case.toml import read_case
from calibrator.plan.requests import design_points
from calibrator.plan.run import database_records
from calibrator.responses.coordinates import Coordinates
from calibrator.responses.fit import fit_responses
from calibrator.responses.table import response_table

HELD = ("held_by_68", "held_by_95")
FOLDS = 8


def cross_validated(sources: Sources) -> dict[str, dict[str, float]]:
    """{method: {response: rms error over the response's standard deviation}} on unseen runs.

    The grid is at the mean density of the box: with similarity it speaks for all densities, up to
    the moduli that it covers. A grid point whose runs all clogged has no rate: runs in the cells
    around it are left out of the comparison.
    """
    problem, keys = sources.case.problem, [t.key for t in sources.case.problem.targets]
    records = database_records(workspace(GRID))
    grid_points, grid_values = response_table(problem, records, keys)
    asked = np.unique([[float(r.request.value(n)) for n in problem.names] for r in records], axis=0)
    if len(asked) < len(design_points(read_case(GRID))):
        raise FileNotFoundError(f"{GRID.name} has not been run to its end")
    holes = np.array([one for one in asked if not (grid_points == one).all(axis=1).any()]).reshape(
        -1, len(problem.names)
    )
    points, values = response_table(problem, database_records(sources.space), keys)
    stiffness = Coordinates(problem, collapsed=True).inward(points)[:, -1]
    covered = Coordinates(problem, collapsed=True).inward(grid_points)[:, -1]
    within = (stiffness >= covered.min()) & (stiffness <= covered.max())
    full_points = np.vstack([grid_points, holes])
    is_hole = (np.arange(len(full_points)) >= len(grid_points)).astype(float)[:, None]
    near_hole = fit_responses(
        problem, full_points, is_hole, keys[:1], "multilinear", similarity=True
    )
    points, values = points[within], values[within]
    apart = near_hole.predict(points)[:, 0] == 0
    points, values = points[apart], values[apart]
    # nothing asks there
    filled_in = np.vstack(
        [grid_values, np.repeat(grid_values.mean(axis=0)[None], len(holes), axis=0)]
    )
    found = {}
    for method, words in (("multilinear", "multilinear"), ("process", "Gaussian process")):
        runs = (full_points, filled_in) if method == "multilinear" else (grid_points, grid_values)
        model = fit_responses(problem, *runs, keys, method, similarity=True)
        found[f"{words} on the grid's {len(grid_points)} runs"] = model.predict(points)
    found[f"Gaussian process on {FOLDS - 1} of {FOLDS} parts of the Sobol runs"] = _by_folds(
        problem, points, values, keys
    )
    return {name: _rms(values, predicted, keys) for name, predicted in found.items()}


def _by_folds(
    problem: Problem, points: np.ndarray, values: np.ndarray, keys: list[str]
) -> np.ndarray:
    """Prediction of each run by a process without its part of the sets."""
    _, group = np.unique(points, axis=0, return_inverse=True)
    predicted = np.full_like(values, np.nan)
    for fold in range(FOLDS):
        out = group % FOLDS == fold
        predicted[out] = fit_responses(
            problem, points[~out], values[~out], keys, similarity=True
        ).predict(points[out])
    return predicted


def _rms(values: np.ndarray, predicted: np.ndarray, keys: list[str]) -> dict[str, float]:
    scatter = np.nanstd(values, axis=0)
    return dict(
        zip(
            keys,
            (np.sqrt(np.nanmean((predicted - values) ** 2, axis=0)) / scatter).tolist(),
            strict=True,
        )
    )


def interpolation_block(sources: Sources) -> str:
    """Multilinear against Gaussian process."""
    found = cross_validated(sources)
    keys = [t.key for t in sources.case.problem.targets]
    noise, records = sources.summary["calibrate"]["seed_noise"], database_records(sources.space)
    _, values = response_table(sources.case.problem, records, keys)
    found["seed noise of one run, the least that can be left"] = {
        k: noise[k] / float(np.nanstd(values[:, i])) for i, k in enumerate(keys)
    }
    rows = [[name, *(f"{own[k]:.0%}" for k in keys)] for name, own in found.items()]
    head = [
        "rms error of a run, over the scatter of all runs",
        *(k.split(".")[1].replace("_", " ") for k in keys),
    ]
    return table(head, rows)


def coverage_block(sources: Sources) -> str:
    """How often the intervals hold the truth, and how often they pin a parameter."""
    found = sources.measured("coverage")
    rows = [
        [
            name.replace("_", " "),
            *(
                f"{own[k]['share']:.0%}"
                f" ({own[k]['interval_95'][0]:.0%}-{own[k]['interval_95'][1]:.0%})"
                for k in HELD
            ),
            f"{own['pinned']:.0%}",
        ]
        for name, own in found["parameters"].items()
    ]
    head = ["parameter", "held by 68 % intervals", "held by 95 % intervals", "pinned down"]
    return (
        table(head, rows)
        + f"\n\n{found['trials']} synthetic truths; in brackets the 95 % interval of the share."
    )


def sensitivity_block(sources: Sources) -> str:
    """Total Sobol indices."""
    found = sources.summary["calibrate"]["sensitivity"]
    rows = [
        [
            name.replace("_", " "),
            *(
                f"{found['total'][i][j]:.2f} ± {found['total_error'][i][j]:.2f}"
                for i in range(len(found["responses"]))
            ),
        ]
        for j, name in enumerate(found["parameters"])
    ]
    return table(
        ["total Sobol index", *(k.split(".")[1].replace("_", " ") for k in found["responses"])],
        rows,
    )


def similarity_block(sources: Sources) -> str:
    """Pairs that similarity calls the same."""
    measured = sources.measured("similarity")

    def differences(own: dict[str, Any]) -> list[str]:
        return [f"{d['difference']:+.1%} ± {d['standard_error']:.1%}" for d in own.values()]

    rows = [
        [label, "every bit" if own["exact"] else "NO", *differences(own["in_use"])]
        for label, own in measured["sets"].items()
    ]
    rows.append(["mean", "", *differences(measured["in_use_mean"])])
    head = ["friction", "all doubled: equal", "density", "equivalent angle", "rate"]
    return table(head, rows)
