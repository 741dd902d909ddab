"""Figures of curves that are targets."""

from __future__ import annotations

from matplotlib.figure import Figure

from calibrator.report.figures.style import GREEN, INK, WIDTH, line_handle, panel_grid, styled
from calibrator.runs.setup import Curve
from calibrator.verification.curve import CurveComparison


@styled
def measured_and_simulated(found: CurveComparison, curve: Curve) -> Figure:
    """A measured curve with its band, the fresh runs and their mean, and below what differs."""
    along, up = curve.scales
    figure, axes = panel_grid(2, 2.6, WIDTH)
    x, mean = along * found.x, found.simulated.mean(axis=0)
    for ax, zero in zip(axes, (0.0 * found.measured, found.measured), strict=True):
        low, high = (found.measured - zero + s * found.half_width for s in (-1, 1))
        ax.fill_between(x, up * low, up * high, color=INK, alpha=0.15, linewidth=0)
        ax.plot(x, up * (found.measured - zero), color=INK, linewidth=1.4)
        ax.plot(x, up * (found.simulated - zero).T, color=GREEN, linewidth=0.6, alpha=0.5)
        ax.plot(x, up * (mean - zero), color=GREEN, linewidth=1.8)
        ax.set(xlabel=curve.labels[0])
    axes[0].set(ylabel=curve.labels[1])
    axes[1].set(ylabel=f"simulated − measured {curve.labels[1].split()[-1]}")
    handles = [line_handle(INK), line_handle(GREEN, width=0.8), line_handle(GREEN, width=1.8)]
    axes[0].legend(handles, ["measured ± band", "fresh runs", "their mean"])
    return figure
