"""Figures of the interpolant, and of what the targets say about the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from calibrator.errors import CalibratorError
from calibrator.report.figures.style import (
    BLUE,
    COLUMNS,
    GREEN,
    GREY,
    INK,
    RECOMMENDED,
    RED,
    SKY,
    WIDTH,
    dot_handle,
    draw_legend,
    line_handle,
    panel_grid,
    require_finite,
    require_some,
    set_ticks,
    styled,
)

LEVEL_95 = 3.84  # rise of chi2 that bounds 95 % of one parameter

# The interpolant


@dataclass(frozen=True, eq=False)
class Slice:
    """One response along one parameter, the others held at the compromise.

    Attributes
    ----------
    label : of the parameter's axis
    chosen : its value at the compromise
    positions, mean, std : (k,) the interpolant along the line and its standard deviation
    runs_at, runs_mean, runs_error : (p,) parameter value, mean response and its standard error at
        the points of the database
    nearness : (p,) 0 to 1, how close each of those points lies to the line: distant ones are faint
    failed_at : (f,) parameter values of the runs that failed
    runs_fail : (k,) where along the line a run is likely to fail
    log : whether the parameter has a log scale
    """

    label: str
    chosen: float
    positions: np.ndarray
    mean: np.ndarray
    std: np.ndarray
    runs_at: np.ndarray
    runs_mean: np.ndarray
    runs_error: np.ndarray
    nearness: np.ndarray
    failed_at: np.ndarray
    runs_fail: np.ndarray
    log: bool = False


@styled
def slices(panels: Sequence[Slice], label: str, target: float, band: float) -> Figure:
    """A response along each parameter through the compromise, with database points and target.

    Parameters
    ----------
    label : axis label of the response
    target, band : measured value, and half width within which it counts as met
    """
    require_some(panels, "slice", "give one per calibrated parameter")
    figure, axes = panel_grid(len(panels), 2.9, sharey=True)
    for index, (ax, panel) in enumerate(zip(axes, panels, strict=True)):
        require_finite(panel.label, panel.mean, panel.std, panel.runs_mean, panel.runs_error)
        _draw_slice(ax, panel, target, band)
        ax.set_ylabel(label if index % COLUMNS == 0 else "")
    set_ticks(axes[0], horizontal=False)
    entries = {
        "interpolant ± 2 standard deviations": (Patch(color=BLUE, alpha=0.2), line_handle(BLUE)),
        "runs, fainter with distance": dot_handle(INK, alpha=0.6),
        "target and its band": (Patch(color=GREEN, alpha=0.18), line_handle(GREEN, width=1)),
        RECOMMENDED: line_handle(RED, "--", 1.3),
    }
    if any(len(panel.failed_at) for panel in panels):
        entries["failed runs"] = dot_handle(RED, "x")
    if any(panel.runs_fail.any() for panel in panels):
        entries["runs are likely to fail"] = Patch(color=GREY, alpha=0.25)
    draw_legend(figure, entries)
    return figure


def _draw_slice(ax: Axes, panel: Slice, target: float, band: float) -> None:
    ax.axhspan(target - band, target + band, color=GREEN, alpha=0.18, linewidth=0)
    ax.axhline(target, color=GREEN, linewidth=1)
    shades = [(*to_rgb(INK), 0.12 + 0.6 * float(n)) for n in panel.nearness]
    low, high = panel.runs_mean - panel.runs_error, panel.runs_mean + panel.runs_error
    ax.vlines(panel.runs_at, low, high, colors=shades, linewidth=1)
    ax.scatter(panel.runs_at, panel.runs_mean, s=16, color=shades, linewidth=0)
    ax.fill_between(
        panel.positions,
        panel.mean - 2 * panel.std,
        panel.mean + 2 * panel.std,
        color=BLUE,
        alpha=0.2,
        linewidth=0,
    )
    ax.plot(panel.positions, panel.mean, color=BLUE, linewidth=1.8)
    # the line may lie on the frame, and is seen there too
    ax.axvline(panel.chosen, color=RED, linewidth=1.3, linestyle="--", clip_on=False)
    across = ax.get_xaxis_transform()  # heights as shares of the panel, which keeps its own scale
    fails = panel.runs_fail
    ax.fill_between(
        panel.positions, 0, 1, fails, color=GREY, alpha=0.25, linewidth=0, transform=across
    )
    ax.scatter(
        panel.failed_at, 0 * panel.failed_at, 20, color=RED, marker="x", clip_on=False,
        transform=across,
    )  # fmt: skip
    ax.set(xlabel=panel.label, xlim=(panel.positions[0], panel.positions[-1]))
    ax.set_xscale("log" if panel.log else "linear")
    set_ticks(ax)


@styled
def parity(
    measured: np.ndarray, predicted: np.ndarray, std: np.ndarray, labels: Sequence[str]
) -> Figure:
    """Leave-one-out predictions over simulated means, one panel per response.

    All arrays are (p, m), NaN where there is none.
    """
    require_some(measured, "cross-validated point", "make runs first")
    figure, axes = panel_grid(len(labels), 3.1)
    for column, (ax, label) in enumerate(zip(axes, labels, strict=True)):
        there = np.isfinite(measured[:, column]) & np.isfinite(predicted[:, column])
        require_some(measured[there], f"cross-validated point of {label}", "make more runs")
        own = measured[there, column], predicted[there, column], std[there, column]
        _draw_parity(ax, *own)
        ax.set(title=f"{label}\n{_rms(own[0], own[1])}", xlabel="simulated, mean of replicates")
        ax.set_ylabel("" if column % COLUMNS else "predicted without that point")
    return figure


def _draw_parity(ax: Axes, measured: np.ndarray, predicted: np.ndarray, std: np.ndarray) -> None:
    both = np.concatenate([measured, predicted - std, predicted + std])
    margin = 0.05 * (np.ptp(both) or abs(both[0]) or 1.0)
    ends = np.array([both.min() - margin, both.max() + margin])
    ax.plot(ends, ends, color=GREY, linewidth=1)
    ax.errorbar(
        measured, predicted, std, fmt="o", color=BLUE, markersize=4.5, linewidth=1, alpha=0.85
    )
    ax.set(xlim=ends, ylim=ends, aspect="equal")
    set_ticks(ax, count=4)
    set_ticks(ax, horizontal=False, count=4)


def _rms(measured: np.ndarray, predicted: np.ndarray) -> str:
    """The root mean square error in words."""
    rms = float(np.sqrt(np.mean((measured - predicted) ** 2)))
    return f"rms error {rms:.2g} ({100 * rms / float(np.mean(np.abs(measured))):.1f} %)"


# What the targets say about the parameters


@dataclass(frozen=True, eq=False)
class Profile:
    """A parameter's profile.

    label : of its axis; positions, chi2 : (b,); interval : of 95 %; chosen : its value at the
    compromise; truth : where it is known; log : whether the parameter has a log scale.
    """

    label: str
    positions: np.ndarray
    chi2: np.ndarray
    interval: tuple[float, float]
    chosen: float
    truth: float | None = None
    log: bool = False


@styled
def profile_likelihood(profiles: Sequence[Profile]) -> Figure:
    """Rise of chi2 above its minimum along each parameter, with the 95 % interval.

    The other parameters are adapted at every position.
    """
    require_some(profiles, "profile", "calibrate first")
    figure, axes = panel_grid(len(profiles), 2.7, sharey=True)
    for index, (ax, profile) in enumerate(zip(axes, profiles, strict=True)):
        require_finite(profile.label, profile.positions, profile.chi2)
        _draw_profile(ax, profile)
        ax.set_ylabel("χ² above its minimum" if index % COLUMNS == 0 else "")
    entries = {
        "profile": line_handle(BLUE),
        "95 % interval": Patch(color=BLUE, alpha=0.14),
        RECOMMENDED: line_handle(RED, "--", 1.3),
    }
    if any(profile.truth is not None for profile in profiles):
        entries["truth"] = line_handle(INK, ":", 1.8)
    draw_legend(figure, entries)
    return figure


def _draw_profile(ax: Axes, profile: Profile) -> None:
    ax.axvspan(*profile.interval, color=BLUE, alpha=0.14, linewidth=0)
    ax.axhline(LEVEL_95, color=GREY, linewidth=0.9)
    ax.plot(profile.positions, profile.chi2 - profile.chi2.min(), color=BLUE, linewidth=1.8)
    ax.axvline(profile.chosen, color=RED, linewidth=1.3, linestyle="--", clip_on=False)
    if profile.truth is not None:
        # the truth may lie outside the box, and is then not seen
        ax.axvline(profile.truth, color=INK, linewidth=1.8, linestyle=":")
    ax.set(
        xlabel=profile.label,
        xlim=(profile.positions[0], profile.positions[-1]),
        ylim=(0, 3.2 * LEVEL_95),
        xscale="log" if profile.log else "linear",
    )
    set_ticks(ax)


@styled
def ridge(
    accepted: np.ndarray,
    bounds: np.ndarray,
    labels: Sequence[str],
    chosen: np.ndarray,
    failed: np.ndarray,
    logs: Sequence[bool],
) -> Figure:
    """Parameter sets that the targets accept, projected on every pair of parameters.

    A narrow band is a ridge.

    Parameters
    ----------
    accepted : (k, d) sets
    bounds : (2, d) the box
    labels : d axis labels
    chosen : (d,) the compromise
    failed : (f, d) sets of the runs that failed, NaN where they have no such parameter
    logs : d, which parameters have a log scale
    """
    require_some(accepted, "accepted parameter set", "calibrate first")
    require_finite("accepted sets", accepted)
    last = len(labels) - 1
    if last < 1:
        raise CalibratorError("a single parameter has no ridge to draw: calibrate two or more")
    figure = Figure(figsize=(min(WIDTH, 1.4 + 2.6 * last), 0.9 + 1.75 * last))
    axes = iter(figure.subplots(last, last, squeeze=False, sharex="col", sharey="row").flat)
    for row, column in np.ndindex(last, last):
        ax, y = next(axes), row + 1
        if column > row:
            ax.remove()
            continue
        pair = [column, y]
        ax.set(xscale="log" if logs[column] else "linear", yscale="log" if logs[y] else "linear")
        _draw_pair(ax, accepted[:, pair], bounds[:, pair], chosen[pair], failed[:, pair])
        ax.set_xlabel(labels[column] if row == last - 1 else "")
        ax.set_ylabel(labels[y] if column == 0 else "")
    entries = {
        "accepted by the targets": dot_handle(BLUE, alpha=0.6),
        RECOMMENDED: dot_handle(RED, "*", markersize=11),
    }
    if len(failed):
        entries["failed runs"] = dot_handle(GREY, "x")
    draw_legend(figure, entries)
    return figure


def _draw_pair(
    ax: Axes, accepted: np.ndarray, bounds: np.ndarray, chosen: np.ndarray, failed: np.ndarray
) -> None:
    """Accepted sets (k, 2), failed runs (f, 2) and the compromise (2,) along two parameters."""
    failed = failed[np.isfinite(failed).all(axis=1)]
    ax.scatter(failed[:, 0], failed[:, 1], 20, color=GREY, marker="x", linewidth=1)
    ax.scatter(accepted[:, 0], accepted[:, 1], s=4, color=BLUE, alpha=0.25, linewidth=0)
    ax.plot(*chosen, "*", color=RED, markeredgecolor="white", markersize=12, clip_on=False)
    ax.set(xlim=bounds[:, 0], ylim=bounds[:, 1])
    set_ticks(ax, count=4)
    set_ticks(ax, horizontal=False, count=4)


@styled
def sensitivity(
    indices: Mapping[str, tuple[np.ndarray, np.ndarray]],
    labels: Sequence[str],
    names: Sequence[str],
) -> Figure:
    """Sobol indices as bars with their 95 % intervals, one panel per response.

    Parameters
    ----------
    indices : kind of index -> values and half widths of their intervals, both (m, d)
    labels : m titles
    names : d parameters
    """
    require_some(labels, "sensitivity", "calibrate first")
    figure, axes = panel_grid(len(labels), 1.1 + 0.36 * len(names), sharey=True)
    places = np.arange(len(names))
    thick = 0.76 / len(indices)
    for row, (ax, label) in enumerate(zip(axes, labels, strict=True)):
        for i, (values, errors) in enumerate(indices.values()):
            at = places + (i + 0.5) * thick - 0.38
            ends = np.clip([values[row] - errors[row], values[row] + errors[row]], 0, 1)
            ax.barh(at, values[row], thick, color=(BLUE, SKY)[i % 2])
            ax.hlines(at, *ends, color=INK, linewidth=1.1)
        ax.set(title=label, xlabel="share of the variance", xlim=(0, 1))
        ax.grid(False, axis="y")
    axes[0].set_yticks(places, names)
    axes[0].set_ylim(len(names) - 0.5, -0.5)
    draw_legend(figure, {kind: Patch(color=(BLUE, SKY)[i % 2]) for i, kind in enumerate(indices)})
    return figure
