"""Figures of the interpolant."""

import numpy as np

from calibrator.report.figures import calibration
from tests.report.figures.drawings import RNG


def test_points_without_a_prediction_are_left_out_of_the_parity_figure():
    measured, predicted, std = RNG.random((3, 9, 1))
    predicted[4] = np.nan
    dots = max(
        calibration.parity(measured, predicted, std, ["angle [°]"]).axes[0].lines,
        key=lambda line: len(line.get_xdata()),
    )
    assert len(dots.get_xdata()) == 8
