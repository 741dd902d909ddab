"""NSGA-II with the paper's binary encoding (sections 2.1 and 2.2). The only module that knows pymoo.

Deb et al., A fast and elitist multiobjective genetic algorithm: NSGA-II, IEEE Trans. Evol. Comput. 6 (2002) 182-197.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.config import Config
from pymoo.core.crossover import Crossover
from pymoo.core.duplicate import DuplicateElimination
from pymoo.core.problem import Problem as PymooProblem
from pymoo.operators.mutation.bitflip import BitflipMutation
from pymoo.operators.sampling.rnd import BinaryRandomSampling
from pymoo.operators.selection.tournament import TournamentSelection
from scipy.spatial import cKDTree

from calibrator.errors import CalibratorError
from calibrator.problem import Problem

Config.warnings["not_compiled"] = False  # pymoo would print a hint; nothing used here has a compiled version

Evaluate = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Settings:
    """Settings of the search; the defaults are the paper's Table 4 and the generations of its Fig. 6.

    crossover is a probability per mating, mutation one per bit. snapshots are generations whose population is kept;
    those beyond the last generation are ignored.
    """

    population: int = 5000
    generations: int = 100
    crossover: float = 0.9
    mutation: float = 0.01
    seed: int = 1
    snapshots: tuple[int, ...] = (0, 1, 2, 3, 20, 100)

    def __post_init__(self) -> None:
        if self.population < 2:
            raise CalibratorError(f"search: population = {self.population}; give 2 or more")
        for name in ("generations", "seed"):
            if getattr(self, name) < 0:
                raise CalibratorError(f"search: {name} = {getattr(self, name)}; give 0 or more")
        for name in ("crossover", "mutation"):
            if not 0 <= getattr(self, name) <= 1:
                raise CalibratorError(f"search: {name} = {getattr(self, name)}; give a probability from 0 to 1")
        if any(generation < 0 for generation in self.snapshots):
            raise CalibratorError(f"search: snapshots = {self.snapshots}; give generations of 0 or more")


@dataclass(frozen=True, eq=False)
class SearchResult:
    """What a search leaves behind.

    Attributes
    ----------
    points (p, d), objectives (p, k) : the final Pareto front without repeated points, sorted by the first objective.
    names : the k objectives.
    snapshots : generation -> (points (n, d), objectives (n, k)) of the whole population; 0 is the random one.
    fronts : objectives (f, k) of the first front of every generation from 0 on.
    """

    points: np.ndarray
    objectives: np.ndarray
    names: tuple[str, ...]
    snapshots: dict[int, tuple[np.ndarray, np.ndarray]]
    fronts: list[np.ndarray]


def decode(problem: Problem, bits: np.ndarray) -> np.ndarray:
    """Parameter sets (n, d) of chromosomes bits (n, L), the parameters' codes in order, most significant bit first.

    x = low + (high - low) k / (2^L_i - 1) with the integer k that the L_i bits of a parameter spell (paper, section 2.1);
    both bounds are met exactly.
    """
    codes = np.split(np.asarray(bits, float), np.cumsum([p.bits for p in problem.parameters])[:-1], axis=1)
    shares = np.column_stack([code @ _digits(code.shape[1]) / (2.0 ** code.shape[1] - 1) for code in codes])
    return problem.low * (1 - shares) + problem.high * shares


def encode(problem: Problem, points: np.ndarray) -> np.ndarray:
    """Chromosomes (n, L) of booleans that decode to the nearest representable parameter sets; points (n, d) in the box."""
    steps = 2.0 ** np.array([p.bits for p in problem.parameters]) - 1
    integers = np.rint((np.asarray(points, float) - problem.low) / (problem.high - problem.low) * steps).astype(np.int64)
    codes = [integers[:, [i]] >> np.arange(p.bits)[::-1] & 1 for i, p in enumerate(problem.parameters)]
    return np.concatenate(codes, axis=1).astype(bool)


def _digits(bits: int) -> np.ndarray:
    return 2.0 ** np.arange(bits)[::-1]


def search(
    problem: Problem, evaluate: Evaluate, settings: Settings, names: Sequence[str] = ("error", "time_cost")
) -> SearchResult:
    """Evolve a random population towards the Pareto front of the objectives called names.

    Parents win binary tournaments on rank, then crowding; each pair exchanges the ends of its chromosomes at one point with
    the crossover probability; each bit flips with the mutation probability. The better half of parents and offspring, by
    rank and crowding, survives. No chromosome occurs twice: a repeated one is dropped and mating repeated, so a population
    can be smaller than asked where the encoding has no more values, and evolution ends early where nothing new can be
    made (the remaining generations then equal the last).

    Parameters
    ----------
    evaluate : points (n, d) -> objectives (n, k), all to be minimised.

    Raises
    ------
    CalibratorError : evaluate returns another shape, or a value that is not finite.
    """
    algorithm = _algorithm(problem, evaluate, settings, len(names))
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
    return SearchResult(decode(problem, bits[best]), objectives[best], tuple(names), snapshots, fronts)


def generational_distance(fronts: Sequence[np.ndarray], final: np.ndarray) -> np.ndarray:
    """Mean distance of each front's members (f, k) to their nearest point of the final front (p, k): Eq. (8), shape (g,)."""
    tree = cKDTree(final)
    return np.array([tree.query(front)[0].mean() for front in fronts])


