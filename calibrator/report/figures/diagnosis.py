"""Figures of a diagnosis: where the disagreement is, what explains it, and that it went away.

Arrays in, a Figure out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calibrator.report.figures.style import BLUE, GREY, INK, ORANGE, PALE, RED, SKY, WIDTH, styled

ROW = 0.24  # inches of one line of a chart


def _figure(rows: int, width: float = WIDTH, row: float = ROW) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(width, 1.1 + row * rows))
    axes: Axes = figure.subplots()
    return figure, axes


@styled
def residuals(
    labels: Sequence[str], held_out: Sequence[bool], before: np.ndarray, after: np.ndarray | None
) -> Figure:
    """Residuals (n,) in standard errors, of the model as it is and with the effect added."""
    figure, ax = _figure(len(labels))
    at = np.arange(len(labels))[::-1]
    ax.axvspan(-2, 2, color=PALE, lw=0, zorder=0)
    for y, z, new in zip(at, before, before if after is None else after, strict=True):
        ax.plot([z, new], [y, y], color=GREY, lw=0.8, zorder=1)
    ax.scatter(before, at, s=32, facecolor="white", edgecolor=RED, zorder=3, label="model as it is")
    if after is not None:
        ax.scatter(after, at, s=32, color=BLUE, zorder=3, label="with the effect")
    ax.set_yticks(
        at, [f"{text} *" if held else text for text, held in zip(labels, held_out, strict=True)]
    )
    ax.set_xlabel("(measured − simulated) / standard error;   * held out")
    ax.axvline(0, color=INK, lw=0.8)
    figure.legend(loc="outside upper right", ncols=2)
    return figure


@styled
def locations(names: Sequence[str], p: np.ndarray) -> Figure:
    """How surprising each experiment is, predicted from all others: p (k,), logarithmic."""
    figure, ax = _figure(len(names), 0.7 * WIDTH, 0.34)
    at = np.arange(len(names))[::-1]
    ax.barh(
        at,
        -np.log10(np.maximum(p, 1e-12)),
        color=[RED if one < 0.05 else GREY for one in p],
        height=0.6,
    )
    ax.axvline(-np.log10(0.05), color=INK, lw=0.9, ls="--")
    ax.set_yticks(at, names)
    ax.set_xlabel("−log₁₀ p of the measurements there, given all others (dashed: 0.05)")
    return figure


@styled
def heat(
    rows: Sequence[str], columns: Sequence[str], values: np.ndarray, label: str, largest: float
) -> Figure:
    """A matrix (r, c) as colours, with its numbers written in; the scale ends at +-largest."""
    figure, ax = _figure(len(rows) + 4, min(WIDTH, 2.6 + 0.62 * len(columns)), 0.3)
    ax.imshow(values, cmap="RdBu_r", vmin=-largest, vmax=largest, aspect="auto")
    ax.set_xticks(range(len(columns)), columns, rotation=40, ha="right", rotation_mode="anchor")
    ax.set_yticks(range(len(rows)), rows)
    ax.grid(False)
    for (i, j), value in np.ndenumerate(values):
        ink = "white" if abs(value) > 0.7 * largest else INK
        ax.text(
            j,
            i,
            f"{value:.1f}".replace("-", "−"),
            ha="center",
            va="center",
            fontsize=7.5,
            color=ink,
        )
    ax.set_title(label)
    return figure


@styled
def posterior(weights: Mapping[str, float], adequate: Mapping[str, bool], needed: float) -> Figure:
    """Probability of each explanation; those that do not fit at all are hatched."""
    figure, ax = _figure(len(weights), 0.8 * WIDTH, 0.32)
    at = np.arange(len(weights))[::-1]
    for y, (name, weight) in zip(at, weights.items(), strict=True):
        poor = not adequate.get(name, True)
        ax.barh(
            y,
            weight,
            height=0.6,
            color=PALE if poor else BLUE,
            edgecolor=GREY,
            hatch="////" if poor else None,
            lw=0.6,
        )
    ax.axvline(needed, color=INK, lw=0.9, ls="--")
    ax.set_yticks(at, list(weights))
    ax.set_xlim(0, 1.02)
    ax.set_xlabel("posterior probability (dashed: needed for a name; hatched: does not fit)")
    return figure


@styled
def ghosts(shares: Mapping[str, float], median: float, upper: float) -> Figure:
    """Share of chi2 that each effect removes, beside what a random library reaches."""
    figure, ax = _figure(len(shares), 0.8 * WIDTH, 0.32)
    at = np.arange(len(shares))[::-1]
    ax.axvspan(0, upper, color=PALE, lw=0, label="ghosts, 95 %")
    ax.axvline(median, color=GREY, lw=1.2, label="ghosts, median")
    ax.barh(at, list(shares.values()), height=0.55, color=ORANGE)
    ax.set_yticks(at, list(shares))
    ax.set_xlim(0, 1.02)
    ax.set_xlabel("share of χ² that the effect alone removes")
    figure.legend(loc="outside upper right", ncols=2)
    return figure


@styled
def gap(
    labels: Sequence[str],
    used: np.ndarray,
    held_out: np.ndarray | None,
    floors: tuple[float, float],
) -> Figure:
    """Gap on the data used and held out (k,), of each explanation that was run on YADE."""
    figure, ax = _figure(len(labels) * 2, 0.8 * WIDTH)
    at = np.arange(len(labels))[::-1] * 1.0
    ax.barh(at + 0.2, used, height=0.36, color=BLUE, label="data used")
    ax.plot(
        [floors[0]] * 2,
        [at[-1] - 0.5, at[0] + 0.5],
        color=INK,
        lw=0.9,
        ls="--",
        label="noise alone",
    )
    if held_out is not None:
        ax.barh(at - 0.2, held_out, height=0.36, color=SKY, label="held out")
    ax.set_yticks(at, labels)
    ax.set_xlabel("gap: root mean square of the residuals, in standard errors")
    figure.legend(loc="outside upper right", ncols=3)
    return figure


@styled
def powers(labels: Sequence[str], detectable: np.ndarray, nameable: np.ndarray) -> Figure:
    """Smallest amplitudes (k,) that would be seen and named, in plausible sizes; inf: never."""
    figure, ax = _figure(len(labels), 0.85 * WIDTH, 0.32)
    at = np.arange(len(labels))[::-1]
    low, high = (np.minimum(values, 30.0) for values in (detectable, nameable))
    for y, a, b in zip(at, low, high, strict=True):
        ax.plot([a, b], [y, y], color=GREY, lw=1)
    ax.scatter(low, at, s=34, facecolor="white", edgecolor=BLUE, zorder=3, label="seen from")
    ax.scatter(high, at, s=34, color=BLUE, zorder=3, label="named from")
    ax.axvline(1, color=INK, lw=0.9, ls="--")
    ax.set_xscale("log")
    ax.set_xlim(min(0.1, low.min() / 1.5), 45)
    ax.set_ylim(-0.6, len(labels) - 0.4)
    ax.set_yticks(at, labels)
    ax.set_xlabel("amplitude over the plausible one (dashed); 30 stands for larger and for never")
    figure.legend(loc="outside upper right", ncols=2)
    return figure
