"""The genetic algorithm against its encoding, its operators' promises and a known front."""

import numpy as np
import pytest

from benchmarks.numerics.pymoo_oracle import search_with_pymoo
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.errors import CalibratorError
from calibrator.search.nsga2 import (
    Settings,
    _crossed,
    _first_of_each,
    _mutated,
    _Population,
    _tournament,
    decode,
    encode,
    generational_distance,
    search,
)

TARGETS = (Target("hourglass", "bulk_density", 1530.0),)
SPACE = Problem(
    (
        Parameter("rolling_friction", 0.1, 0.5),
        Parameter("sliding_friction", 0.2, 0.7),
        Parameter("particle_radius", 0.3e-3, 0.4e-3),
        Parameter("particle_density", 2600.0, 2800.0, bits=10),
        Parameter("young_modulus", 5e6, 500e6, bits=5),
    ),
    TARGETS,
)
SMALL = Settings(population=60, generations=15, snapshots=(0, 5, 15, 99))


def zdt1(points):
    """Zitzler, Deb and Thiele's first problem on the unit box.

    The front is f2 = 1 - sqrt(f1), where all but x1 are 0.
    """
    x = (points - SPACE.low) / (SPACE.high - SPACE.low)
    g = 1 + 9 * x[:, 1:].mean(axis=1)
    return np.column_stack([x[:, 0], g * (1 - np.sqrt(x[:, 0] / g))])


@pytest.fixture(scope="module")
def found():
    return search(
        SPACE, zdt1, Settings(population=120, generations=80, snapshots=(0,)), names=("f1", "f2")
    )


def dominated(objectives):
    no_worse = (objectives[:, None] <= objectives[None]).all(axis=2)
    better = (objectives[:, None] < objectives[None]).any(axis=2)
    return (no_worse & better).any(axis=0)


def rows(points):
    return set(map(tuple, points))


def test_lowest_and_highest_codes_are_the_bounds_exactly():
    length = sum(p.bits for p in SPACE.parameters)
    np.testing.assert_array_equal(decode(SPACE, np.zeros((1, length), bool))[0], SPACE.low)
    np.testing.assert_array_equal(decode(SPACE, np.ones((1, length), bool))[0], SPACE.high)


def test_decoded_chromosomes_encode_to_themselves():
    bits = np.random.default_rng(0).random((200, sum(p.bits for p in SPACE.parameters))) < 0.5
    np.testing.assert_array_equal(encode(SPACE, decode(SPACE, bits)), bits)


def test_encoding_is_that_of_the_papers_example():
    frictions = Problem(
        (
            Parameter("rolling_friction", 0.1, 0.5, bits=4),
            Parameter("sliding_friction", 0.2, 0.7, bits=5),
        ),
        TARGETS,
    )
    bits = encode(frictions, np.array([[0.2862, 0.5387]]))
    assert "".join(map(str, bits[0].astype(int))) == "011110101"
    np.testing.assert_allclose(
        decode(frictions, bits)[0], [0.1 + 7 * 0.4 / 15, 0.2 + 21 * 0.5 / 31]
    )


def test_codes_are_evenly_spaced_with_the_precision_of_table_5():
    modulus = Problem((Parameter("young_modulus", 5e6, 500e6),), TARGETS)
    codes = np.array([[int(b) for b in f"{k:08b}"] for k in range(256)])
    np.testing.assert_allclose(np.diff(decode(modulus, codes)[:, 0]), 1.9412e6, rtol=1e-4)


def test_binary_coded_zdt1_front_is_reached_from_end_to_end(found):
    f1, f2 = found.objectives.T
    assert (f2 - (1 - np.sqrt(f1))).max() < 0.02
    assert f1.min() == 0 and f1.max() > 0.97 and np.diff(f1).max() < 0.05
    assert (found.fronts[0][:, 1] - (1 - np.sqrt(found.fronts[0][:, 0]))).min() > 0.2


