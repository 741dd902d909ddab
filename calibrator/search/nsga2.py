"""NSGA-II with the paper's binary encoding (sections 2.1 and 2.2), on plain arrays.

The only module that knows pymoo. Deb et al., A fast and elitist multiobjective genetic algorithm:
NSGA-II, IEEE Trans. Evol. Comput. 6 (2002) 182-197. Ranks are moocore's, crowding distances
pymoo's. Random numbers are drawn in pymoo's order, so that a search is pymoo's own bit for bit
(benchmarks/numerics/nsga2.py holds the two against each other), without an object and a dictionary
for each individual.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from moocore import pareto_rank
from pymoo.operators.survival.rank_and_crowding.metrics import get_crowding_function
from pymoo.util.randomized_argsort import randomized_argsort
from scipy.spatial import cKDTree

from calibrator.case.problem import Problem
from calibrator.errors import CalibratorError

MATINGS = 100  # rounds in one generation before too few new chromosomes are accepted
_CROWDING = get_crowding_function("cd")
Evaluate = Callable[[np.ndarray], np.ndarray]
Excess = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Settings:
    """Settings of the search; the defaults are the paper's, of its Table 4 and Fig. 6.

    crossover is a probability per mating, mutation one per bit. snapshots are generations whose
    population is kept; those beyond the last generation are ignored. Raises CalibratorError for a
    probability that is none, a negative number and a population of one.
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
                raise CalibratorError(
                    f"search: {name} = {getattr(self, name)}; give a probability from 0 to 1"
                )
        if any(generation < 0 for generation in self.snapshots):
            raise CalibratorError(
                f"search: snapshots = {self.snapshots}; give generations of 0 or more"
            )


@dataclass(frozen=True, eq=False)
class SearchResult:
    """What a search leaves behind.

    Attributes
    ----------
    points, objectives : (p, d) and (p, k), the final Pareto front without repeated points, sorted
        by the first objective
    names : the k objectives
    snapshots : generation -> (points (n, d), objectives (n, k)) of the whole population; 0 is the
        random one
    fronts : objectives (f, k) of the first front of every generation from 0 on
    """

    points: np.ndarray
    objectives: np.ndarray
    names: tuple[str, ...]
    snapshots: dict[int, tuple[np.ndarray, np.ndarray]]
    fronts: list[np.ndarray]


def decode(problem: Problem, bits: np.ndarray) -> np.ndarray:
    """Parameter sets (n, d) of chromosomes bits (n, L).

    A chromosome holds the parameters' codes in order, most significant bit first: x = low + (high -
    low) k / (2^L_i - 1) with the integer k that the L_i bits of a parameter spell (paper, section
    2.1), on the parameter's scale; both bounds are met exactly.
    """
    ends = np.cumsum([p.bits for p in problem.parameters])
    codes = np.split(np.asarray(bits, float), ends[:-1], axis=1)
    shares = np.column_stack(
        [code @ _digits(code.shape[1]) / (2.0 ** code.shape[1] - 1) for code in codes]
    )
    low, high = problem.scaled_bounds
    return problem.unscaled(low * (1 - shares) + high * shares)


def encode(problem: Problem, points: np.ndarray) -> np.ndarray:
    """Chromosomes (n, L) of booleans that decode to the nearest representable parameter sets.

    points : (n, d) in the box.
    """
    steps = 2.0 ** np.array([p.bits for p in problem.parameters]) - 1
    integers = np.rint(problem.shares_of(points) * steps).astype(np.int64)
    codes = [
        integers[:, [i]] >> np.arange(p.bits)[::-1] & 1 for i, p in enumerate(problem.parameters)
    ]
    return np.concatenate(codes, axis=1).astype(bool)


def _digits(bits: int) -> np.ndarray:
    """What each bit of a code is worth, the most significant one first."""
    return 2.0 ** np.arange(bits)[::-1]


