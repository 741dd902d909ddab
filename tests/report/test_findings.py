"""What the page reads is checked before it is drawn."""

import numpy as np
import pytest

from calibrator.report import findings


@pytest.mark.parametrize(
    "arrays",
    [
        {"filled": np.zeros((0, 3))},
        {"filled": np.zeros(3)},
        {"filled": np.full((2, 3), np.nan)},
        {"time": np.zeros(3), "passed_mass": np.zeros(2)},
        {"profile_x": np.zeros(3)},
    ],
)
def test_arrays_of_a_wrong_shape_never_reach_a_figure(arrays):
    with pytest.raises(ValueError):
        findings._checked_curves(arrays)
