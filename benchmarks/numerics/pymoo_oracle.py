"""The genetic search as pymoo does it: the oracle for ours.

It has pymoo's own algorithm, survival, mating loop, tournament selection and bit flips; its
crossover and its elimination of duplicates are vectorised, as pymoo's own would be slower still.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2, binary_tournament
from pymoo.config import Config
from pymoo.core.crossover import Crossover
from pymoo.core.duplicate import DuplicateElimination
from pymoo.core.problem import Problem as PymooProblem
from pymoo.operators.crossover.pntx import SinglePointCrossover
from pymoo.operators.mutation.bitflip import BitflipMutation
from pymoo.operators.sampling.rnd import BinaryRandomSampling
from pymoo.operators.selection.tournament import TournamentSelection

from calibrator.case.problem import Problem
from calibrator.search.nsga2 import Evaluate, SearchResult, Settings, decode

# pymoo would print a hint; nothing used here has a compiled version
Config.warnings["not_compiled"] = False


def search_with_pymoo(
    problem: Problem,
    evaluate: Evaluate,
    settings: Settings,
    names: Sequence[str],
    stock_operators: bool = False,
) -> SearchResult:
    """`calibrator.search.nsga2.search` by pymoo, with its own slower operators if asked for."""
    algorithm = pymoo_algorithm(problem, evaluate, settings, len(names), stock_operators)
    snapshots, fronts = {}, []
    for generation in range(settings.generations + 1):
        if algorithm.has_next():
            algorithm.next()
        bits, objectives, rank = algorithm.pop.get("X", "F", "rank")
        fronts.append(objectives[rank == 0])
        if generation in settings.snapshots:
            snapshots[generation] = (decode(problem, bits), objectives)
    best = np.flatnonzero(rank == 0)
    best = best[np.lexsort(objectives[best].T[::-1])]
    return SearchResult(
        decode(problem, bits[best]), objectives[best], tuple(names), snapshots, fronts
    )


def pymoo_algorithm(
    problem: Problem, evaluate: Evaluate, settings: Settings, objectives: int, stock: bool
) -> NSGA2:
    """Pymoo's NSGA-II, ready to step."""
    crossover = (
        SinglePointCrossover(prob=settings.crossover)
        if stock
        else RandomCut(2, 2, prob=settings.crossover)
    )
    algorithm = NSGA2(
        pop_size=settings.population,
        sampling=BinaryRandomSampling(),
        selection=TournamentSelection(func_comp=binary_tournament if stock else tournament),
        crossover=crossover,
        mutation=BitflipMutation(prob=1.0, prob_var=settings.mutation),
        eliminate_duplicates=True if stock else RepeatedChromosomes(),
    )
    algorithm.tournament_type = "comp_by_rank_and_crowding"
    # pymoo counts the random population as generation 1
    termination = ("n_gen", settings.generations + 1)
    return algorithm.setup(
        Encoded(problem, evaluate, objectives), termination=termination, seed=settings.seed
    )


class Encoded(PymooProblem):
    """The search problem as pymoo sees it: boolean chromosomes in, objectives out."""

    def __init__(self, problem: Problem, evaluate: Evaluate, objectives: int) -> None:
        super().__init__(
            n_var=sum(p.bits for p in problem.parameters), n_obj=objectives, vtype=bool
        )
        self.problem, self.evaluate_points = problem, evaluate

    def _evaluate(
        self, x: np.ndarray, out: dict[str, np.ndarray], *args: Any, **kwargs: Any
    ) -> None:
        out["F"] = self.evaluate_points(decode(self.problem, x))


class RandomCut(Crossover):
    """Pairs exchange everything from a random cut on; pymoo's own fills row by row."""

    def _do(
        self, problem: Any, X: np.ndarray, *args: Any, random_state: Any = None, **kwargs: Any
    ) -> np.ndarray:
        _, matings, length = X.shape
        cut = random_state.integers(1, max(2, length), size=(matings, 1))
        return np.where(np.arange(length) < cut, X, X[::-1])


class RepeatedChromosomes(DuplicateElimination):
    """Exact comparison of chromosomes by sorting (pymoo's default holds all pairwise distances)."""

    def _do(self, pop: Any, other: Any, is_duplicate: np.ndarray) -> np.ndarray:
        here = np.packbits(pop.get("X"), axis=1)
        seen = np.packbits(other.get("X"), axis=1) if other is not None else here[:0]
        first = np.unique(np.concatenate([seen, here]), axis=0, return_index=True)[1] - len(seen)
        is_duplicate[:] = True
        is_duplicate[first[first >= 0]] = False
        return is_duplicate


def tournament(pop: Any, P: np.ndarray, random_state: Any, **kwargs: Any) -> np.ndarray:
    """Winner of each pair P (n, 2): the lower rank, then the larger crowding distance, then either.

    Returns (n, 1).
    """
    rank, crowding = pop.get("rank", "crowding")
    first, second = P.T
    coin = random_state.random(len(P)) < 0.5
    less_crowded = np.where(
        crowding[first] == crowding[second], coin, crowding[first] > crowding[second]
    )
    first_wins = np.where(rank[first] == rank[second], less_crowded, rank[first] < rank[second])
    return np.where(first_wins, first, second)[:, None]
