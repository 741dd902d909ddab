"""Reachability on linear models."""

import numpy as np
import pytest

from calibrator.search.reach import unreachable
from tests.toy_problem import KEYS, problem


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
        problem(first=110.0, second=90.0, scatter=1.0, tolerance=0.01),
        Peak([[0, 0], [0, 0]], [0, 0]),
        samples=2**8,
    ).targets[0]
    assert reach.best == pytest.approx(100, abs=0.01) and reach.gap == pytest.approx(10, rel=1e-3)
