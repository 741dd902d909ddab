"""Samples of the box."""

import numpy as np

from calibrator.responses.box import box_sample
from tests.responses.known_functions import HIGH, LOW


def test_box_sample_fills_each_half_of_the_box_evenly():
    points = box_sample(LOW, HIGH, 60, np.random.default_rng(0))
    assert points.shape == (64, 2) and (points >= LOW).all() and (points <= HIGH).all()
    np.testing.assert_array_equal((points > (LOW + HIGH) / 2).sum(axis=0), 32)
