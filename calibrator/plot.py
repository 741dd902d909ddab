"""Figures: plain functions from arrays to a matplotlib Figure. They never show, never read a file and keep no state.

Inputs are in SI units. Axes that need another scale say so in their label (mm, g); percentages are relative errors.
"""

from __future__ import annotations

import contextlib
import functools
import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ParamSpec

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import EngFormatter, MaxNLocator

from calibrator.errors import CalibratorError

# Okabe & Ito, Color Universal Design (2008): told apart with every common colour vision.
BLUE, RED, GREEN, ORANGE, SKY, PURPLE = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9", "#CC79A7"
INK, GREY, PALE = "#222222", "#6B7280", "#E5E7EB"
INDIVIDUALS = (BLUE, SKY, GREEN, ORANGE, PURPLE)
NEAR, FAR = "#EFD3A0", "#7A6A58"  # sand, lit and in the shade
WALL = "#F1F2F4"
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
LEVEL_95 = 3.84  # rise of chi2 that bounds 95 % of one parameter
P = ParamSpec("P")


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
            figure.draw_without_rendering()  # ticks are made at the first drawing, with the settings of that moment
        return figure

    return drawn


def png(figure: Figure, dpi: int = 160) -> bytes:
    """The figure as a PNG file, cropped to what is drawn. Equal figures give equal bytes."""
    stream = io.BytesIO()
    with _house_style():
        figure.savefig(stream, format="png", dpi=dpi, bbox_inches="tight", pad_inches=0.06, metadata={"Software": None})
    return stream.getvalue()


def _panels(count: int, height: float, width: float = WIDTH, **subplots: Any) -> tuple[Figure, list[Axes]]:
    """A figure with count panels in rows of at most three (of two where that fills the rows); height [in] of one row."""
    columns = min(count, 2 if count == 4 else COLUMNS)
    rows = math.ceil(count / columns)
    figure = Figure(figsize=(width if columns > 1 else 0.6 * width, height * rows + 0.35))
    axes = list(figure.subplots(rows, columns, squeeze=False, **subplots).flat)
    for spare in axes[count:]:
        spare.remove()
    return figure, axes[:count]


def _required(things: Any, what: str, remedy: str) -> None:
    if not len(things):
        raise CalibratorError(f"no {what} to draw: {remedy}")


def _finite(what: str, *arrays: Any) -> None:
    for array in arrays:
        if not np.isfinite(np.asarray(array, float)).all():
            raise CalibratorError(f"{what} has a value that is not finite: leave such rows out before drawing")


def _ticks(axes: Axes, horizontal: bool = True, count: int = 5) -> None:
    """Few round ticks; very large or small numbers with the SI prefix instead of an offset that is easily overlooked."""
    axis, limits = (axes.xaxis, axes.get_xlim()) if horizontal else (axes.yaxis, axes.get_ylim())
    axis.set_major_locator(MaxNLocator(count, steps=[1, 2, 2.5, 5, 10]))
    largest = max(map(abs, limits))
    if largest >= 1e5 or largest < 5e-3:
        axis.set_major_formatter(EngFormatter(sep=" "))


def _legend(figure: Figure, entries: Mapping[str, Any], columns: int = 4) -> None:
    """One legend under all panels."""
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=min(columns, len(entries)))


def _line(colour: str, style: Any = "-", width: float = 1.6) -> Line2D:
    return Line2D([], [], color=colour, linestyle=style, linewidth=width)


def _dot(colour: str, marker: str = "o", **kwargs: Any) -> Line2D:
    return Line2D([], [], color=colour, marker=marker, linestyle="none", **{"markersize": 5, **kwargs})


def _colours(labels: Sequence[str]) -> dict[str, str]:
    """A colour for each candidate: always red for the compromise."""
    others = [label for label in labels if label != "compromise"]
    return {"compromise": RED, **{label: INDIVIDUALS[i % len(INDIVIDUALS)] for i, label in enumerate(others)}}


# Pictures of grains


@dataclass(frozen=True, eq=False)
class Scene:
    """Grains at one moment: title, centres (n, 3) [m], walls as polylines (k, 2) of x and z [m], scanned surface (k, 2) [m]."""

    title: str
    centres: np.ndarray
    outline: tuple[np.ndarray, ...] = ()
    surface: np.ndarray | None = None