def _algorithm(problem: Problem, evaluate: Evaluate, settings: Settings, objectives: int) -> NSGA2:
    """Pymoo's NSGA-II, ready to step: the place to plug in faster operators."""
    algorithm = NSGA2(
        pop_size=settings.population,
        sampling=BinaryRandomSampling(),
        selection=TournamentSelection(func_comp=_tournament),
        crossover=_SinglePointCrossover(2, 2, prob=settings.crossover),
        mutation=BitflipMutation(prob=1.0, prob_var=settings.mutation),
        eliminate_duplicates=_RepeatedChromosomes(),
    )
    termination = ("n_gen", settings.generations + 1)  # pymoo counts the random population as generation 1
    return algorithm.setup(_Encoded(problem, evaluate, objectives), termination=termination, seed=settings.seed)


class _Encoded(PymooProblem):
    """The search problem as pymoo sees it: boolean chromosomes in, objectives out."""

    def __init__(self, problem: Problem, evaluate: Evaluate, objectives: int) -> None:
        super().__init__(n_var=sum(p.bits for p in problem.parameters), n_obj=objectives, vtype=bool)
        self.problem, self.evaluate_points = problem, evaluate

    def _evaluate(self, x: np.ndarray, out: dict[str, np.ndarray], *args: Any, **kwargs: Any) -> None:
        found = np.asarray(self.evaluate_points(decode(self.problem, x)), float)
        if found.shape != (len(x), self.n_obj):
            raise CalibratorError(f"objectives have shape {found.shape}: return {(len(x), self.n_obj)}, one column per objective")
        if not np.isfinite(found).all():
            raise CalibratorError("an objective is not finite: return a finite number for every point of the box")
        out["F"] = found


class _SinglePointCrossover(Crossover):
    """Pairs exchange everything from a random cut on, one cut per pair (pymoo's own draws and fills row by row)."""

    def _do(self, problem: Any, X: np.ndarray, *args: Any, random_state: Any = None, **kwargs: Any) -> np.ndarray:  # noqa: N803
        _, matings, length = X.shape
        cut = random_state.integers(1, max(2, length), size=(matings, 1))
        return np.where(np.arange(length) < cut, X, X[::-1])


class _RepeatedChromosomes(DuplicateElimination):
    """Exact comparison of chromosomes by sorting (pymoo's default holds all pairwise distances)."""

    def _do(self, pop: Any, other: Any, is_duplicate: np.ndarray) -> np.ndarray:
        here = np.packbits(pop.get("X"), axis=1)
        seen = np.packbits(other.get("X"), axis=1) if other is not None else here[:0]
        first = np.unique(np.concatenate([seen, here]), axis=0, return_index=True)[1] - len(seen)
        is_duplicate[:] = True
        is_duplicate[first[first >= 0]] = False
        return is_duplicate


def _tournament(pop: Any, P: np.ndarray, random_state: Any, **kwargs: Any) -> np.ndarray:  # noqa: N803
    """Winner of each pair P (n, 2): the lower rank, then the larger crowding distance, then either. Returns (n, 1)."""
    rank, crowding = pop.get("rank", "crowding")
    first, second = P.T
    coin = random_state.random(len(P)) < 0.5
    less_crowded = np.where(crowding[first] == crowding[second], coin, crowding[first] > crowding[second])
    first_wins = np.where(rank[first] == rank[second], less_crowded, rank[first] < rank[second])
    return np.where(first_wins, first, second)[:, None]
