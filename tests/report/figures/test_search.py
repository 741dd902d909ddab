"""The front: a trade-off between small numbers is still one that can be seen."""

import numpy as np

from calibrator.report.figures.search import front_evolution
from tests.report.figures.drawings import RNG

COST = np.linspace(0, 0.6, 30)


def heights(figure, front):
    """How much of each panel's height the front takes, as shares."""
    for ax in figure.axes:
        line = next(line for line in ax.lines if len(line.get_xdata()) == len(front))
        up = ax.transAxes.inverted().transform(ax.transData.transform(line.get_xydata()))[:, 1]
        yield float(np.ptp(up))


def drawn(errors):
    front = np.column_stack([errors, COST])
    early = np.column_stack([RNG.random(200), RNG.random(200)])
    late = front + np.array([1e-6, 0.0])
    marks = {"compromise": list(front[15]), "individual A": list(front[0])}
    return front_evolution({0: early, 60: late}, front, ["O1", "O2"], marks), front


def test_a_front_that_is_nearly_zero_everywhere_is_drawn_so_that_it_can_be_seen():
    figure, front = drawn(np.geomspace(1e-3, 1e-5, 30))
    assert all(ax.get_yscale() == "log" for ax in figure.axes)
    assert all(height > 0.25 for height in heights(figure, front))


def test_zero_itself_is_drawn_at_the_foot_of_a_logarithmic_axis():
    figure, front = drawn(np.append(np.geomspace(1e-3, 1e-5, 29), 0.0))
    assert all(height > 0.25 for height in heights(figure, front))
    assert all(ax.get_ylim()[0] > 0 for ax in figure.axes)


def test_a_front_of_usual_errors_or_of_none_keeps_its_linear_axis():
    for errors in (np.linspace(0.5, 0.1, 30), np.zeros(30)):
        figure, _ = drawn(errors)
        assert all(ax.get_yscale() == "linear" for ax in figure.axes)
