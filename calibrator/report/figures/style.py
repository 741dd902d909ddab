"""What all figures have in common: plain functions from arrays to a matplotlib Figure.

They never show, never read a file and keep no state. Inputs are in SI units. Axes that need another
scale say so in their label (mm, g); percentages are relative errors.
"""

from __future__ import annotations

import contextlib
import functools
import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, ParamSpec

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter, LogLocator, MaxNLocator, NullFormatter

from calibrator.errors import CalibratorError

# Okabe & Ito, Color Universal Design (2008): told apart with every common colour vision.
BLUE, RED, GREEN = "#0072B2", "#D55E00", "#009E73"
ORANGE, SKY, PURPLE = "#E69F00", "#56B4E9", "#CC79A7"
INK, GREY, PALE = "#222222", "#6B7280", "#E5E7EB"
INDIVIDUALS = (BLUE, SKY, GREEN, ORANGE, PURPLE)
RECOMMENDED = "recommended set"
"""What figures call the candidate that is the compromise."""

STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.5,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": PALE,
    "grid.linewidth": 0.7,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.w_pad": 0.08,
    "figure.constrained_layout.h_pad": 0.06,
}

WIDTH = 9.0  # inches of a full-width figure
COLUMNS = 3  # panels side by side: more would make their text overlap
P = ParamSpec("P")
Draw = Callable[[], Figure]
"""Draws one figure."""


@contextlib.contextmanager
def _house_style() -> Iterator[None]:
    """The settings of this module instead of the user's, for as long as the context lasts."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draw in the house style, and settle the layout while it holds."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with _house_style():
            figure = draw(*args, **kwargs)
            # ticks are made at the first drawing, with the settings of that moment
            figure.draw_without_rendering()
        return figure

    return drawn


def png(figure: Figure, dpi: int = 160) -> bytes:
    """The figure as a PNG file, cropped to what is drawn.

    Equal figures give equal bytes.
    """
    stream = io.BytesIO()
    with _house_style():
        figure.savefig(
            stream,
            format="png",
            dpi=dpi,
            bbox_inches="tight",
            pad_inches=0.06,
            metadata={"Software": None},
        )
    return stream.getvalue()


def panel_grid(
    count: int, height: float, width: float = WIDTH, **subplots: Any
) -> tuple[Figure, list[Axes]]:
    """A figure with count panels in rows of at most three, of two where that fills the rows.

    height, width : of one row [in].
    """
    columns = min(count, 2 if count == 4 else COLUMNS)
    rows = math.ceil(count / columns)
    figure = Figure(figsize=(width if columns > 1 else 0.6 * width, height * rows + 0.35))
    axes = list(figure.subplots(rows, columns, squeeze=False, **subplots).flat)
    for spare in axes[count:]:
        spare.remove()
    return figure, axes[:count]


def require_some(things: Any, what: str, remedy: str) -> None:
    """Raise CalibratorError, with what to do, where there is nothing to draw."""
    if not len(things):
        raise CalibratorError(f"no {what} to draw: {remedy}")


def require_finite(what: str, *arrays: Any) -> None:
    """Raise CalibratorError where one of the arrays has a value that is not finite."""
    for array in arrays:
        if not np.isfinite(np.asarray(array, float)).all():
            raise CalibratorError(
                f"{what} has a value that is not finite: leave such rows out before drawing"
            )


def set_ticks(axes: Axes, horizontal: bool = True, count: int = 5) -> None:
    """Few round ticks on one axis.

    Very large or small numbers get the SI prefix instead of an offset that is easily overlooked.
    """
    axis, limits = (axes.xaxis, axes.get_xlim()) if horizontal else (axes.yaxis, axes.get_ylim())
    if axis.get_scale() == "log":
        few = limits[1] < 100 * limits[0]
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if few else (1,), numticks=count))
        axis.set_major_formatter(EngFormatter(sep=" "))
        axis.set_minor_formatter(NullFormatter())
        return
    axis.set_major_locator(MaxNLocator(count, steps=[1, 2, 2.5, 5, 10]))
    largest = max(map(abs, limits))
    if largest >= 1e5 or largest < 5e-3:
        axis.set_major_formatter(EngFormatter(sep=" "))


def draw_legend(figure: Figure, entries: Mapping[str, Any], columns: int = 4) -> None:
    """One legend under all panels."""
    figure.legend(
        list(entries.values()),
        list(entries),
        loc="outside lower center",
        ncols=min(columns, len(entries)),
    )


def line_handle(colour: str, style: Any = "-", width: float = 1.6) -> Line2D:
    """A line for the legend."""
    return Line2D([], [], color=colour, linestyle=style, linewidth=width)


def dot_handle(colour: str, marker: str = "o", **kwargs: Any) -> Line2D:
    """A dot for the legend."""
    return Line2D(
        [], [], color=colour, marker=marker, linestyle="none", **{"markersize": 5, **kwargs}
    )


def named(candidate: str) -> str:
    """A candidate as figures call it."""
    return RECOMMENDED if candidate == "compromise" else candidate


def colours_of(labels: Sequence[str]) -> dict[str, str]:
    """A colour for each candidate: always red for the compromise."""
    others = [label for label in labels if label != "compromise"]
    return {
        "compromise": RED,
        **{label: INDIVIDUALS[i % len(INDIVIDUALS)] for i, label in enumerate(others)},
    }
