"""Pictures of packings: which grain hides which."""

import numpy as np

from calibrator.report.figures import grains


def test_a_grain_in_front_hides_the_one_behind():
    picture = (
        grains.packing([grains.Scene("two", np.array([[0, 0.0, 0], [0, 5e-3, 0]]))], 1e-3)
        .axes[0]
        .images[0]
        .get_array()
    )
    alone = (
        grains.packing([grains.Scene("one", np.array([[0, 0.0, 0]]))], 1e-3)
        .axes[0]
        .images[0]
        .get_array()
    )
    np.testing.assert_allclose(picture, alone)


def test_the_cut_removes_the_grains_in_front_of_the_axis():
    both = grains.Scene("both", np.array([[-3e-3, -2e-3, 0], [3e-3, 2e-3, 0]]))
    opaque = np.asarray(grains.packing([both], 1e-3, cut=True).axes[0].images[0].get_array())[
        ..., 3
    ]
    half = opaque.shape[1] // 2
    assert opaque[:, :half].sum() == 0 and opaque[:, half:].sum() > 0