def test_front_is_not_dominated_sorted_by_the_first_objective_and_free_of_repeated_points(found):
    assert not dominated(found.objectives).any()
    assert (np.diff(found.objectives[:, 0]) >= 0).all()
    assert len(rows(found.points)) == len(found.points)
    np.testing.assert_array_equal(zdt1(found.points), found.objectives)
    assert found.names == ("f1", "f2")


def test_fronts_of_all_generations_are_first_fronts_and_the_best_is_never_lost(found):
    assert len(found.fronts) == 81
    assert not any(dominated(front).any() for front in found.fronts[::10])
    best = np.array([front[:, 0].min() for front in found.fronts])
    assert (np.diff(best) <= 0).all()


def test_front_of_a_random_population_leaves_its_dominated_members_out():
    result = search(SPACE, zdt1, Settings(population=60, generations=0, snapshots=(0,)))
    assert len(result.points) < 60
    assert rows(result.objectives) == rows(
        result.snapshots[0][1][~dominated(result.snapshots[0][1])]
    )


def test_every_generation_evaluates_a_population_of_offspring():
    sizes = []
    search(
        SPACE, lambda x: (sizes.append(len(x)), zdt1(x))[1], Settings(population=60, generations=7)
    )
    assert sizes == [60] * 8


def test_generational_distance_falls_to_zero(found):
    distance = generational_distance(found.fronts, found.fronts[-1])
    assert distance.shape == (81,) and distance[-1] == 0
    assert distance[0] > 10 * distance[60]


def test_generational_distance_is_the_mean_distance_to_the_nearest_final_member():
    final = np.array([[0.0, 0.0], [10.0, 0.0]])
    fronts = [np.array([[0.0, 3.0], [10.0, 5.0]]), np.array([[3.0, 4.0]]), final]
    np.testing.assert_allclose(generational_distance(fronts, final), [4, 5, 0])


def test_same_seed_gives_the_same_search_bit_for_bit_and_another_seed_does_not():
    first, second = search(SPACE, zdt1, SMALL), search(SPACE, zdt1, SMALL)
    np.testing.assert_array_equal(first.points, second.points)
    for generation, (points, objectives) in first.snapshots.items():
        np.testing.assert_array_equal(points, second.snapshots[generation][0])
        np.testing.assert_array_equal(objectives, second.snapshots[generation][1])
    other = search(SPACE, zdt1, Settings(population=60, generations=15, seed=2))
    assert not np.array_equal(other.snapshots[0][0], first.snapshots[0][0])


def test_snapshots_hold_the_population_of_the_generations_that_ran():
    result = search(SPACE, zdt1, SMALL)
    assert sorted(result.snapshots) == [0, 5, 15]
    for points, objectives in result.snapshots.values():
        assert len(rows(points)) == 60
        np.testing.assert_array_equal(zdt1(points), objectives)


def test_without_crossover_and_mutation_nothing_new_is_created():
    settings = Settings(population=30, generations=3, crossover=0, mutation=0, snapshots=(0, 3))
    result = search(SPACE, zdt1, settings)
    assert rows(result.snapshots[3][0]) == rows(result.snapshots[0][0])
    assert len(result.fronts) == 4


def test_a_population_beyond_the_encoding_holds_each_value_once():
    tiny = Problem((Parameter("rolling_friction", 0.1, 0.5, bits=3),), TARGETS)
    result = search(
        tiny, lambda x: np.column_stack([x[:, 0], -x[:, 0]]), Settings(population=50, generations=5)
    )
    np.testing.assert_allclose(result.points[:, 0], np.linspace(0.1, 0.5, 8))


def test_children_switch_parents_once_and_only_with_the_crossover_probability():
    length = sum(p.bits for p in SPACE.parameters)
    pairs = np.tile(np.array([False, True])[:, None], (2000, 1, length))
    children = _crossed(pairs, 0.9, np.random.default_rng(0)).astype(int)
    assert (children[:2000] + children[2000:] == 1).all()
    switches = np.abs(np.diff(children, axis=1)).sum(axis=1)
    assert set(switches) == {0, 1}
    assert switches.mean() == pytest.approx(0.9, abs=0.02)
    cuts = np.argmax(np.diff(children[switches == 1], axis=1) != 0, axis=1)
    assert set(cuts) == set(range(length - 1))


