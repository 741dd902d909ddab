"""Do the intervals of a calibration hold the parameters of runs that the interpolant has not seen?

    python -m benchmarks.numerics.left_out_coverage     writes left_out_coverage.json
    python -m benchmarks.numerics.left_out_coverage --quick     4 sets of each instead of all

Each parameter set of a shipped database is taken out in turn: its runs of YADE are a laboratory
whose parameters are known, and the rest is the database. The lengths of the kernels are those of
all runs. The targets are the means of its runs, with the scatter that runs of equal parameters
have. Unlike coverage.py, which draws its truths from the interpolant, this asks whether the
interpolant is right. Intervals of 95 % are judged of both frictions of small heaps, hourglasses and
ledges, by three targets of one hourglass and by six of three set-ups, and of the five parameters of
the reduced paper case. A set at the edge of the box is left without neighbours.
"""

import dataclasses
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import asked_for_quick, write
from calibrator.case.case import Case
from calibrator.case.problem import Problem, Target
from calibrator.case.toml import read_case
from calibrator.plan.requests import belongs
from calibrator.responses.fit import fit_responses
from calibrator.responses.interpolant import alike_seeds, seed_noise
from calibrator.responses.table import response_table
from calibrator.runs.database import Database
from calibrator.search.identifiability import identify
from calibrator.search.parts import Identifiability
from tests.campaigns.hidden.intervals import exact

REPO = Path(__file__).resolve().parents[2]
SAMPLES, POSITIONS = 2**12, 21  # of `identify`: a quarter of what a calibration uses
OTHERS = (  # further targets of the small set-ups
    ("ledge", "ledge_equivalent_angle_deg"),
    ("conical_pile", "pile_equivalent_angle_deg"),
    ("conical_pile", "pile_apex_rounding"),
)
INNER = (0.1, 0.9)  # shares of the ranges beyond which the margin of the box begins


def laboratories(
    case: Case, targets: Sequence[Target], most: int | None
) -> Iterator[dict[str, Any]]:
    """What is said of each set that is left out."""
    problem = dataclasses.replace(case.problem, targets=tuple(targets))
    records = Database.read(REPO / "grid" / f"{case.name}.csv").records.values()
    own = [r for r in records if belongs(dataclasses.replace(case, problem=problem), r.request)]
    keys = [t.key for t in targets]
    points, values = response_table(problem, own, keys)
    noise, _ = seed_noise(points, values)
    alike = alike_seeds(points, values)
    learnt = fit_responses(problem, points, values, keys).learnt
    sets = np.unique(points, axis=0)
    for truth in sets[:most]:
        here = (points == truth).all(axis=1)
        seen = values[here]
        if np.isnan(seen).all(axis=0).any():
            continue
        measured = dataclasses.replace(
            problem,
            targets=tuple(
                dataclasses.replace(
                    t,
                    value=float(np.nanmean(v)),
                    scatter=float(n),
                    replicates=int(np.isfinite(v).sum()),
                )
                for t, v, n in zip(targets, seen.T, noise, strict=True)
            ),
        )
        rest = fit_responses(problem, points[~here], values[~here], keys, learnt=learnt)
        found = identify(measured, rest, samples=SAMPLES, positions=POSITIONS, alike=alike)
        yield row(problem, truth, found)


def row(problem: Problem, truth: np.ndarray, found: Identifiability) -> dict[str, Any]:
    """Where a set lies, and whether each interval holds its parameter."""
    units = problem.shares_of(truth[None])[0]
    return {
        "inner": bool(((units >= INNER[0]) & (units <= INNER[1])).all()),
        "refused": found.refused,
        "parameters": {
            p.name: {
                "truth": float(value),
                "interval": list(map(float, p.interval_95)),
                "held": bool(p.interval_95[0] <= value <= p.interval_95[1]),
            }
            for p, value in zip(found.parameters, truth, strict=True)
        },
    }


def counted(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """How many sets each parameter's interval holds, with the exact interval of the share."""
    good = [r["parameters"] for r in rows if not r["refused"]]
    names = list(good[0]) if good else []
    held = {name: sum(r[name]["held"] for r in good) for name in names}
    return {
        "sets": len(rows),
        "refused": len(rows) - len(good),
        **{
            name: {"held": n, "of": len(good), "interval_95": exact(n, len(good))}
            for name, n in held.items()
        },
    }


def main() -> None:
    """Leave out, calibrate, count."""
    most = 4 if asked_for_quick(__doc__, "4 sets of each instead of all") else None
    small, reduced = (
        read_case(REPO / "cases" / f"{n}.toml") for n in ("missing_effect", "quartz_sand_reduced")
    )
    more = [Target(setup, response, 1.0) for setup, response in OTHERS]
    asked = {
        "small hourglass": (small, small.problem.targets),
        "small hourglass, ledge and heap": (small, (*small.problem.targets, *more)),
        "reduced paper case": (reduced, reduced.problem.targets),
    }
    found = {}
    for name, (case, targets) in asked.items():
        rows = []
        for one in laboratories(case, targets, most):
            rows.append(one)
            print(name, one, file=sys.stderr)
        found[name] = {
            "every_set": counted(rows),
            "off_the_margin": counted([r for r in rows if r["inner"]]),
            "by_set": rows,
        }
    write("left_out_coverage", found)


if __name__ == "__main__":
    main()
