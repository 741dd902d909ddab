"""Choices from fronts written down by hand, and reachability on linear models."""

import numpy as np
import pytest

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.errors import CalibratorError
from calibrator.responses.targets import bands
from calibrator.search.front import compromise, spread
from calibrator.search.reach import unreachable

PARAMETERS = (Parameter("rolling_friction", 0.0, 1.0), Parameter("sliding_friction", 0.0, 1.0))
KEYS = ["hourglass.bulk_density", "ledge.bulk_density"]


def problem(first=100.0, second=200.0, **options):
    return Problem(
        PARAMETERS,
        (
            Target("hourglass", "bulk_density", first, **options),
            Target("ledge", "bulk_density", second, **options),
        ),
    )


class Linear:
    """Responses offset + points @ slopes with a constant standard error."""

    responses = KEYS
    noise = np.zeros(2)

    def __init__(self, slopes, offset, std=0.0):
        self.slopes, self.offset, self.std = np.array(slopes, float), np.array(offset, float), std

    def predict(self, points):
        return self.offset + points @ self.slopes

    def predict_with_error(self, points):
        return self.predict(points), np.full((len(points), 2), self.std)


INDEPENDENT = Linear([[100, 0], [0, 100]], [50, 150])  # 50 to 150 and 150 to 250
TIED = Linear([[100, 100], [0, 0]], [50, 50])  # the same response twice, 50 to 150


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


def test_band_is_the_tolerance_but_never_less_than_two_seed_noises():
    np.testing.assert_allclose(
        bands(problem(tolerance=0.03), dict(zip(KEYS, (1.0, 5.0), strict=True))), [3, 10]
    )


FRONT = np.array([[0.0, 3.0], [0.02, 2.0], [0.04, 1.0], [0.2, 0.0]])


def chosen(first, std=0.0, second=(200.0, 200.0, 200.0, 200.0), noise=0.0, replicates=1):
    predicted = dict(zip(KEYS, (np.array(first), np.array(second)), strict=True))
    errors = {key: np.full(4, std) for key in KEYS}
    return compromise(
        problem(tolerance=0.03), FRONT, predicted, errors, dict.fromkeys(KEYS, noise), replicates
    )


def test_compromise_is_the_cheapest_member_that_meets_every_target():
    index, reason = chosen([100.0, 101.0, 102.0, 120.0])
    assert index == 2 and "cheapest of the 3 (of 4)" in reason and "in reserve" in reason


def test_compromise_reserves_two_standard_errors_of_the_interpolant():
    assert chosen([100.0, 101.0, 102.0, 120.0], std=0.75)[0] == 1


def test_compromise_reserves_less_the_more_runs_will_verify_it():
    assert chosen([100.0, 101.0, 102.0, 120.0], noise=1.0, replicates=1)[0] == 1
    assert chosen([100.0, 101.0, 102.0, 120.0], noise=1.0, replicates=16)[0] == 2


def test_compromise_asks_for_all_targets_not_their_sum():
    assert chosen([100.0, 101.0, 102.0, 100.0], second=(200.0, 200.0, 207.0, 210.0))[0] == 1


def test_compromise_gives_the_reserve_up_before_the_targets():
    index, reason = chosen([100.0, 101.0, 102.0, 120.0], std=5.0)
    assert index == 2 and "nothing in reserve" in reason


def test_compromise_of_a_front_without_success_is_the_smallest_error_and_names_the_miss():
    index, reason = chosen([90.0, 95.0, 110.0, 120.0])
    assert (
        index == 1
        and "hourglass.bulk_density by 5.0% (band 3.0%)" in reason
        and "ledge" not in reason
    )


def test_targets_within_the_box_are_reachable_singly_and_together():
    found = unreachable(problem(), INDEPENDENT, samples=2**8)
    assert all(t.reachable and t.gap == 0 for t in found.targets) and found.joint.reachable
    np.testing.assert_allclose(found.joint.point, [0.5, 0.5], atol=0.01)
    assert "can be met together" in found.joint.sentence


def test_range_reached_is_that_of_the_corners():
    reach = unreachable(problem(), INDEPENDENT, samples=2**5).targets[1]
    assert (reach.low, reach.high) == (150, 250)


def test_target_beyond_the_box_is_out_of_reach_by_its_distance_in_combined_errors():
    found = unreachable(
        problem(first=170.0, scatter=4.0), Linear([[100, 0], [0, 100]], [50, 150], std=3.0)
    )
    assert not found.targets[0].reachable and found.targets[1].reachable
    assert found.targets[0].best == pytest.approx(150) and found.targets[0].gap == pytest.approx(
        20 / 5
    )
    assert (
        "cannot be reached" in found.targets[0].sentence
        and "widen the bounds" in found.targets[0].sentence
    )
    assert not found.joint.reachable and found.joint.worst == KEYS[0]


def test_target_just_beyond_the_box_counts_as_reachable_within_two_errors():
    assert unreachable(problem(first=157.0, scatter=4.0), INDEPENDENT).targets[0].reachable
    assert not unreachable(problem(first=159.0, scatter=4.0), INDEPENDENT).targets[0].reachable


def test_targets_reachable_singly_may_be_unreachable_together():
    found = unreachable(problem(first=100.0, second=120.0, scatter=2.0), TIED)
    assert all(t.reachable for t in found.targets)
    # both miss by 10 at best
    assert not found.joint.reachable and found.joint.misfit == pytest.approx(5, rel=1e-3)
    assert "cannot be met together" in found.joint.sentence


def test_reachability_finds_an_extreme_inside_the_box():
    class Peak(Linear):
        def predict(self, points):
            return np.repeat(
                100 - 1e4 * ((points - [0.31, 0.77]) ** 2).sum(axis=1, keepdims=True), 2, axis=1
            )

    reach = unreachable(
        problem(first=110.0, second=90.0, scatter=1.0), Peak([[0, 0], [0, 0]], [0, 0]), samples=2**8
    ).targets[0]
    assert reach.best == pytest.approx(100, abs=0.01) and reach.gap == pytest.approx(10, rel=1e-3)