def search(
    problem: Problem,
    evaluate: Evaluate,
    settings: Settings,
    names: Sequence[str] = ("error", "time_cost"),
    excess: Excess | None = None,
) -> SearchResult:
    """Evolve a random population towards the Pareto front of the objectives called names.

    Parents win binary tournaments on rank, then crowding; each pair exchanges the ends of its
    chromosomes at one point with the crossover probability; each bit flips with the mutation
    probability. The better half of parents and offspring, by rank and crowding, survives. No
    chromosome occurs twice: a repeated one is dropped and mating repeated, so a population can be
    smaller than asked where the encoding has no more values, and evolution ends early where nothing
    new can be made (the remaining generations then equal the last).

    Parameters
    ----------
    evaluate : points (n, d) -> objectives (n, k), all to be minimised
    excess : points (n, d) -> (n,), 0 where a set may be chosen, else by how much it may not: such a
        set ranks behind all that may, the less the better (Deb et al., section VI)

    Raises
    ------
    CalibratorError : evaluate returns another shape, or a value that is not finite, or no set that
        was tried may be chosen
    """
    evolution = _evolution(problem, evaluate, settings, len(names), excess)
    snapshots, fronts = {}, []
    population = next(evolution)
    for generation in range(settings.generations + 1):
        if generation > 0:
            population = next(evolution, population)
        fronts.append(population.objectives[population.rank == 0])
        if generation in settings.snapshots:
            snapshots[generation] = (decode(problem, population.bits), population.objectives)
    best = np.flatnonzero((population.rank == 0) & (population.excess == 0))
    if not len(best):
        raise CalibratorError(
            "the search found no parameter set that the constraints allow and that is likely to"
            " run: raise search.population, or widen the bounds"
        )
    best = best[np.lexsort(population.objectives[best].T[::-1])]
    return SearchResult(
        decode(problem, population.bits[best]),
        population.objectives[best],
        tuple(names),
        snapshots,
        fronts,
    )


def generational_distance(fronts: Sequence[np.ndarray], final: np.ndarray) -> np.ndarray:
    """Mean distance (g,) of each front's members to their nearest point of the final front.

    The paper's Eq. (8). fronts : g arrays (f, k); final : (p, k).
    """
    tree = cKDTree(final)
    return np.array([tree.query(front)[0].mean() for front in fronts])


@dataclass(frozen=True, eq=False)
class _Population:
    """Chromosomes with their objectives, ranks and crowding.

    bits : (n, L); objectives : (n, k); excess : (n,) see `search`; rank : (n,); crowding : (n,)
    distance within the rank.
    """

    bits: np.ndarray
    objectives: np.ndarray
    excess: np.ndarray
    rank: np.ndarray
    crowding: np.ndarray


def _evolution(
    problem: Problem,
    evaluate: Evaluate,
    settings: Settings,
    objectives: int,
    excess: Excess | None,
) -> Iterator[_Population]:
    """The random population and its successors, for ever or until nothing new can be made."""

    def beyond(bits: np.ndarray) -> np.ndarray:
        return np.zeros(len(bits)) if excess is None else excess(decode(problem, bits))

    rng = np.random.default_rng(settings.seed)
    length = sum(p.bits for p in problem.parameters)
    bits = rng.random((settings.population, length)) < 0.5
    bits = bits[_first_of_each(bits)]
    values = _evaluated(problem, evaluate, bits, objectives)
    population = _survivors(bits, values, beyond(bits), len(bits), rng)
    yield population
    while len(children := _children(population, settings, rng)):
        found = _evaluated(problem, evaluate, children, objectives)
        bits = np.concatenate([population.bits, children])
        values = np.concatenate([population.objectives, found])
        both = np.concatenate([population.excess, beyond(children)])
        population = _survivors(bits, values, both, settings.population, rng)
        yield population


def _evaluated(
    problem: Problem, evaluate: Evaluate, bits: np.ndarray, objectives: int
) -> np.ndarray:
    """Objectives (n, k) of chromosomes; CalibratorError where they are not that, or not finite."""
    found = np.asarray(evaluate(decode(problem, bits)), float)
    if found.shape != (len(bits), objectives):
        raise CalibratorError(
            f"objectives have shape {found.shape}: return {(len(bits), objectives)}, one column per"
            " objective"
        )
    if not np.isfinite(found).all():
        raise CalibratorError(
            "an objective is not finite: return a finite number for every point of the box"
        )
    return found