@styled
def packing(scenes: Sequence[Scene], radius: float, cut: bool = False) -> Figure:
    """Side views of grains, one panel per scene, all at the same scale.

    Parameters
    ----------
    radius : of the grains [m].
    cut : show only the grains behind the vertical plane through the axis, y = 0, so that a crater can be seen.
    """
    _required(scenes, "grains", "run a set-up first, its record keeps their positions")
    for scene in scenes:
        _required(scene.centres, f"grains in {scene.title}", "leave that scene out")
        _finite(scene.title, scene.centres)
    boxes = [_box(scene, radius) for scene in scenes]
    widths, height = [b[1] - b[0] for b in boxes], max(b[3] for b in boxes) - min(b[2] for b in boxes)
    scale = min(8.2 / sum(widths), 3.4 / height)
    figure = Figure(figsize=(scale * sum(widths) + 0.9, scale * height + 0.9))
    axes = figure.subplots(1, len(scenes), sharey=True, squeeze=False, gridspec_kw={"width_ratios": widths})[0]
    for ax, scene, box in zip(axes, scenes, boxes, strict=True):
        _draw_scene(ax, scene, radius, box, cut, scale)
    axes[0].set_ylabel("z [mm]")
    return figure


def _box(scene: Scene, radius: float) -> tuple[float, float, float, float]:
    """Smallest and largest x and z [m] of grains and walls, with a margin."""
    grains = scene.centres[:, [0, 2]]
    corners = np.concatenate([grains - radius, grains + radius, *scene.outline])
    (left, bottom), (right, top) = corners.min(axis=0) - 0.6 * radius, corners.max(axis=0) + 0.6 * radius
    return float(left), float(right), float(bottom), float(top)


def _draw_scene(ax: Axes, scene: Scene, radius: float, box: tuple[float, float, float, float], cut: bool, scale: float) -> None:
    centres = scene.centres[scene.centres[:, 1] >= 0] if cut else scene.centres
    left, right, bottom, top = (1e3 * edge for edge in box)
    extent = (left, right, bottom, top)
    if scene.outline:
        corners = 1e3 * np.concatenate(scene.outline)
        ax.add_patch(Rectangle(corners.min(axis=0), *np.ptp(corners, axis=0), color=WALL, linewidth=0, zorder=0.5))
    ax.imshow(_rendered(centres, radius, box, 1 / (320 * scale)), extent=extent, origin="lower", zorder=1)
    for wall in scene.outline:
        ax.plot(*(1e3 * wall).T, color=INK, linewidth=1.8, solid_joinstyle="miter", zorder=2)
    if scene.surface is not None:
        ax.plot(*(1e3 * scene.surface).T, color=RED, linewidth=1.6, zorder=3)
    ax.set(xlim=extent[:2], title=scene.title, xlabel="x [mm]", aspect="equal")
    ax.grid(False)
    ax.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))


def _rendered(centres: np.ndarray, radius: float, box: tuple[float, float, float, float], pixel: float) -> np.ndarray:
    """Picture (h, w, 4) of spheres seen along +y, lit from the upper left; the surface nearest to the eye is drawn."""
    x = np.arange(box[0] + pixel / 2, box[1], pixel)
    z = np.arange(box[2] + pixel / 2, box[3], pixel)
    depth, shade = np.full((len(z), len(x)), np.inf), np.zeros((len(z), len(x)))
    light = np.array([-0.45, -0.70, 0.55])
    for cx, cy, cz in centres:
        i, j = (slice(*np.searchsorted(axis, [c - radius, c + radius])) for axis, c in ((z, cz), (x, cx)))
        dx, dz = (x[None, j] - cx) / radius, (z[i, None] - cz) / radius
        bulge = np.sqrt(np.maximum(1 - dx**2 - dz**2, 0))
        surface = np.where(bulge > 0, cy - radius * bulge, np.inf)
        nearer = surface < depth[i, j]
        lit = np.maximum(light[0] * dx - light[1] * bulge + light[2] * dz, 0)
        depth[i, j] = np.where(nearer, surface, depth[i, j])
        shade[i, j] = np.where(nearer, (0.42 + 0.58 * lit) * (0.62 + 0.38 * bulge), shade[i, j])
    return _coloured(depth, shade)


