"""The runs of every seed as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.methods import OURS
from calibrator.report.figures.style import BLUE, GREEN, INK, ORANGE, RED, SKY, STYLE

WAYS = {
    "ours": (RED, "ours"),
    "design": (GREEN, "other designs"),
    "oracle": (BLUE, "peer, judged by an oracle after each round"),
    "verified": (SKY, "peer, verified after each round"),
    "by_itself": (ORANGE, "peer, stopping by itself"),
}

TITLES = {"2": "2 parameters", "2 hard": "2 parameters, closely", "5": "5 parameters"}


def plot(reachable: dict[str, Any], folder: Path) -> None:
    """Runs of every seed by method, one panel for each task."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    with matplotlib.rc_context(STYLE):
        figure, panels = plt.subplots(1, len(reachable), figsize=(13, 6), sharey=True)
        names = list(dict.fromkeys(name for rows in reachable.values() for name in rows))
        for axis, (task, rows) in zip(panels, reachable.items(), strict=True):
            for name, row in rows.items():
                draw_method(axis, names.index(name), name, row)
            axis.set(
                xscale="log",
                xlabel="runs, verification included",
                title=TITLES[task],
                xlim=(7, 1100),
            )
            axis.set_xticks([10, 30, 100, 300, 1000], ["10", "30", "100", "300", "1000"])
            axis.minorticks_off()
        panels[0].set_yticks(range(len(names)), names)
        panels[0].set_ylim(len(names) - 0.5, -0.9)
        figure.legend(handles=handles(plt.Line2D), loc="outside lower center", ncols=3)
        figure.savefig(folder / "runs_needed.png", dpi=150)


def handles(line: Any) -> list[Any]:
    """What the legend shows."""
    found = [
        line([], [], ls="", marker="o", color=colour, label=label)
        for colour, label in WAYS.values()
    ]
    found.append(line([], [], ls="", marker="x", color=INK, label="a seed that fails"))
    median: dict[str, Any] = {"marker": "|", "markersize": 11, "markeredgewidth": 2}
    found.append(line([], [], ls="", color=INK, label="median of all seeds", **median))
    return found


def draw_method(axis: Any, place: int, name: str, row: dict[str, Any]) -> None:
    """One method; a peer in each way to count."""
    peer = {
        "oracle": row,
        "verified": row.get("verified"),
        "by_itself": row.get("by_itself"),
    }
    strips = peer if "by_itself" in row else {"ours" if name == OURS else "design": row}
    for offset, (way, strip) in zip(
        (-0.27, 0, 0.27) if len(strips) > 1 else (0,), strips.items(), strict=True
    ):
        draw_strip(axis, place + offset, strip, WAYS[way][0], INK)


def draw_strip(axis: Any, place: float, strip: dict[str, Any], colour: str, ink: str) -> None:
    """The seeds of one method, and the median of what they spent."""
    styles: dict[bool, dict[str, Any]] = {
        True: {"marker": "o", "color": colour},
        False: {"marker": "x", "color": ink},
    }
    for hit, style in styles.items():
        runs = [r for r, m in zip(strip["runs"], strip["met"], strict=True) if m == hit]
        axis.plot(runs, jittered(place, len(runs)), ls="", markersize=4, alpha=0.7, **style)
    ends = [place - 0.13, place + 0.13]
    axis.plot([strip["median_runs"]] * 2, ends, color=colour, linewidth=2.4)


def jittered(place: float, count: int) -> np.ndarray:
    """Heights (count,) around a row, so that equal numbers are seen."""
    return place + 0.16 * (np.arange(count) % 5 - 2) / 4
