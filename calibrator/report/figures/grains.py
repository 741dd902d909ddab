"""Pictures of grains in their vessel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from calibrator.report.figures.style import INK, RED, require_finite, require_some, styled

NEAR, FAR = "#EFD3A0", "#7A6A58"  # sand, lit and in the shade
WALL = "#F1F2F4"


@dataclass(frozen=True, eq=False)
class Scene:
    """Grains at one moment.

    centres : (n, 3) [m]; outline : walls as polylines (k, 2) of x and z [m]; surface : scanned, (k,
    2) of x and z [m].
    """

    title: str
    centres: np.ndarray
    outline: tuple[np.ndarray, ...] = ()
    surface: np.ndarray | None = None


@styled
def packing(scenes: Sequence[Scene], radius: float, cut: bool = False) -> Figure:
    """Side views of grains, one panel per scene, all at the same scale.

    Parameters
    ----------
    radius : of the grains [m]
    cut : whether only the grains behind the vertical plane through the axis, y = 0, are shown, so
        that a crater can be seen
    """
    require_some(scenes, "grains", "run a set-up first, its record keeps their positions")
    for scene in scenes:
        require_some(scene.centres, f"grains in {scene.title}", "leave that scene out")
        require_finite(scene.title, scene.centres)
    boxes = [_box(scene, radius) for scene in scenes]
    widths = [b[1] - b[0] for b in boxes]
    height = max(b[3] for b in boxes) - min(b[2] for b in boxes)
    scale = min(8.2 / sum(widths), 3.4 / height)
    figure = Figure(figsize=(scale * sum(widths) + 0.9, scale * height + 0.9))
    axes = figure.subplots(
        1, len(scenes), sharey=True, squeeze=False, gridspec_kw={"width_ratios": widths}
    )[0]
    for ax, scene, box in zip(axes, scenes, boxes, strict=True):
        _draw_scene(ax, scene, radius, box, cut, scale)
    axes[0].set_ylabel("z [mm]")
    return figure


def _box(scene: Scene, radius: float) -> tuple[float, float, float, float]:
    """Smallest and largest x and z [m] of grains and walls, with a margin."""
    grains = scene.centres[:, [0, 2]]
    corners = np.concatenate([grains - radius, grains + radius, *scene.outline])
    left, bottom = corners.min(axis=0) - 0.6 * radius
    right, top = corners.max(axis=0) + 0.6 * radius
    return float(left), float(right), float(bottom), float(top)


def _draw_scene(
    ax: Axes,
    scene: Scene,
    radius: float,
    box: tuple[float, float, float, float],
    cut: bool,
    scale: float,
) -> None:
    """One panel; box : see `_box`; scale : inches per metre."""
    centres = scene.centres[scene.centres[:, 1] >= 0] if cut else scene.centres
    left, right, bottom, top = (1e3 * edge for edge in box)
    extent = (left, right, bottom, top)
    if scene.outline:
        corners = 1e3 * np.concatenate(scene.outline)
        ax.add_patch(
            Rectangle(
                corners.min(axis=0), *np.ptp(corners, axis=0), color=WALL, linewidth=0, zorder=0.5
            )
        )
    ax.imshow(
        _rendered(centres, radius, box, 1 / (320 * scale)), extent=extent, origin="lower", zorder=1
    )
    for wall in scene.outline:
        ax.plot(*(1e3 * wall).T, color=INK, linewidth=1.8, solid_joinstyle="miter", zorder=2)
    if scene.surface is not None:
        ax.plot(*(1e3 * scene.surface).T, color=RED, linewidth=1.6, zorder=3)
    ax.set(xlim=extent[:2], title=scene.title, xlabel="x [mm]", aspect="equal")
    ax.grid(False)
    ax.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))


def _rendered(
    centres: np.ndarray, radius: float, box: tuple[float, float, float, float], pixel: float
) -> np.ndarray:
    """Picture (h, w, 4) of spheres seen along +y, lit from the upper left.

    The surface nearest to the eye is drawn. pixel : its size [m].
    """
    x = np.arange(box[0] + pixel / 2, box[1], pixel)
    z = np.arange(box[2] + pixel / 2, box[3], pixel)
    depth, shade = np.full((len(z), len(x)), np.inf), np.zeros((len(z), len(x)))
    light = np.array([-0.45, -0.70, 0.55])
    for cx, cy, cz in centres:
        i = slice(*np.searchsorted(z, [cz - radius, cz + radius]))
        j = slice(*np.searchsorted(x, [cx - radius, cx + radius]))
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
    sand = np.array(to_rgb(NEAR)) * (1 - share) + np.array(to_rgb(FAR)) * share
    colour = sand * 1.08 * shade[..., None]
    return np.concatenate([np.clip(colour, 0, 1), hit[..., None]], axis=-1)
