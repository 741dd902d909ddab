"""Do the profile intervals hold the truth as often as they claim?

    python -m benchmarks.numerics.coverage             writes benchmarks/results/coverage.json
    python -m benchmarks.numerics.coverage --quick     8 truths instead of 100

Synthetic truths on the reduced paper case's own responses. A truth is drawn from the box; its
responses are drawn as the interpolant knows them (mean and standard deviation), a measurement of
each is drawn about them with the error that the case assumes, and the profiles are taken. An
interval of 68 or 95 % should hold its parameter in as many cases.
"""

import dataclasses
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from benchmarks.common import asked_for_quick, write
from calibrator.case.problem import Problem
from calibrator.case.toml import read_case
from calibrator.plan.run import database_records
from calibrator.responses.fit import fit
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.targets import target_columns, target_errors
from calibrator.runs.workspace import Workspace
from calibrator.search.identifiability import identify

REPO = Path(__file__).resolve().parents[2]
CASE = REPO / "cases" / "quartz_sand_reduced.toml"
SAMPLES, POSITIONS = 2**12, 21  # of `identify`: a quarter of what a calibration uses


def measured(
    problem: Problem, interpolant: Interpolant, truth: np.ndarray, rng: np.random.Generator
) -> Problem:
    """The problem with targets measured at a truth (d,)."""
    columns, (errors, _) = target_columns(problem, interpolant.responses), target_errors(problem)
    mean, std = (a[0, columns] for a in interpolant.predict_with_error(truth[None]))
    values = mean + np.hypot(std, errors) * rng.standard_normal(len(errors))
    targets = tuple(
        dataclasses.replace(t, value=float(v), scatter=float(e), replicates=1)
        for t, v, e in zip(problem.targets, values, errors, strict=True)
    )
    return dataclasses.replace(problem, targets=targets)


def wilson(hits: int, trials: int) -> dict[str, object]:
    """Share of hits with its 95 % Wilson interval."""
    interval = binomtest(hits, trials).proportion_ci(method="wilson")
    return {"share": hits / trials, "interval_95": [float(interval.low), float(interval.high)]}


def main() -> None:
    """Draw, profile, count."""
    trials = 8 if asked_for_quick(__doc__, "8 truths instead of 100") else 100
    case = read_case(CASE)
    space = Workspace(case, REPO / "results" / case.name)
    interpolant, problem, rng = (
        fit(case, database_records(space)),
        case.problem,
        np.random.default_rng(1),
    )
    held = {level: np.zeros(len(problem.names), int) for level in ("68", "95")}
    pinned = np.zeros(len(problem.names), int)
    for truth in problem.low + (problem.high - problem.low) * rng.random(
        (trials, len(problem.names))
    ):
        found = identify(
            measured(problem, interpolant, truth, rng),
            interpolant,
            samples=SAMPLES,
            positions=POSITIONS,
        ).parameters
        for level, count in held.items():
            intervals = [getattr(p, f"interval_{level}") for p in found]
            count += [
                low <= value <= high for value, (low, high) in zip(truth, intervals, strict=True)
            ]
        pinned += [p.pinned for p in found]
    write(
        "coverage",
        {
            "about": f"{trials} synthetic truths on the interpolant of {case.name}",
            "trials": trials,
            "parameters": {
                name: {
                    "held_by_68": wilson(int(held["68"][i]), trials),
                    "held_by_95": wilson(int(held["95"][i]), trials),
                    "pinned": pinned[i] / trials,
                }
                for i, name in enumerate(problem.names)
            },
        },
    )


if __name__ == "__main__":
    main()
