"""Figures of single runs: curves, profiles, deviations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from calibrator.report.figures.style import (
    GREEN,
    INK,
    RED,
    WIDTH,
    colours_of,
    dot_handle,
    draw_legend,
    named,
    panel_grid,
    require_finite,
    require_some,
    styled,
)
from calibrator.runs.setup import Curve

Curves = Mapping[str, Sequence[tuple[np.ndarray, np.ndarray]]]
"""Candidate -> its runs, each with the two arrays (n,) of a curve."""


@styled
def run_curves(runs: Curves, curve: Curve) -> Figure:
    """A curve of single runs, all that there are.

    Raises CalibratorError where there is none, or one that is not finite.
    """
    found = [run for own in runs.values() for run in own]
    require_some(found, f"{curve.up.replace('_', ' ')} of a run", "verify or validate first")
    figure, (ax,) = panel_grid(1, 3.0 if curve.true_to_scale else 3.3, WIDTH * 1.2)
    _thin_lines(ax, runs, *curve.scales)
    across, up = curve.labels
    ax.set(xlabel=across, ylabel=up, xlim=(0, None), ylim=(0, None))
    if curve.true_to_scale:
        ax.set_aspect("equal")
    return figure


def _thin_lines(ax: Axes, curves: Curves, along: float, up: float) -> None:
    """All runs, the compromise last so that it lies on top; one legend entry per candidate."""
    colours = colours_of(list(curves))
    for label in sorted(curves, key=lambda label: label == "compromise"):
        for index, (x, y) in enumerate(curves[label]):
            require_finite(label, x, y)
            name = f"{named(label)} ({len(curves[label])})" if index == 0 else None
            ax.plot(along * x, up * y, color=colours[label], linewidth=0.9, alpha=0.85, label=name)
    legend = ax.legend(
        loc="upper left", bbox_to_anchor=(1.0, 1.0), title="runs of", alignment="left"
    )
    legend.get_title().set_fontsize(9)
    for line in legend.get_lines():
        line.set_linewidth(2)


@dataclass(frozen=True)
class Deviation:
    """A response at a candidate relative to its target.

    All are fractions of the target (0.01 is one per cent); promised is None where nothing was
    interpolated.
    """

    candidate: str
    label: str
    simulated: float
    error: float
    promised: float | None
    band: float


@styled
def verification(rows: Sequence[Deviation]) -> Figure:
    """Simulated against target in per cent, with bars of two standard errors.

    One panel per response, one line per candidate.
    """
    require_some(rows, "verified response", "verify first")
    labels = list(dict.fromkeys(r.label for r in rows))
    candidates = list(dict.fromkeys(r.candidate for r in rows))
    figure, axes = panel_grid(len(labels), 1.3 + 0.34 * len(candidates), sharey=True)
    for ax, label in zip(axes, labels, strict=True):
        own = [r for r in rows if r.label == label]
        require_finite(label, [(r.simulated, r.error, r.band) for r in own])
        _draw_deviations(ax, own, candidates)
        ax.set(title=label, xlabel="deviation from target [%]")
    axes[0].set_yticks(range(len(candidates)), [named(one) for one in candidates])
    axes[0].set_ylim(len(candidates) - 0.5, -0.5)
    entries: dict[str, Artist] = {
        "simulated ± 2 standard errors": dot_handle(INK),
        "band within which the target counts as met": Patch(color=GREEN, alpha=0.18),
    }
    if any(r.promised is not None for r in rows):
        entries["promised by the interpolant"] = dot_handle(INK, "D", markerfacecolor="white")
    draw_legend(figure, entries, 3)
    return figure


def _draw_deviations(ax: Axes, rows: Sequence[Deviation], candidates: Sequence[str]) -> None:
    """One panel: the rows of a response, each at its candidate's place, on a band of its own."""
    ax.axvline(0, color=GREEN, linewidth=1)
    for row in rows:
        place = candidates.index(row.candidate)
        colour = RED if row.candidate == "compromise" else INK
        half = 100 * row.band  # wider for a candidate of fewer runs
        ax.barh(place, 2 * half, 0.92, left=-half, color=GREEN, alpha=0.18, linewidth=0)
        ax.errorbar(
            100 * row.simulated,
            place,
            xerr=200 * row.error,
            fmt="o",
            color=colour,
            markersize=6,
            linewidth=1.6,
        )
        if row.promised is not None:
            ax.plot(
                100 * row.promised,
                place - 0.26,
                "D",
                color=colour,
                markerfacecolor="white",
                markersize=5,
            )
    ax.grid(False, axis="y")
    ax.xaxis.set_major_locator(MaxNLocator(5))
