"""Cost of an adaptive design, with and without cheap runs, until it confirms a set.

    python -m benchmarks.numerics.fidelity_race             half an hour; no run is made
    python -m benchmarks.numerics.fidelity_race --quick     2 truths instead of 10

A run is a quadratic surface through the real runs of each kind (the pairs of heaps of fidelity.py:
from a cylinder of 10 grain diameters, and cheap ones from one of 7), plus normal noise of the size
that their replicates show. Each truth is a set of frictions from the central 80 % of the ranges,
its full responses are the targets, an angle within 2 % and a density within 0.5 %. Both designs are
the calibrator's own (plan/adaptive.py): one starts with 6 full sets, the other with 3 full and 12
cheap ones. They stop by their own verification; what they confirmed is judged by the noise-free
surface, which they never see. Costs are in full runs, at what the cheap ones cost, and at what they
would cost were they a sixteenth, as coarser grains of twice the size are: the designs are run again
for that, as they choose by cost. Writes benchmarks/results/fidelity_race.json.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.common import asked_for_quick, rounded, write
from benchmarks.numerics.fidelity import CHEAP, DEAR, NAMES, pairs
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.plan.adaptive import Settings, propose
from calibrator.plan.design import sobol
from calibrator.plan.proposal import Cheaper
from calibrator.responses.cokriging import CheapRuns

RESPONSES = {"pile_equivalent_angle_deg": 0.02, "bulk_density": 0.005}
REPLICATES, MOST = 3, 80
ALONE, FULL, CHEAP_SETS = 6, 3, 12
SIXTEENTH = 1 / 16


@dataclass(frozen=True, eq=False)
class Worlds:
    """Noise-free responses of both kinds by points (k, 2), noise of a run (2,), cost of a cheap."""

    full: Callable[[np.ndarray], np.ndarray]
    cheap: Callable[[np.ndarray], np.ndarray]
    noise: np.ndarray
    cheap_noise: np.ndarray
    cost: float


def quadratic(points: np.ndarray, values: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """The least-squares quadratic of values (n, m) over points (n, 2)."""

    def terms(x: np.ndarray) -> np.ndarray:
        a, b = x.T
        return np.column_stack([np.ones(len(x)), a, b, a * a, a * b, b * b])

    weights = np.linalg.lstsq(terms(points), values, rcond=None)[0]
    return lambda x: np.asarray(terms(np.atleast_2d(x)) @ weights)


def worlds() -> Worlds:
    """The surfaces through the real runs."""
    own = [pairs(response) for response in RESPONSES]
    points = own[0].points

    def surface(size: float) -> Callable[[np.ndarray], np.ndarray]:
        return quadratic(points, np.column_stack([p.values[size].mean(axis=1) for p in own]))

    full, cheap = (np.array([p.noise[size] for p in own]) for size in (DEAR, CHEAP))
    return Worlds(
        surface(DEAR), surface(CHEAP), full, cheap, own[0].cost[CHEAP] / own[0].cost[DEAR]
    )


def problem_for(wanted: np.ndarray, noise: np.ndarray) -> Problem:
    """Two frictions on the unit box, and the full responses (2,) of a truth as targets."""
    targets = tuple(
        Target("conical_pile", n, float(v), float(s), 5, tolerance=t)
        for (n, t), v, s in zip(RESPONSES.items(), wanted, noise, strict=True)
    )
    return Problem(tuple(Parameter(n, 0.0, 1.0) for n in NAMES), targets)


def raced(world: Worlds, seed: int, cost: float | None) -> dict[str, object]:
    """One design on one truth; cost : of a cheap run, None for a design without them."""
    rng = np.random.default_rng(seed)
    truth = 0.1 + 0.8 * rng.random((1, 2))
    problem = problem_for(world.full(truth)[0], world.noise)

    def run(points: np.ndarray, cheap: bool) -> tuple[np.ndarray, np.ndarray]:
        mean = (world.cheap if cheap else world.full)(points)
        noise = world.cheap_noise if cheap else world.noise
        return points, mean + noise * rng.normal(size=mean.shape)

    def start(sets: int, cheap: bool) -> tuple[np.ndarray, np.ndarray]:
        first = sobol(problem, sets)
        return run(np.vstack([first, *[first[:2]] * (REPLICATES - 1)]), cheap)

    points, values = start(ALONE if cost is None else FULL, False)
    low, low_values = start(CHEAP_SETS, True) if cost is not None else (points[:0], values[:0])
    settings = Settings(replicates=REPLICATES, budget=MOST)
    while True:
        cheaper = None if cost is None else Cheaper(CheapRuns(low, low_values), cost)
        proposal = propose(
            problem, points, values, settings, left=MOST - len(points) - len(low), cheaper=cheaper
        )
        if proposal.stops:
            break
        new, found = run(proposal.points, proposal.cheap)
        if proposal.cheap:
            low, low_values = np.vstack([low, new]), np.vstack([low_values, found])
        else:
            points, values = np.vstack([points, new]), np.vstack([values, found])
    off = np.abs(world.full(proposal.recommended)[0] / world.full(truth)[0] - 1)
    band = np.maximum(list(RESPONSES.values()), 2 * world.noise / 3**0.5 / world.full(truth)[0])
    good = proposal.kind == "confirmed" and bool((off <= band).all())
    return {
        "full": len(points),
        "cheap": len(low),
        "cost": len(points) + (cost or 0.0) * len(low),
        "ended": proposal.kind,
        "good": good,
    }


def row(outcomes: list[dict[str, object]]) -> dict[str, object]:
    """Counts and quartiles over the truths."""
    costs = np.array([o["cost"] for o in outcomes], float)
    return {
        "confirmed_and_right": sum(bool(o["good"]) for o in outcomes),
        "of": len(outcomes),
        "cost_in_full_runs": [
            rounded(q, 3) for q in np.quantile(costs, [0.25, 0.5, 0.75]).tolist()
        ],
        "full_runs": rounded(float(np.median([o["full"] for o in outcomes])), 3),
        "cheap_runs": rounded(float(np.median([o["cheap"] for o in outcomes])), 3),
    }


def main() -> None:
    """Race, and write."""
    truths = 2 if asked_for_quick(__doc__, "2 truths instead of 10") else 10
    world, found = worlds(), dict[str, object]()
    alone = [raced(world, seed, None) for seed in range(truths)]
    found["without"] = row(alone)
    for label, cost in (("with", world.cost), ("with_at_a_sixteenth", SIXTEENTH)):
        own = [raced(world, seed, cost) for seed in range(truths)]
        ratios = [float(a["cost"]) / float(b["cost"]) for a, b in zip(own, alone, strict=True)]
        middle = np.median(np.random.default_rng(0).choice(ratios, (2000, truths)), axis=1)
        found[label] = {
            **row(own),
            "cost_of_a_cheap_run": rounded(cost, 3),
            "ratio_to_without": rounded(float(np.median(ratios)), 3),
            "interval_95": [rounded(q, 3) for q in np.quantile(middle, [0.025, 0.975]).tolist()],
        }
    about = (
        "cost of an adaptive design until it confirms a set, in full runs; quartiles over truths"
    )
    write("fidelity_race", {"about": about, "truths": truths, **found})


if __name__ == "__main__":
    main()
