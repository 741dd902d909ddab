"""Our genetic search against pymoo's NSGA-II with the same operators, and its growth.

    python -m benchmarks.numerics.nsga2            some minutes
    python -m benchmarks.numerics.nsga2 --quick    small populations, prints only: a smoke test

Writes benchmarks/results/nsga2.json and nsga2.png. The setting is the reference paper's: population
5000, 100 generations, 5 parameters of 8 bits, 2 objectives, evaluated on Gaussian processes through
60 made-up parameter sets. Both searches draw the same random numbers in the same order, so their
fronts are compared for equality; the hypervolumes would show a difference if there were one. The
oracle has pymoo's own algorithm, survival, mating loop, tournament selection and bit flips; its
crossover and its elimination of duplicates are vectorised, as pymoo's own would be slower still.
That is measured too, over fewer generations ("stock_operators").
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import moocore
import numpy as np

from benchmarks.common import (
    ABOUT,
    RESPONSES,
    RESULTS,
    asked_for_quick,
    fitted,
    paper_problem,
    power,
    rounded,
    seconds_of,
    write,
)
from benchmarks.numerics.pymoo_oracle import search_with_pymoo
from calibrator.case.problem import Problem
from calibrator.responses.objectives import OBJECTIVES, evaluation, objective
from calibrator.search import nsga2
from calibrator.search.nsga2 import Evaluate, Settings

SEEDS = (1, 2, 3)
OBJECTIVE_NAMES = ("error", "time_cost", "rayleigh_cost", "first_error", "last_error")
STEPS = {"evaluation": None, "sorting": "_survivors", "variation": "_children"}


def register_more_objectives() -> None:
    """Objectives beyond the built-in three: relative errors of single targets."""
    for name, key in (("first_error", RESPONSES[0]), ("last_error", RESPONSES[-1])):

        def one_error(problem: Problem, columns: Any, responses: Any, key: str = key) -> np.ndarray:
            target = next(t for t in problem.targets if t.key == key)
            return np.abs(responses[key] / target.value - 1)

        if name not in OBJECTIVES:
            objective(name, symbol=name, about=f"relative error of {key}")(one_error)


@contextmanager
def stopwatch(spent: dict[str, float]) -> Iterator[Callable[[str, Callable], Callable]]:
    """Time the steps of our search into spent; yields what wraps a further function."""

    def timed(step: str, function: Callable) -> Callable:
        def call(*args: Any) -> Any:
            begin = time.perf_counter()
            try:
                return function(*args)
            finally:
                spent[step] = spent.get(step, 0) + time.perf_counter() - begin

        return call

    originals = {name: getattr(nsga2, name) for name in STEPS.values() if name}
    for step, name in STEPS.items():
        if name:
            setattr(nsga2, name, timed(step, originals[name]))
    try:
        yield timed
    finally:
        for name, original in originals.items():
            setattr(nsga2, name, original)


def hypervolumes(fronts: Sequence[np.ndarray]) -> list[float]:
    """Hypervolume of each front to one reference, a tenth of the range beyond the worst."""
    every = np.concatenate(fronts)
    reference = every.max(axis=0) + 0.1 * np.ptp(every, axis=0)
    return [moocore.hypervolume(front, ref=reference) for front in fronts]


def compare(
    problem: Problem, evaluate: Evaluate, settings: Settings, stock_operators: bool = False
) -> dict[str, Any]:
    """Ours and pymoo's in turn with the same seed."""
    names = OBJECTIVE_NAMES[:2]
    seconds, ours = seconds_of(lambda: nsga2.search(problem, evaluate, settings, names))
    pymoo_seconds, theirs = seconds_of(
        lambda: search_with_pymoo(problem, evaluate, settings, names, stock_operators)
    )
    volume, pymoo_volume = hypervolumes([ours.objectives, theirs.objectives])
    return {
        "seed": settings.seed,
        "seconds": rounded(seconds),
        "pymoo_seconds": rounded(pymoo_seconds),
        "speedup": rounded(pymoo_seconds / seconds),
        "hypervolume_ratio": float(volume / pymoo_volume),
        "equal_fronts": all(
            np.array_equal(a, b) for a, b in zip(ours.fronts, theirs.fronts, strict=True)
        ),
    }


def shares(problem: Problem, evaluate: Evaluate, settings: Settings) -> dict[str, float]:
    """Share of each step in the time of our search; the rest is its bookkeeping."""
    spent: dict[str, float] = {}
    with stopwatch(spent) as timed:
        total = seconds_of(lambda: nsga2.search(problem, timed("evaluation", evaluate), settings))[
            0
        ]
    return {step: rounded(spent[step] / total, 3) for step in STEPS}