def _coloured(depth: np.ndarray, shade: np.ndarray) -> np.ndarray:
    """Colours (h, w, 4): sand, greyer with depth [m]; transparent where depth is infinite."""
    hit = np.isfinite(depth)
    near, far = (depth[hit].min(), depth[hit].max()) if hit.any() else (0.0, 1.0)
    share = np.where(hit, (depth - near) / max(far - near, 1e-12), 0)[..., None]
    colour = (np.array(to_rgb(NEAR)) * (1 - share) + np.array(to_rgb(FAR)) * share) * 1.08 * shade[..., None]
    return np.concatenate([np.clip(colour, 0, 1), hit[..., None]], axis=-1)


# The interpolant


@dataclass(frozen=True, eq=False)
class Slice:
    """One response along one parameter, the others held at the compromise.

    Attributes
    ----------
    label : of the parameter's axis; chosen : its value at the compromise.
    positions, mean, std : (k,) the interpolant along the line and its standard deviation.
    runs_at, runs_mean, runs_error : (p,) parameter value, mean response and its standard error at the points of the database.
    nearness : (p,) 0 to 1, how close each of those points lies to the line: distant ones are drawn faint.
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


@styled
def slices(panels: Sequence[Slice], label: str, target: float, band: float) -> Figure:
    """A response along each parameter through the compromise, with database points and target.

    Parameters
    ----------
    label : axis label of the response; target, band : measured value and half width within which it counts as met.
    """
    _required(panels, "slice", "give one per calibrated parameter")
    figure, axes = _panels(len(panels), 2.9, sharey=True)
    for index, (ax, panel) in enumerate(zip(axes, panels, strict=True)):
        _finite(panel.label, panel.mean, panel.std, panel.runs_mean, panel.runs_error)
        _draw_slice(ax, panel, target, band)
        ax.set_ylabel(label if index % COLUMNS == 0 else "")
    _ticks(axes[0], horizontal=False)
    entries = {
        "interpolant ± 2 standard deviations": (Patch(color=BLUE, alpha=0.2), _line(BLUE)),
        "runs, fainter with distance": _dot(INK, alpha=0.6),
        "target and its band": (Patch(color=GREEN, alpha=0.18), _line(GREEN, width=1)),
        "compromise": _line(RED, "--", 1.3),
    }
    _legend(figure, entries)
    return figure


def _draw_slice(ax: Axes, panel: Slice, target: float, band: float) -> None:
    ax.axhspan(target - band, target + band, color=GREEN, alpha=0.18, linewidth=0)
    ax.axhline(target, color=GREEN, linewidth=1)
    shades = [(*to_rgb(INK), 0.12 + 0.6 * float(n)) for n in panel.nearness]
    low, high = panel.runs_mean - panel.runs_error, panel.runs_mean + panel.runs_error
    ax.vlines(panel.runs_at, low, high, colors=shades, linewidth=1)
    ax.scatter(panel.runs_at, panel.runs_mean, s=16, color=shades, linewidth=0)
    ax.fill_between(panel.positions, panel.mean - 2 * panel.std, panel.mean + 2 * panel.std, color=BLUE, alpha=0.2, linewidth=0)
    ax.plot(panel.positions, panel.mean, color=BLUE, linewidth=1.8)
    ax.axvline(panel.chosen, color=RED, linewidth=1.3, linestyle="--", clip_on=False)  # it may lie on the frame
    ax.set(xlabel=panel.label, xlim=(panel.positions[0], panel.positions[-1]))
    _ticks(ax)


@styled
def parity(measured: np.ndarray, predicted: np.ndarray, std: np.ndarray, labels: Sequence[str]) -> Figure:
    """Leave-one-out predictions over simulated means, one panel per response; all arrays (p, m), NaN where there is none."""
    _required(measured, "cross-validated point", "make runs first")
    figure, axes = _panels(len(labels), 3.1)
    for column, (ax, label) in enumerate(zip(axes, labels, strict=True)):
        there = np.isfinite(measured[:, column]) & np.isfinite(predicted[:, column])
        _required(measured[there], f"cross-validated point of {label}", "make more runs")
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
    ax.errorbar(measured, predicted, std, fmt="o", color=BLUE, markersize=4.5, linewidth=1, alpha=0.85)
    ax.set(xlim=ends, ylim=ends, aspect="equal")
    _ticks(ax, count=4)
    _ticks(ax, horizontal=False, count=4)


def _rms(measured: np.ndarray, predicted: np.ndarray) -> str:
    rms = float(np.sqrt(np.mean((measured - predicted) ** 2)))
    return f"rms error {rms:.2g} ({100 * rms / float(np.mean(np.abs(measured))):.1f} %)"


# The search


@styled
def front_evolution(
    snapshots: Mapping[int, np.ndarray],
    front: np.ndarray,
    names: Sequence[str],
    candidates: Mapping[str, Sequence[float]] | None = None,
) -> Figure:
    """The population on its way to the Pareto front, like the paper's Fig. 6.

    Parameters
    ----------
    snapshots : generation -> objectives (n, 2) of the whole population; front : (p, 2) the final one.
    names : axis labels of the two objectives; the first is drawn upwards.
    candidates : label -> its two objectives, marked in the last panel, which is enlarged to the final population.
    """
    _required(snapshots, "generation", "name generations to keep in the settings of the search")
    _required(front, "Pareto front", "run the search first")
    figure, axes = _panels(len(snapshots), 2.7)
    largest = 1.04 * np.max([found.max(axis=0) for found in snapshots.values()], axis=0)
    for index, (ax, generation) in enumerate(zip(axes, sorted(snapshots), strict=True)):
        found = snapshots[generation]
        _finite(f"generation {generation}", found)
        ax.plot(front[:, 1], front[:, 0], color=RED, linewidth=1.2, zorder=3)
        ax.scatter(found[:, 1], found[:, 0], s=5, color=BLUE, alpha=0.35, linewidth=0)
        ax.set(title=f"generation {generation}", xlim=(-0.02 * largest[1], largest[1]), ylim=(-0.02 * largest[0], largest[0]))
        ax.set(xlabel=names[1], ylabel=names[0] if index % COLUMNS == 0 else "")
    _enlarge(axes[-1], np.concatenate([front, snapshots[max(snapshots)]]))
    _mark(axes[-1], candidates or {})
    entries = {"population": _dot(BLUE, markersize=4, alpha=0.6), "final Pareto front": _line(RED, width=1.2)}
    if candidates:
        entries |= {"individuals": _dot(INK), "compromise": _dot(RED, "*", markersize=11)}
    _legend(figure, entries)
    return figure


def _enlarge(ax: Axes, points: np.ndarray) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.14 * np.where(high > low, high - low, 1.0)
    ax.set(xlim=(low[1] - margin[1], high[1] + margin[1]), ylim=(low[0] - margin[0], high[0] + margin[0]))
    ax.set_title(f"{ax.get_title(loc='left')}, enlarged")


def _mark(ax: Axes, candidates: Mapping[str, Sequence[float]]) -> None:
    """Letters for the individuals above the front, a star for the compromise."""
    for label, (up, right, *_) in candidates.items():
        if label == "compromise":
            ax.plot(right, up, "*", color=RED, markeredgecolor="white", markeredgewidth=0.6, markersize=13, zorder=6)
            continue
        ax.plot(right, up, "o", color=INK, markersize=5, zorder=5)
        letter = label.removeprefix("individual ")
        ax.annotate(letter, (right, up), (5, 5), textcoords="offset points", color=INK, weight="bold", zorder=6)


@styled
def generational_distance(curves: Sequence[np.ndarray]) -> Figure:
    """Mean distance of each generation's first front to the last one, each curve (g,); like the paper's Fig. 7."""
    _required(curves, "search", "repeat the search once or more")
    figure, axes = _panels(2, 2.9, WIDTH * 0.85)
    for index, curve in enumerate(curves):
        distance = np.asarray(curve, float)
        _finite("generational distance", distance)
        generation = np.arange(len(distance))
        positive = distance > 0  # the last front is the reference itself
        for ax, part in zip(axes, (distance >= 0, positive), strict=True):
            ax.plot(generation[part], distance[part], color=INDIVIDUALS[index % 5], linewidth=1.3, label=f"repeat {index + 1}")
    for ax, title in zip(axes, ("linear", "logarithmic"), strict=True):
        ax.set(xlabel="generation", title=title)
    axes[0].set(ylabel="mean generational distance", ylim=(0, None))
    axes[0].legend()
    if any(np.any(np.asarray(curve) > 0) for curve in curves):
        axes[1].set_yscale("log")
    return figure


# What the targets say about the parameters


@dataclass(frozen=True, eq=False)
class Profile:
    """A parameter's profile: axis label, positions and chi2 (b,), 95 % interval, compromise, and the truth where known."""

    label: str
    positions: np.ndarray
    chi2: np.ndarray
    interval: tuple[float, float]
    chosen: float
    truth: float | None = None


