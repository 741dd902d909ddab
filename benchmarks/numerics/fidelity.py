"""How many core-hours do cheap runs of a smaller vessel save a calibration?

    python -m benchmarks.numerics.fidelity             some minutes; no run is made
    python -m benchmarks.numerics.fidelity --quick     2 draws instead of 20

From shipped runs (grid/missing_effect.csv, no effect on, restitution 0.9): heaps of 32 pairs of
frictions, from a cylinder of 10 grain diameters (dear, three seeds each) and from one of 7 (cheap,
six seeds each, at a third of the cost). A draw takes dear runs at a few sets and cheap ones at
more, one seed of each, and predicts the dear responses at all other sets by the calibrator's own
processes: from the dear runs alone, and from both. The error is the root
mean square over those sets and over the draws, the noise of the sets' own means taken off. The
costs are those of grains times steps. Writes benchmarks/results/fidelity.json.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.common import asked_for_quick, rounded, write
from benchmarks.numerics.sensitivities import RUNS
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.case.vocabulary import EFFECTS
from calibrator.responses.cokriging import CheapRuns
from calibrator.responses.fit import fit_responses
from calibrator.runs.database import Database

CHEAP, DEAR = 14e-3, 20e-3  # diameters of the cylinder [m]
RESTITUTION = 0.9
NAMES = ("rolling_friction", "sliding_friction")
RESPONSES = ("pile_equivalent_angle_deg", "pile_angle_of_repose_deg", "bulk_density")
ALONE = (5, 6, 8, 10, 12, 16, 20)  # dear runs
TOGETHER = ((3, 8), (3, 16), (4, 16), (4, 28), (6, 16), (6, 26), (8, 24))  # dear and cheap runs


@dataclass(frozen=True, eq=False)
class Pairs:
    """Heaps of both sizes at the same sets (p, 2) of the unit box.

    values : runs (p, r) of one response by diameter; noise : of a run; cost : grains times steps.
    """

    points: np.ndarray
    values: dict[float, np.ndarray]
    noise: dict[float, float]
    cost: dict[float, float]


def pairs(response: str) -> Pairs:
    """The pairs for one response."""
    found: dict[tuple[float, ...], dict[float, list[float]]] = defaultdict(
        lambda: defaultdict(list)
    )
    work: dict[float, list[float]] = defaultdict(list)
    for record in Database.read(RUNS).records.values():
        request = record.request
        plain = not EFFECTS.keys() & request.parameters.keys()
        if request.setup != "conical_pile" or not plain or record.status != "ok":
            continue
        if request.value("restitution") == RESTITUTION:
            size = float(request.value("cylinder_diameter"))
            point = tuple(float(request.value(n)) for n in NAMES)
            found[point][size].append(record.responses[response])
            work[size].append(
                float(record.diagnostics["particles"]) * float(record.diagnostics["steps"])
            )
    whole = {p: own for p, own in found.items() if len(own[CHEAP]) == 6 and len(own[DEAR]) == 3}
    points = np.array(list(whole))
    points = (points - points.min(axis=0)) / np.ptp(points, axis=0)
    values = {size: np.array([own[size] for own in whole.values()]) for size in (CHEAP, DEAR)}
    noise = {size: float(np.sqrt(v.var(axis=1, ddof=1).mean())) for size, v in values.items()}
    return Pairs(points, values, noise, {s: float(np.mean(w)) for s, w in work.items()})


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs of one fidelity: points (n, d) of the unit box, one response (n,), its seed noise."""

    points: np.ndarray
    values: np.ndarray
    noise: float


def drawn(own: Pairs, size: float, sets: np.ndarray, rng: np.random.Generator) -> Runs:
    """One seed at each of some sets."""
    values = own.values[size]
    seeds = rng.integers(values.shape[1], size=len(sets))
    return Runs(own.points[sets], values[sets, seeds], own.noise[size])


def predictor(response: str, runs: Runs, cheap: Runs | None) -> Callable[[np.ndarray], np.ndarray]:
    """Predictions from dear runs, alone or beside cheap ones."""
    parameters = tuple(Parameter(n, 0.0, 1.0) for n in NAMES)
    problem = Problem(parameters, (Target("conical_pile", response, 1.0),))
    inner = fit_responses(
        problem,
        runs.points,
        runs.values[:, None],
        [f"conical_pile.{response}"],
        noise=np.array([runs.noise]),
        cheap=None if cheap is None else CheapRuns(cheap.points, cheap.values[:, None]),
    )
    return lambda points: inner.predict(points)[:, 0]


def left_error(
    own: Pairs, predict: Callable[[np.ndarray], np.ndarray], used: np.ndarray
) -> tuple[float, float]:
    """Mean square error at the sets that no dear run was made at, and the noise in it."""
    others = np.setdiff1d(np.arange(len(own.points)), used)
    seen = own.values[DEAR][others]
    off = predict(own.points[others]) - seen.mean(axis=1)
    return float(np.mean(off**2)), own.noise[DEAR] ** 2 / seen.shape[1]


def spread_sets(own: Pairs, count: int, rng: np.random.Generator) -> np.ndarray:
    """So many sets, far from each other: of 50 choices the one whose nearest two are farthest."""
    tried = [rng.choice(len(own.points), count, replace=False) for _ in range(50)]

    def nearest(sets: np.ndarray) -> float:
        away = np.linalg.norm(own.points[sets][:, None] - own.points[sets], axis=2)
        return float((away + 9 * np.eye(count)).min())

    return max(tried, key=nearest)


def compared(response: str, draws: int) -> dict[str, object]:
    """Errors and costs, in dear runs, of both ways."""
    own, rows = pairs(response), list[dict[str, object]]()
    ratio = own.cost[CHEAP] / own.cost[DEAR]
    for dear, cheap in (*((n, 0) for n in ALONE), *TOGETHER):
        squares = []
        for seed in range(draws):
            rng = np.random.default_rng(seed)
            used = spread_sets(own, dear, rng)
            runs = drawn(own, DEAR, used, rng)
            more = drawn(own, CHEAP, spread_sets(own, cheap, rng), rng) if cheap else None
            squares.append(left_error(own, predictor(response, runs, more), used))
        mean, noise = np.mean(squares, axis=0)
        each = np.sqrt(np.maximum(np.array(squares)[:, 0] - noise, 0))
        rows.append(
            {
                "dear": dear,
                "cheap": cheap,
                "cost_in_dear_runs": rounded(dear + cheap * ratio, 3),
                "error": rounded(np.sqrt(max(mean - noise, 0.0)), 3),
                "middle_half_of_draws": [
                    rounded(q, 2) for q in np.quantile(each, [0.25, 0.75]).tolist()
                ],
            }
        )
    means = [own.values[size].mean(axis=1) for size in (CHEAP, DEAR)]
    return {
        "sets": len(own.points),
        "cost_of_a_cheap_run": rounded(ratio, 3),
        "seed_noise": {"cheap": rounded(own.noise[CHEAP], 3), "dear": rounded(own.noise[DEAR], 3)},
        "spread_of_the_sets": rounded(float(means[1].std()), 3),
        "correlation": rounded(float(np.corrcoef(means)[0, 1]), 3),
        "rows": rows,
    }


def main() -> None:
    """Draw, predict, compare."""
    draws = 2 if asked_for_quick(__doc__, "2 draws instead of 20") else 20
    found = {response: compared(response, draws) for response in RESPONSES}
    about = "heaps of 10 grain diameters predicted with and without runs of 7; cost in dear runs"
    write("fidelity", {"about": about, "draws": draws, **found})


if __name__ == "__main__":
    main()