def grow(
    problem: Problem, interpolant: Any, population: int, count: int, generations: int
) -> dict[str, Any]:
    """Both searches with so many individuals and objectives, with evaluation taken out as well."""
    names, settings = OBJECTIVE_NAMES[:count], Settings(population, generations)
    evaluate = evaluation(problem, interpolant, names)
    row: dict[str, Any] = {"population": population, "objectives": count}
    found = []
    for key, function in (("", nsga2.search), ("pymoo_", search_with_pymoo)):
        spent: dict[str, float] = {}
        with stopwatch(spent) as timed:
            seconds, result = seconds_of(
                partial(function, problem, timed("evaluation", evaluate), settings, names)
            )
        row |= {
            f"{key}seconds": rounded(seconds),
            f"{key}seconds_without_evaluation": rounded(seconds - spent["evaluation"]),
        }
        found.append(result.objectives)
    row |= {
        "speedup": rounded(row["pymoo_seconds"] / row["seconds"]),
        "equal_fronts": np.array_equal(*found),
    }
    print(row)
    return row


def measure(quick: bool) -> dict[str, Any]:
    """All results; quick ones mean nothing."""
    problem = paper_problem()
    interpolant = fitted(problem, 60)
    register_more_objectives()
    evaluate = evaluation(problem, interpolant, OBJECTIVE_NAMES[:2])
    population, generations, growth_generations = (100, 5, 3) if quick else (5000, 100, 20)
    rows = []
    for seed in SEEDS:
        rows.append(compare(problem, evaluate, Settings(population, generations, seed=seed)))
        print(rows[-1])
    stock = compare(
        problem, evaluate, Settings(population, growth_generations), stock_operators=True
    )
    print(stock)
    sizes = [50, 100] if quick else [500, 5000, 50000]
    by_population = [grow(problem, interpolant, size, 2, growth_generations) for size in sizes]
    by_objectives = [
        grow(problem, interpolant, 100 if quick else 2000, k, growth_generations)
        for k in (2, 3, 4, 5)
    ]
    ratios = [row["hypervolume_ratio"] for row in rows]
    return {
        "about": (
            f"population {population}, {generations} generations, 5 parameters of 8 bits, 2"
            " objectives; speedup = pymoo's time / ours, evaluation included in both, one thread"
        ),
        "interpolant": f"GaussianProcess through 60 sets; {ABOUT}",
        "speedup": statistics.median(row["speedup"] for row in rows),
        "hypervolume_ratio": {"each": ratios, "median": statistics.median(ratios)},
        "equal_fronts": all(row["equal_fronts"] for row in rows),
        "share_of_time": shares(problem, evaluate, Settings(population, generations)),
        "by_seed": rows,
        "stock_operators": {
            "about": (
                f"pymoo's own crossover, tournament and duplicates; {growth_generations}"
                " generations; its crossover draws other random numbers, so the fronts differ as"
                " those of two seeds do"
            ),
            **stock,
        },
        "growth": {
            "generations": growth_generations,
            "population": by_population,
            "power_of_population": rounded(
                power(sizes, [row["seconds"] for row in by_population]), 3
            ),
            "objectives": by_objectives,
        },
    }


def plot(results: dict[str, Any]) -> None:
    """Time over population and over objectives, ours and pymoo's."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    generations = results["growth"]["generations"]
    for axis, key in zip(axes, ("population", "objectives"), strict=True):
        rows = results["growth"][key]
        for label, column, style in (
            ("pymoo, same operators", "pymoo_seconds", "s-"),
            ("ours", "seconds", "o-"),
            ("ours without evaluation", "seconds_without_evaluation", "o:"),
        ):
            axis.plot(
                [r[key] for r in rows], [r[column] / generations for r in rows], style, label=label
            )
        axis.set(xlabel=key, ylabel="time per generation [s]", yscale="log")
    axes[0].set(xscale="log", title="2 objectives")
    axes[1].set(
        xticks=[2, 3, 4, 5], title=f"population {results['growth']['objectives'][0]['population']}"
    )
    axes[0].legend(frameon=False)
    figure.savefig(RESULTS / "nsga2.png", dpi=150)


def main() -> None:
    """Measure, write, draw."""
    quick = asked_for_quick(__doc__, "small populations, nothing written")
    results = measure(quick)
    print(
        {
            key: results[key]
            for key in ("speedup", "hypervolume_ratio", "equal_fronts", "share_of_time")
        }
    )
    if not quick:
        write("nsga2", results)
        plot(results)


if __name__ == "__main__":
    main()