@styled
def profile_likelihood(profiles: Sequence[Profile]) -> Figure:
    """Rise of chi2 above its minimum along each parameter, the others adapted, with the 95 % interval."""
    _required(profiles, "profile", "calibrate first")
    figure, axes = _panels(len(profiles), 2.7, sharey=True)
    for index, (ax, profile) in enumerate(zip(axes, profiles, strict=True)):
        _finite(profile.label, profile.positions, profile.chi2)
        _draw_profile(ax, profile)
        ax.set_ylabel("χ² above its minimum" if index % COLUMNS == 0 else "")
    entries = {"profile": _line(BLUE), "95 % interval": Patch(color=BLUE, alpha=0.14), "compromise": _line(RED, "--", 1.3)}
    if any(profile.truth is not None for profile in profiles):
        entries["truth"] = _line(INK, ":", 1.8)
    _legend(figure, entries)
    return figure


def _draw_profile(ax: Axes, profile: Profile) -> None:
    ax.axvspan(*profile.interval, color=BLUE, alpha=0.14, linewidth=0)
    ax.axhline(LEVEL_95, color=GREY, linewidth=0.9)
    ax.plot(profile.positions, profile.chi2 - profile.chi2.min(), color=BLUE, linewidth=1.8)
    ax.axvline(profile.chosen, color=RED, linewidth=1.3, linestyle="--", clip_on=False)
    if profile.truth is not None:
        ax.axvline(profile.truth, color=INK, linewidth=1.8, linestyle=":")  # may lie outside the box: then it is not seen
    ax.set(xlabel=profile.label, xlim=(profile.positions[0], profile.positions[-1]), ylim=(0, 3.2 * LEVEL_95))
    _ticks(ax)