def test_each_bit_flips_with_the_mutation_probability():
    bits = np.random.default_rng(1).random((2000, 40)) < 0.5
    flipped = _mutated(bits, 0.01, np.random.default_rng(0)) != bits
    assert flipped.mean() == pytest.approx(0.01, abs=0.0015)
    assert (flipped.sum(axis=0) > 0).all()


def test_tournament_prefers_rank_then_crowding():
    pair = _Population(
        np.zeros((2, 1), bool),
        np.zeros((2, 1)),
        np.zeros(2),
        np.array([0, 1]),
        np.array([0.1, 9.0]),
    )
    crowd = _Population(
        np.zeros((2, 1), bool),
        np.zeros((2, 1)),
        np.zeros(2),
        np.array([1, 1]),
        np.array([9.0, 2.0]),
    )
    for population in (pair, crowd):
        assert not _tournament(population, (20, 2), np.random.default_rng(0)).any()


def test_tournament_lets_every_member_enter_equally_often():
    equals = _Population(
        np.zeros((10, 1), bool),
        np.zeros((10, 1)),
        np.zeros(10),
        np.zeros(10, int),
        np.full(10, np.inf),
    )
    wins = np.bincount(_tournament(equals, (5000, 2), np.random.default_rng(0)).ravel())
    np.testing.assert_allclose(wins, 1000, atol=100)


@pytest.mark.parametrize("length", [3, 40, 64, 200])
def test_a_chromosome_counts_as_repeated_only_where_every_bit_agrees(length):
    bits = np.random.default_rng(0).random((20, length)) < 0.5
    bits[:, -1], bits[:, 0] = True, np.arange(20) < 10
    bits[10:] = bits[:10]
    bits[15:, -1] = False
    expected = [i for i, row in enumerate(bits) if not (bits[:i] == row).all(axis=1).any()]
    np.testing.assert_array_equal(_first_of_each(bits), expected)


@pytest.mark.parametrize(
    ("population", "crossover", "mutation"), [(60, 0.9, 0.01), (7, 0.5, 0.05), (31, 0.0, 0.0)]
)
@pytest.mark.parametrize("objectives", [1, 2, 3])
def test_the_search_is_that_of_pymoo_bit_for_bit(population, crossover, mutation, objectives):
    def evaluate(points):
        return np.column_stack([zdt1(points), np.round(points[:, 0] + points[:, 1], 2)])[
            :, :objectives
        ]

    settings, names = Settings(population, 20, crossover, mutation), ("f1", "f2", "f3")[:objectives]
    ours = search(SPACE, evaluate, settings, names)
    theirs = search_with_pymoo(SPACE, evaluate, settings, names)
    np.testing.assert_array_equal(ours.points, theirs.points)
    for our_front, their_front in zip(ours.fronts, theirs.fronts, strict=True):
        np.testing.assert_array_equal(our_front, their_front)


def test_a_single_objective_finds_its_minimum():
    result = search(
        SPACE,
        lambda x: (x[:, [0]] - 0.3) ** 2,
        Settings(population=60, generations=30),
        names=("error",),
    )
    assert result.objectives.shape[1] == 1
    assert np.abs(result.points[:, 0] - 0.3).max() < 0.4 / 255


@pytest.mark.parametrize(
    ("evaluate", "message"),
    [
        (lambda x: np.full((len(x), 2), np.nan), "not finite"),
        (lambda x: np.zeros((len(x), 3)), "one column per objective"),
    ],
)
def test_objectives_that_cannot_be_ranked_are_refused(evaluate, message):
    with pytest.raises(CalibratorError, match=message):
        search(SPACE, evaluate, SMALL)


@pytest.mark.parametrize(
    "wrong",
    [
        {"population": 1},
        {"generations": -1},
        {"crossover": 1.1},
        {"mutation": -0.1},
        {"seed": -1},
        {"snapshots": (-1,)},
    ],
)
def test_impossible_settings_are_refused_by_name(wrong):
    with pytest.raises(CalibratorError, match=next(iter(wrong))):
        Settings(**wrong)
