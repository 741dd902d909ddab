"""Figures: what they draw, that they keep no state, and that nothing empty or broken is drawn."""

import itertools
import sys

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from calibrator.errors import CalibratorError
from calibrator.report.figures import calibration, grains, search, style
from calibrator.report.figures.runs import Deviation, run_curves, verification
from calibrator.runs.setups import HOURGLASS
from tests.report.figures.drawings import EMPTY, FIGURES, TIME, some_slice


def drawn_numbers(figure):
    for ax in figure.axes:
        yield from (np.asarray(line.get_xydata(), float) for line in ax.lines)
        yield from (np.asarray(dots.get_offsets(), float) for dots in ax.collections)
        yield from (np.asarray(image.get_array(), float) for image in ax.images)


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_draws_finite_numbers_and_labels_its_axes(name):
    figure = FIGURES[name]()
    assert isinstance(figure, Figure)
    numbers = list(drawn_numbers(figure))
    assert numbers and all(np.isfinite(one).all() for one in numbers)
    assert any(ax.get_xlabel() for ax in figure.axes)
    # their rows have names
    assert any(ax.get_ylabel() for ax in figure.axes) or name in ("verification", "sensitivity")
    assert style.png(figure, 60).startswith(b"\x89PNG")


@pytest.mark.parametrize("name", FIGURES)
def test_no_text_of_a_figure_lies_on_another_one(name):
    figure = FIGURES[name]()
    renderer = figure._get_renderer()
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = [
                t.label1
                for t in axis.get_major_ticks()
                if low <= t.get_loc() <= high and t.label1.get_visible()
            ]
            boxes = [label.get_window_extent(renderer) for label in ticks]
            assert not any(a.overlaps(b) for a, b in itertools.pairwise(boxes)), (
                f"{name}: {ax.get_title(loc='left')}"
            )
    boxes = [ax.get_tightbbox(renderer) for ax in figure.axes]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[i + 1 :])


@pytest.mark.parametrize("name", EMPTY)
def test_an_empty_figure_is_refused_with_a_remedy(name):
    with pytest.raises(CalibratorError, match="to draw: "):
        EMPTY[name]()


@pytest.mark.parametrize(
    "draw",
    [
        lambda: grains.packing([grains.Scene("filled", np.full((2, 3), np.nan))], 1e-3),
        lambda: calibration.slices([some_slice(mean=np.full(21, np.inf))], "angle [°]", 30, 1),
        lambda: search.generational_distance([np.array([1.0, np.nan])]),
        lambda: run_curves({"compromise": [(TIME, TIME * np.nan)]}, HOURGLASS.history),
        lambda: verification([Deviation("compromise", "angle", np.nan, 0.0, None, 0.1)]),
    ],
)
def test_numbers_that_are_not_finite_are_refused(draw):
    with pytest.raises(CalibratorError, match="not finite"):
        draw()


def test_drawing_leaves_the_users_settings_and_the_gui_alone():
    before = dict(matplotlib.rcParams)
    FIGURES["slices"]()
    assert dict(matplotlib.rcParams) == before
    assert "matplotlib" in sys.modules and not hasattr(style, "pyplot")


def test_the_users_settings_do_not_leak_into_a_figure():
    plain = style.png(FIGURES["profile_likelihood"](), 50)
    with matplotlib.rc_context({"font.size": 30, "axes.facecolor": "black"}):
        assert style.png(FIGURES["profile_likelihood"](), 50) == plain