@styled
def ridge(accepted: np.ndarray, bounds: np.ndarray, labels: Sequence[str], chosen: np.ndarray) -> Figure:
    """Parameter sets that the targets accept, projected on every pair of parameters: a narrow band is a ridge.

    Parameters
    ----------
    accepted : (k, d) sets; bounds : (2, d) the box; labels : d axis labels; chosen : (d,) the compromise.
    """
    _required(accepted, "accepted parameter set", "calibrate first")
    _finite("accepted sets", accepted)
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
        ax.scatter(accepted[:, column], accepted[:, y], s=4, color=BLUE, alpha=0.25, linewidth=0)
        ax.plot(chosen[column], chosen[y], "*", color=RED, markeredgecolor="white", markersize=12, clip_on=False)
        ax.set(xlim=bounds[:, column], ylim=bounds[:, y])
        ax.set(xlabel=labels[column] if row == last - 1 else "", ylabel=labels[y] if column == 0 else "")
        _ticks(ax, count=4)
        _ticks(ax, horizontal=False, count=4)
    _legend(figure, {"accepted by the targets": _dot(BLUE, alpha=0.6), "compromise": _dot(RED, "*", markersize=11)})
    return figure


@styled
def sensitivity(indices: Mapping[str, tuple[np.ndarray, np.ndarray]], labels: Sequence[str], names: Sequence[str]) -> Figure:
    """Sobol indices as bars with their 95 % intervals, one panel per response.

    Parameters
    ----------
    indices : kind of index -> values and half widths of their intervals, both (m, d); labels : m titles; names : d parameters.
    """
    _required(labels, "sensitivity", "calibrate first")
    figure, axes = _panels(len(labels), 1.1 + 0.36 * len(names), sharey=True)
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
    _legend(figure, {kind: Patch(color=(BLUE, SKY)[i % 2]) for i, kind in enumerate(indices)})
    return figure


# Runs


Curves = Mapping[str, Sequence[tuple[np.ndarray, np.ndarray]]]


