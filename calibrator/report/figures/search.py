"""Figures of the search: the population on its way, and how the front settles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from calibrator.report.figures.style import (
    BLUE,
    INDIVIDUALS,
    INK,
    RECOMMENDED,
    RED,
    WIDTH,
    dot_handle,
    draw_legend,
    line_handle,
    panel_grid,
    require_finite,
    require_some,
    styled,
)

SMALL = 0.1
"""Of the largest error of any generation: a front below that is drawn on a logarithmic scale."""
DECADES = 1e-3
"""Of the largest error of the front: the least that a logarithmic scale shows."""


@styled
def front_evolution(
    snapshots: Mapping[int, np.ndarray],
    front: np.ndarray,
    names: Sequence[str],
    candidates: Mapping[str, Sequence[float]] | None = None,
) -> Figure:
    """The population on its way to the Pareto front, as in Fig. 6 of the paper.

    Where the first objective of the front is nearly zero beside that of the first generations its
    axis is logarithmic, so that the front is more than a line along the axis.

    Parameters
    ----------
    snapshots : generation -> objectives (n, 2) of the whole population
    front : (p, 2) the final one
    names : axis labels of the two objectives; the first is drawn upwards
    candidates : label -> its two objectives, marked in the last panel, which is enlarged to the
        final population
    """
    require_some(snapshots, "generation", "name generations to keep in the settings of the search")
    require_some(front, "Pareto front", "run the search first")
    figure, axes = panel_grid(len(snapshots), 2.7)
    largest = 1.04 * np.max([found.max(axis=0) for found in snapshots.values()], axis=0)
    largest[largest <= 0] = 1.0  # an objective that is zero everywhere still needs an axis
    least = least_shown(front, largest[0])
    for ax, generation in zip(axes, sorted(snapshots), strict=True):
        require_finite(f"generation {generation}", snapshots[generation])
        _draw_generation(ax, snapshots[generation], front, largest, least)
        ax.set(title=f"generation {generation}", xlabel=names[1])
        first = ax.get_subplotspec()
        ax.set_ylabel(names[0] if first is not None and first.is_first_col() else "")
    _enlarge(axes[-1], np.concatenate([front, snapshots[max(snapshots)]]), least)
    _mark(axes[-1], candidates or {}, least)
    if least:
        for ax in axes:
            _logarithmic(ax)
    entries = {
        "population": dot_handle(BLUE, markersize=4, alpha=0.6),
        "final Pareto front": line_handle(RED, width=1.2),
    }
    if candidates:
        entries |= {
            "individuals": dot_handle(INK),
            RECOMMENDED: dot_handle(RED, "*", markersize=11),
        }
    draw_legend(figure, entries)
    return figure


def _draw_generation(
    ax: Axes, found: np.ndarray, front: np.ndarray, largest: np.ndarray, least: float
) -> None:
    """A population (n, 2) and the final front, from zero, or `least`, to the largest of all."""
    ax.plot(front[:, 1], np.maximum(front[:, 0], least), color=RED, linewidth=1.2, zorder=3)
    up = np.maximum(found[:, 0], least)
    ax.scatter(found[:, 1], up, s=5, color=BLUE, alpha=0.35, linewidth=0)
    ax.set(
        xlim=(-0.02 * largest[1], largest[1]),
        ylim=(0.7 * least, 1.5 * largest[0]) if least else (-0.02 * largest[0], largest[0]),
    )


def least_shown(front: np.ndarray, largest: float) -> float:
    """Error from which a logarithmic axis starts; 0 where a linear one shows the front (p, k).

    largest : error of any generation.
    """
    most = float(front[:, 0].max())
    return DECADES * most if 0 < most < SMALL * largest else 0.0


def _logarithmic(ax: Axes) -> None:
    """A logarithmic axis upwards, with plain numbers."""
    low, high = ax.get_ylim()
    ax.set_yscale("log")
    ax.set_ylim(low, high)
    ax.yaxis.set_major_locator(LogLocator(numticks=6))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_formatter(NullFormatter())


def _enlarge(ax: Axes, points: np.ndarray, least: float) -> None:
    """Let the panel show these points (n, 2) alone."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.14 * np.where(high > low, high - low, 1.0)
    ax.set(
        xlim=(low[1] - margin[1], high[1] + margin[1]),
        ylim=(0.7 * max(least, low[0]), 2 * high[0])
        if least
        else (low[0] - margin[0], high[0] + margin[0]),
    )
    ax.set_title(f"{ax.get_title(loc='left')}, enlarged")


def _mark(ax: Axes, candidates: Mapping[str, Sequence[float]], least: float) -> None:
    """Letters for the individuals above the front, a star for the compromise."""
    for label, (found, right, *_) in candidates.items():
        up = max(found, least)
        if label == "compromise":
            ax.plot(
                right,
                up,
                "*",
                color=RED,
                markeredgecolor="white",
                markeredgewidth=0.6,
                markersize=13,
                zorder=6,
            )
            continue
        ax.plot(right, up, "o", color=INK, markersize=5, zorder=5)
        letter = label.removeprefix("individual ")
        ax.annotate(
            letter,
            (right, up),
            (5, 5),
            textcoords="offset points",
            color=INK,
            weight="bold",
            zorder=6,
        )


@styled
def generational_distance(curves: Sequence[np.ndarray]) -> Figure:
    """Mean distance of each generation's first front to the last one, as in Fig. 7 of the paper.

    curves : one (g,) per search.
    """
    require_some(curves, "search", "repeat the search once or more")
    figure, axes = panel_grid(2, 2.9, WIDTH * 0.85)
    for index, curve in enumerate(curves):
        distance = np.asarray(curve, float)
        require_finite("generational distance", distance)
        generation = np.arange(len(distance))
        positive = distance > 0  # the last front is the reference itself
        for ax, part in zip(axes, (distance >= 0, positive), strict=True):
            ax.plot(
                generation[part],
                distance[part],
                color=INDIVIDUALS[index % 5],
                linewidth=1.3,
                label=f"repeat {index + 1}",
            )
    for ax, title in zip(axes, ("linear", "logarithmic"), strict=True):
        ax.set(xlabel="generation", title=title)
    axes[0].set(ylabel="mean generational distance", ylim=(0, None))
    axes[0].legend()
    if any(np.any(np.asarray(curve) > 0) for curve in curves):
        axes[1].set_yscale("log")
    return figure
