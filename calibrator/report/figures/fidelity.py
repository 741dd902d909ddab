"""The figure of full over cheap runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from calibrator.report.figures.style import BLUE, COLUMNS, panel_grid, require_some


@dataclass(frozen=True, eq=False)
class Pairs:
    """One response of both kinds of runs at the same sets: cheap and full (k,), NaN for none.

    label : of the axes; slope : of the model's line, 0 where the cheap runs are not used.
    """

    label: str
    cheap: np.ndarray
    full: np.ndarray
    slope: float


def both_kinds(panels: Sequence[Pairs]) -> Figure:
    """A panel for each response, with the model's line through the middle of the points."""
    figure, axes = panel_grid(len(panels), 3.1)
    for column, (ax, own) in enumerate(zip(axes, panels, strict=True)):
        there = np.isfinite(own.cheap + own.full)
        require_some(own.full[there], f"set run both ways for {own.label}", "make more runs")
        cheap, full = own.cheap[there], own.full[there]
        ax.plot(cheap, full, "o", color=BLUE, markersize=4)
        if own.slope:
            ends = np.array([cheap.min(), cheap.max()])
            ax.plot(ends, full.mean() + own.slope * (ends - cheap.mean()), "-", color="0.5", lw=1)
        ax.set(title=own.label, xlabel="cheap runs")
        ax.set_ylabel("" if column % COLUMNS else "full runs")
    return figure