def _survivors(
    bits: np.ndarray,
    objectives: np.ndarray,
    excess: np.ndarray,
    count: int,
    rng: np.random.Generator,
) -> _Population:
    """The count best of bits (n, L).

    By rank, then by crowding distance in the front that does not fit in whole.
    """
    rank = _ranks(objectives, excess)
    order = np.argsort(rank, kind="stable")
    ends = np.cumsum(np.bincount(rank))
    ends = ends[: np.searchsorted(ends, count) + 1]  # up to the front that fills the population
    fronts = np.split(order[: ends[-1]], ends[:-1])
    crowding = np.empty(len(bits))
    for front in fronts:
        crowding[front] = _CROWDING.do(objectives[front])
    last = fronts[-1]
    if ends[-1] > count:
        loosest = randomized_argsort(crowding[last], order="descending", random_state=rng)
        fronts[-1] = last[loosest[: count - ends[-1]]]
    chosen = np.concatenate(fronts)
    return _Population(
        bits[chosen], objectives[chosen], excess[chosen], rank[chosen], crowding[chosen]
    )


def _ranks(objectives: np.ndarray, excess: np.ndarray) -> np.ndarray:
    """Pareto ranks (n,) of objectives (n, k); behind them, by their excess (n,), what has one."""
    outside = excess > 0
    if not outside.any():
        return np.asarray(pareto_rank(objectives))
    rank = np.empty(len(objectives), int)
    _, rank[outside] = np.unique(excess[outside], return_inverse=True)
    if not outside.all():
        rank[~outside] = pareto_rank(objectives[~outside])
        rank[outside] += rank[~outside].max() + 1
    return rank


def _children(population: _Population, settings: Settings, rng: np.random.Generator) -> np.ndarray:
    """As many new chromosomes (n, L) as the population has.

    Or what MATINGS rounds make, where that is fewer.
    """
    old, children = len(population.bits), population.bits[:0]
    for _ in range(MATINGS):
        missing = settings.population - len(children)
        if missing == 0:
            break
        parents = population.bits[_tournament(population, (math.ceil(missing / 2), 2), rng)]
        made = _mutated(_crossed(parents, settings.crossover, rng), settings.mutation, rng)
        first = _first_of_each(np.concatenate([population.bits, children, made]))
        known = old + len(children)
        new = made[first[first >= known] - known]
        children = np.concatenate([children, new[:missing]])
    return children


def _tournament(
    population: _Population, shape: tuple[int, int], rng: np.random.Generator
) -> np.ndarray:
    """Winners of random pairs, indices of the given shape.

    The lower rank wins, then the larger crowding distance, then either.
    """
    rank, crowding = population.rank, population.crowding
    entrants = 2 * math.prod(shape)
    rounds = [rng.permutation(len(rank)) for _ in range(math.ceil(entrants / len(rank)))]
    first, second = np.concatenate(rounds)[:entrants].reshape(-1, 2).T
    coin = rng.random(len(first)) < 0.5
    less_crowded = np.where(
        crowding[first] == crowding[second], coin, crowding[first] > crowding[second]
    )
    first_wins = np.where(rank[first] == rank[second], less_crowded, rank[first] < rank[second])
    return np.where(first_wins, first, second).reshape(shape)


def _crossed(parents: np.ndarray, probability: float, rng: np.random.Generator) -> np.ndarray:
    """Children (2 n, L) of pairs (n, 2, L).

    With the probability, a pair exchanges everything from a random cut on.
    """
    matings, _, length = parents.shape
    crossing = np.asarray(rng.random(matings) < probability)
    cut = np.full((matings, 1), length)
    if crossing.any():  # like pymoo, draw cuts for all or for none
        cut[crossing] = rng.integers(1, max(2, length), size=(matings, 1))[crossing]
    pairs = parents.swapaxes(0, 1)
    return np.where(np.arange(length) < cut, pairs, pairs[::-1]).reshape(-1, length)


def _mutated(bits: np.ndarray, probability: float, rng: np.random.Generator) -> np.ndarray:
    """Chromosomes (n, L) with each bit flipped with the probability."""
    flipped = bits ^ (rng.random(bits.shape) < probability)
    rng.random(len(bits))  # pymoo's draw of whom to mutate at all: everybody
    return flipped


def _first_of_each(bits: np.ndarray) -> np.ndarray:
    """Ascending indices of the first occurrence of every distinct chromosome among bits (n, L)."""
    packed = np.packbits(bits, axis=1)
    words = np.pad(packed, ((0, 0), (0, -packed.shape[1] % 8))).view(np.uint64)
    order = np.lexsort(words.T)
    new = np.any(words[order[1:]] != words[order[:-1]], axis=1)
    return np.sort(order[np.append(True, new)])