@styled
def mass_time(curves: Curves) -> Figure:
    """Discharged mass over time: candidate -> its runs, each time (n,) [s] and passed mass (n,) [kg]."""
    _required([run for runs in curves.values() for run in runs], "mass-time curve", "verify first")
    figure, (ax,) = _panels(1, 3.3, WIDTH * 1.2)
    _thin_lines(ax, curves, 1.0, 1e3)
    ax.set(xlabel="time since the plug was pulled [s]", ylabel="passed mass [g]", xlim=(0, None), ylim=(0, None))
    return figure


@styled
def profiles(curves: Curves, setup: str) -> Figure:
    """Scanned surfaces at rest: candidate -> its runs, each position (k,) [m] and height (k,) [m]."""
    _required([run for runs in curves.values() for run in runs], f"surface profile of {setup}", "verify or validate first")
    figure, (ax,) = _panels(1, 3.0, WIDTH * 1.2)
    _thin_lines(ax, curves, 1e3, 1e3)
    across = "distance from the back wall [mm]" if setup == "ledge" else "distance from the axis [mm]"
    ax.set(xlabel=across, ylabel="surface height [mm]", xlim=(0, None), ylim=(0, None), aspect="equal")
    return figure


def _thin_lines(ax: Axes, curves: Curves, along: float, up: float) -> None:
    """All runs, the compromise last so that it lies on top; one legend entry per candidate."""
    colours = _colours(list(curves))
    for label in sorted(curves, key=lambda label: label == "compromise"):
        for index, (x, y) in enumerate(curves[label]):
            _finite(label, x, y)
            name = f"{label} ({len(curves[label])})" if index == 0 else None
            ax.plot(along * x, up * y, color=colours[label], linewidth=0.9, alpha=0.85, label=name)
    legend = ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), title="runs of", alignment="left")
    legend.get_title().set_fontsize(9)
    for line in legend.get_lines():
        line.set_linewidth(2)


@dataclass(frozen=True)
class Deviation:
    """A response at a candidate relative to its target: simulated, its standard error, promised by the interpolant, band.

    All are fractions of the target (0.01 is one per cent); promised is None where nothing was interpolated.
    """

    candidate: str
    label: str
    simulated: float
    error: float
    promised: float | None
    band: float


@styled
def verification(rows: Sequence[Deviation]) -> Figure:
    """Simulated against target in per cent: one panel per response, one line per candidate, bars of two standard errors."""
    _required(rows, "verified response", "verify first")
    labels, candidates = list(dict.fromkeys(r.label for r in rows)), list(dict.fromkeys(r.candidate for r in rows))
    figure, axes = _panels(len(labels), 1.3 + 0.34 * len(candidates), sharey=True)
    for ax, label in zip(axes, labels, strict=True):
        own = [r for r in rows if r.label == label]
        _finite(label, [(r.simulated, r.error, r.band) for r in own])
        _draw_deviations(ax, own, candidates)
        ax.set(title=label, xlabel="deviation from target [%]")
    axes[0].set_yticks(range(len(candidates)), candidates)
    axes[0].set_ylim(len(candidates) - 0.5, -0.5)
    entries: dict[str, Any] = {
        "simulated ± 2 standard errors": _dot(INK),
        "band within which the target counts as met": Patch(color=GREEN, alpha=0.18),
    }
    if any(r.promised is not None for r in rows):
        entries["promised by the interpolant"] = _dot(INK, "D", markerfacecolor="white")
    _legend(figure, entries, 3)
    return figure


def _draw_deviations(ax: Axes, rows: Sequence[Deviation], candidates: Sequence[str]) -> None:
    ax.axvspan(-100 * rows[0].band, 100 * rows[0].band, color=GREEN, alpha=0.18, linewidth=0)
    ax.axvline(0, color=GREEN, linewidth=1)
    for row in rows:
        place, colour = candidates.index(row.candidate), RED if row.candidate == "compromise" else INK
        ax.errorbar(100 * row.simulated, place, xerr=200 * row.error, fmt="o", color=colour, markersize=6, linewidth=1.6)
        if row.promised is not None:
            ax.plot(100 * row.promised, place - 0.26, "D", color=colour, markerfacecolor="white", markersize=5)
    ax.grid(False, axis="y")
    ax.xaxis.set_major_locator(MaxNLocator(5))
