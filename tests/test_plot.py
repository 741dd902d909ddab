"""Figures: what they draw, that they keep no state, and that nothing empty or broken is drawn."""

import sys

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from calibrator.errors import CalibratorError
from calibrator.report.figures import calibration, grains, style
from calibrator.report.figures.runs import Deviation, run_curves, verification
from calibrator.runs.setups import HOURGLASS, LEDGE

RNG = np.random.default_rng(7)
AT = np.linspace(0.1, 0.4, 21)
TIME = np.linspace(0, 1, 30)


def some_slice(label="rolling friction", **changes):
    runs = RNG.random(6)
    given = dict(
        label=label, chosen=0.2, positions=AT, mean=30 + AT, std=np.full(21, 0.5), runs_at=0.1 + 0.3 * runs,
        runs_mean=30 + runs, runs_error=np.full(6, 0.1), nearness=runs,
    )  # fmt: skip
    return calibration.Slice(**{**given, **changes})


def some_scene(count=40, **changes):
    return grains.Scene(
        "filled",
        RNG.random((count, 3)) * 0.02,
        (np.array([[0, 0.02], [0, 0], [0.02, 0]]),),
        **changes,
    )


def some_profile(truth=0.23):
    return calibration.Profile(
        "rolling friction", AT, (AT - 0.25) ** 2 * 1e3 + 1.0, (0.19, 0.31), 0.24, truth
    )


CURVES = {"individual A": [(TIME, TIME**2)], "compromise": [(TIME, TIME), (TIME, 0.9 * TIME)]}
ROWS = [
    Deviation(c, "bulk density", 0.01, 0.004, p, 0.03)
    for c, p in (("compromise", 0.008), ("individual A", None))
]
FIGURES = {
    "packing": lambda: grains.packing(
        [some_scene(), some_scene(surface=np.array([[0, 0.01], [0.02, 0.0]]))], 1e-3, cut=True
    ),
    "slices": lambda: calibration.slices(
        [some_slice(), some_slice("young modulus [Pa]", positions=AT * 1e7)], "angle [°]", 30.2, 0.3
    ),
    "parity": lambda: calibration.parity(
        *RNG.random((3, 9, 2)), ["bulk density [kg/m³]", "angle [°]"]
    ),
    "front_evolution": lambda: calibration.front_evolution(
        {t: RNG.random((30, 2)) for t in (0, 1, 2, 3, 20, 60)},
        np.array([[0.0, 1.0], [0.1, 0.0]]),
        ["O1", "O2"],
        {"individual A": [0.0, 1.0], "compromise": [0.1, 0.0]},
    ),
    "generational_distance": lambda: calibration.generational_distance(
        [np.geomspace(1, 1e-4, 20), np.zeros(20)]
    ),
    "profile_likelihood": lambda: calibration.profile_likelihood(
        [some_profile(), some_profile(None)]
    ),
    "ridge": lambda: calibration.ridge(
        RNG.random((50, 3)), np.array([[0.0] * 3, [1.0] * 3]), ["a", "b", "c"], np.full(3, 0.5)
    ),
    "sensitivity": lambda: calibration.sensitivity(
        {"alone": (RNG.random((2, 3)), np.full((2, 3), 0.1))}, ["x", "y"], ["a", "b", "c"]
    ),
    "mass_time": lambda: run_curves(CURVES, HOURGLASS.history),
    "profiles": lambda: run_curves(CURVES, LEDGE.profile),
    "verification": lambda: verification(ROWS),
}


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
            assert not any(a.overlaps(b) for a, b in zip(boxes, boxes[1:], strict=False)), (
                f"{name}: {ax.get_title(loc='left')}"
            )
    boxes = [ax.get_tightbbox(renderer) for ax in figure.axes]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[i + 1 :])


EMPTY = {
    "packing": lambda: grains.packing([], 1e-3),
    "packing without grains": lambda: grains.packing(
        [grains.Scene("filled", np.empty((0, 3)))], 1e-3
    ),
    "slices": lambda: calibration.slices([], "angle [°]", 30, 1),
    "parity": lambda: calibration.parity(*np.empty((3, 0, 1)), ["angle [°]"]),
    "parity without predictions": lambda: calibration.parity(
        *np.full((3, 4, 1), np.nan), ["angle [°]"]
    ),
    "front_evolution": lambda: calibration.front_evolution({}, np.ones((1, 2)), ["O1", "O2"]),
    "front_evolution without front": lambda: calibration.front_evolution(
        {0: np.ones((3, 2))}, np.empty((0, 2)), ["O1", "O2"]
    ),
    "generational_distance": lambda: calibration.generational_distance([]),
    "profile_likelihood": lambda: calibration.profile_likelihood([]),
    "ridge": lambda: calibration.ridge(
        np.empty((0, 2)), np.array([[0.0] * 2, [1.0] * 2]), ["a", "b"], np.zeros(2)
    ),
    "ridge of one parameter": lambda: calibration.ridge(
        np.ones((9, 1)), np.array([[0.0], [1.0]]), ["a"], np.zeros(1)
    ),
    "sensitivity": lambda: calibration.sensitivity({}, [], ["a"]),
    "mass_time": lambda: run_curves({}, HOURGLASS.history),
    "mass_time without runs": lambda: run_curves({"compromise": []}, HOURGLASS.history),
    "profiles": lambda: run_curves({}, LEDGE.profile),
    "verification": lambda: verification([]),
}


@pytest.mark.parametrize("name", EMPTY)
def test_an_empty_figure_is_refused_with_a_remedy(name):
    with pytest.raises(CalibratorError, match="to draw: "):
        EMPTY[name]()


@pytest.mark.parametrize(
    "draw",
    [
        lambda: grains.packing([grains.Scene("filled", np.full((2, 3), np.nan))], 1e-3),
        lambda: calibration.slices([some_slice(mean=np.full(21, np.inf))], "angle [°]", 30, 1),
        lambda: calibration.generational_distance([np.array([1.0, np.nan])]),
        lambda: run_curves({"compromise": [(TIME, TIME * np.nan)]}, HOURGLASS.history),
        lambda: verification([Deviation("compromise", "angle", np.nan, 0.0, None, 0.1)]),
    ],
)
def test_numbers_that_are_not_finite_are_refused(draw):
    with pytest.raises(CalibratorError, match="not finite"):
        draw()


def test_points_without_a_prediction_are_left_out_of_the_parity_figure():
    measured, predicted, std = RNG.random((3, 9, 1))
    predicted[4] = np.nan
    dots = max(
        calibration.parity(measured, predicted, std, ["angle [°]"]).axes[0].lines,
        key=lambda line: len(line.get_xdata()),
    )
    assert len(dots.get_xdata()) == 8


def test_drawing_leaves_the_users_settings_and_the_gui_alone():
    before = dict(matplotlib.rcParams)
    FIGURES["slices"]()
    assert dict(matplotlib.rcParams) == before
    assert "matplotlib" in sys.modules and not hasattr(style, "pyplot")


def test_the_users_settings_do_not_leak_into_a_figure():
    plain = style.png(FIGURES["profile_likelihood"](), 50)
    with matplotlib.rc_context({"font.size": 30, "axes.facecolor": "black"}):
        assert style.png(FIGURES["profile_likelihood"](), 50) == plain


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
