"""Choices from fronts written down by hand, and reachability on linear models."""

import numpy as np
import pytest

from calibrator.errors import CalibratorError
from calibrator.search.front import compromise, spread
from tests.toy_problem import KEYS, problem


def test_spread_runs_from_smallest_error_to_smallest_cost_in_equal_steps_of_cost():
    cost = np.linspace(0.5294, 0, 301)
    front = np.column_stack([0.0445 - 0.082 * cost, cost])[
        np.random.default_rng(0).permutation(301)
    ]
    # Table 6
    np.testing.assert_allclose(front[spread(front)][:, 1], [0.5294, 0.3529, 0.1765, 0], atol=1e-3)


def test_spread_takes_the_member_nearest_to_an_equal_step():
    front = np.array([[0.0, 1.0], [0.1, 0.9], [0.2, 0.6], [0.3, 0.45], [0.9, 0.0]])
    np.testing.assert_array_equal(spread(front, 3), [0, 3, 4])
    np.testing.assert_array_equal(spread(front, 2), [0, 4])


@pytest.mark.parametrize("count", [3, 4, 9])
def test_spread_never_repeats_a_member(count):
    front = np.array([[0.0, 1.0], [0.01, 0.9], [0.02, 0.8], [0.9, 0.0]])
    chosen = spread(front, count)
    assert len(chosen) == min(count, 4) == len(set(chosen))


def test_spread_counts_equal_objectives_as_one_member():
    front = np.repeat([[0.0, 1.0], [0.5, 0.5], [0.9, 0.0]], 4, axis=0)
    chosen = spread(front)
    np.testing.assert_array_equal(front[chosen], [[0.0, 1.0], [0.5, 0.5], [0.9, 0.0]])


def test_spread_of_a_front_of_one_is_that_one():
    np.testing.assert_array_equal(spread(np.zeros((3, 2))), [0])


def test_spread_ends_are_not_dominated_where_objectives_tie():
    front = np.array([[0.0, 2.0], [0.0, 1.0], [3.0, 0.0], [1.0, 0.0]])
    assert set(spread(front, 2)) == {1, 3}


@pytest.mark.parametrize("wrong", [np.zeros((0, 2)), np.zeros((3, 1)), np.zeros(3)])
def test_spread_refuses_what_is_no_front(wrong):
    with pytest.raises(CalibratorError):
        spread(wrong)


FRONT = np.array([[0.0, 3.0], [0.02, 2.0], [0.04, 1.0], [0.2, 0.0]])


def chosen(first, std=0.0, second=(200.0, 200.0, 200.0, 200.0), noise=0.0, replicates=1):
    predicted = dict(zip(KEYS, (np.array(first), np.array(second)), strict=True))
    errors = {key: np.full(4, std) for key in KEYS}
    return compromise(
        problem(tolerance=0.03), FRONT, predicted, errors, dict.fromkeys(KEYS, noise), replicates
    )


def test_compromise_is_the_cheapest_member_that_meets_every_target():
    index, reason = chosen([100.0, 101.0, 102.0, 120.0])
    assert index == 2 and "cheapest of the 3 (of 4)" in reason and "100%" in reason


def test_compromise_keeps_off_the_edge_of_a_band_that_the_interpolant_is_not_sure_of():
    assert chosen([100.0, 101.0, 102.0, 120.0], std=0.75)[0] == 1


def test_compromise_goes_nearer_to_the_edge_the_more_runs_will_verify_it():
    assert chosen([100.0, 101.0, 102.0, 120.0], noise=1.0, replicates=1)[0] == 1
    assert chosen([100.0, 101.0, 102.0, 120.0], noise=1.0, replicates=16)[0] == 2


def test_compromise_asks_for_all_targets_not_their_sum():
    assert chosen([100.0, 101.0, 102.0, 100.0], second=(200.0, 200.0, 207.0, 210.0))[0] == 1


def test_compromise_with_little_chance_is_nearly_the_likeliest_and_says_how_likely():
    index, reason = chosen([100.0, 101.0, 102.0, 120.0], std=5.0)
    # P(|N(1, 5)| < 3) P(|N(0, 5)| < 6), and 2 % less than that of the member without a miss
    assert index == 1 and "34%" in reason


def test_the_cheapest_is_so_by_the_objective_that_is_not_the_error_in_either_order():
    predicted = dict(zip(KEYS, np.array([[100.0, 101.0, 102.0, 120.0], [200.0] * 4]), strict=True))
    none = {key: np.zeros(4) for key in KEYS}
    noise = dict.fromkeys(KEYS, 0.0)
    given = (problem(tolerance=0.03), FRONT[:, ::-1], predicted, none, noise)
    assert compromise(*given, names=("time_cost", "error"))[0] == 2


def test_compromise_of_a_front_without_success_is_the_smallest_error_and_names_the_miss():
    index, reason = chosen([90.0, 95.0, 110.0, 120.0])
    assert (
        index == 1
        and "hourglass.bulk_density by 5.0% (band 3.0%)" in reason
        and "ledge" not in reason
    )
