"""The picture of a run: grains in their vessel, seen from a little above."""

from __future__ import annotations

import dataclasses
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from calibrator.view.camera import Camera, ground, outlines
from calibrator.view.snapshots import Snapshot
from calibrator.view.spheres import Box, painted

SAND, DYED = "#E8C68A", "#2F6C9E"
INK, QUIET, GLASS, FLOOR = "#222222", "#5B6270", "#F4F5F8", "#E3E6EB"
BANDS = 6
"""Layers of sand, every other one dyed, as one pours them in a laboratory."""

WIDTH, HIGHEST, DOTS = 9.2, 4.2, 160
"""Inches of a picture, and its dots per inch: those of the report's figures."""

TITLE, FLAT = 0.3, 1.25
"""Inches above a panel; width over height from which panels stand in two rows."""

SHADOW, SHIFT = 0.03, (0.35, 0.25, 0.0)
"""How dark a sphere's shadow is on a plane, and where it lies, in heights above it."""


@dataclass(frozen=True, eq=False)
class Scene:
    """What all frames of a run share.

    camera; centre (3,) [m] : of the vessel's floor, which the eye looks at.
    cut : whether grains in front of the axis are left out; box : what is shown on the page [m].
    bands : layer by number of a sphere or clump; ceiling [m] : where walls are cut off.
    reach [m] : radius of the disc that stands for a plane.
    released, ended [s] : times of the release and of the end; ending : what is said of the latter.
    """

    camera: Camera
    centre: np.ndarray
    cut: bool
    box: Box
    bands: dict[int, int]
    ceiling: float
    reach: float
    released: float
    ended: float
    ending: str

    def seen(self, points: np.ndarray) -> np.ndarray:
        """Page coordinates (..., 3) [m] of points (..., 3) [m]."""
        return self.camera.seen(points - self.centre)

    def behind(self, points: np.ndarray) -> np.ndarray:
        """How far points (..., 3) lie behind the vertical plane of the page through the axis."""
        return self.camera.behind(points - self.centre)


def scene_of(
    filled: Snapshot, last: Snapshot, camera: Camera, cut: bool = False, ending: str = "at rest"
) -> Scene:
    """The scene of a run, from the snapshots at the end of its filling and at its own end."""
    centre = _centre(filled)
    above = float((filled.centres[:, 2] + filled.radii).max()) - centre[2]
    ceiling = float(centre[2] + 1.12 * above)
    away = [np.hypot(*(s.centres - centre)[:, :2].T) for s in (filled, last)]
    reach = 1.2 * float(max(np.quantile(distances, 0.99) for distances in away))
    unknown = (0.0, 0.0, 0.0, 0.0)
    times = (filled.time, last.time)
    scene = Scene(camera, centre, cut, unknown, _bands(filled), ceiling, reach, *times, ending)
    corners = [
        scene.seen(_capped(filled.facets, ceiling)).reshape(-1, 3),
        scene.seen(filled.centres),
        *(scene.seen(rim) for rim in _grounds(filled, scene)),
    ]
    low = scene.seen(last.centres)[:, 1]
    shown = np.concatenate(corners)
    margin = 0.06 * float(np.ptp(shown[:, 0]))
    left, right = shown[:, 0].min() - margin, shown[:, 0].max() + margin
    bottom, top = min(shown[:, 1].min(), np.quantile(low, 0.005)), shown[:, 1].max()
    strip = 0.07 * (top - bottom)  # for the scale bar
    box = (float(left), float(right), float(bottom - strip), float(top) + margin)
    return dataclasses.replace(scene, box=box)


def _centre(filled: Snapshot) -> np.ndarray:
    """Middle (3,) [m] of the vessel, or of the grains where it has no walls, on its floor."""
    points = filled.facets.reshape(-1, 3) if len(filled.facets) else filled.centres
    low, high = points.min(axis=0), points.max(axis=0)
    floor = float((filled.centres[:, 2] - filled.radii).min())
    return np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, floor])


def picture(shots: Sequence[Snapshot], scene: Scene) -> bytes:
    """PNG of some moments side by side at one scale."""
    wide, high = scene.box[1] - scene.box[0], scene.box[3] - scene.box[2]
    columns = len(shots) if wide < FLAT * high else math.ceil(len(shots) / 2)
    rows, panel = math.ceil(len(shots) / columns), min(WIDTH / columns, HIGHEST * wide / high)
    size = (panel * columns, rows * (panel * high / wide + TITLE))
    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # not the user's
        figure = Figure(figsize=size)
        for i, shot in enumerate(shots):
            corner = (i % columns / columns, 1 - (i // columns + 1) / rows)
            ax = figure.add_axes((*corner, 1 / columns, 1 / rows - TITLE / size[1]))
            draw(ax, shot, scene, wide / (panel * DOTS))
        scale_bar(figure.axes[0], scene)
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=DOTS, metadata={"Software": None})
    return stream.getvalue()


def draw(ax: Axes, shot: Snapshot, scene: Scene, pixel: float) -> None:
    """One moment; pixel : size of one on the page [m]."""
    for rim in _grounds(shot, scene):
        (disc,) = ax.fill(*scene.seen(rim)[:, :2].T, color=FLOOR, linewidth=0, zorder=0)
        for shadows in _shadows(ax, shot, scene, float(rim[0, 2])):
            ax.add_collection(shadows)
            shadows.set_clip_path(disc)
    walls = _capped(shot.facets, scene.ceiling)
    _fill_walls(ax, walls, scene)
    _draw_edges(ax, walls, scene)
    kept = scene.behind(shot.centres) >= 0 if scene.cut else np.full(len(shot.ids), True)
    colours = np.array([to_rgb((SAND, DYED)[band % 2]) for band in range(BANDS + 1)])
    own = colours[[scene.bands.get(int(i), BANDS) for i in shot.clumps[kept]]]
    centres = scene.seen(shot.centres[kept])
    image = painted(centres, shot.radii[kept], own.reshape(-1, 3), scene.box, pixel)
    ax.imshow(image, extent=scene.box, origin="lower", zorder=2, interpolation="none")
    ax.set(xlim=scene.box[:2], ylim=scene.box[2:], aspect="equal")
    ax.set_axis_off()
    ax.set_title(moment_words(shot, scene), color=INK, fontsize=9.5)


def moment_words(shot: Snapshot, scene: Scene) -> str:
    """A moment in words: time counts from the release."""
    since = shot.time - scene.released
    if since == 0:
        return "filled"
    if since < 0:
        return f"filling, {-since:.2f} s before the release"
    end = f", {scene.ending}" if shot.time == scene.ended else ""
    return f"{since:.2f} s after the release{end}"


def _bands(filled: Snapshot) -> dict[int, int]:
    """Layer of each grain by the height at which it lies once filled; all equally thick."""
    height = {int(c): float(z) for c, z in zip(filled.clumps, filled.centres[:, 2], strict=True)}
    low, high = min(height.values()), np.quantile(list(height.values()), 0.98)
    return {
        c: int(np.clip((z - low) / max(high - low, 1e-12) * BANDS, 0, BANDS - 1))
        for c, z in height.items()
    }


def _capped(facets: np.ndarray, ceiling: float) -> np.ndarray:
    """The walls up to a height: they stand upright, so their upper corners come down."""
    capped = facets.copy()
    capped[..., 2] = np.minimum(capped[..., 2], ceiling)
    return capped


def _grounds(shot: Snapshot, scene: Scene) -> list[np.ndarray]:
    """Rims of the discs that stand for the level planes of a scene."""
    middle = (scene.centre[0], scene.centre[1])
    return [ground(middle, place, scene.reach) for axis, place in shot.planes if axis == 2]


def _shadows(ax: Axes, shot: Snapshot, scene: Scene, place: float) -> list[EllipseCollection]:
    """Soft shadows of the spheres on a level plane at a height [m]: many overlap below a heap."""
    above = shot.centres[:, 2:] - place
    feet = np.concatenate([shot.centres[:, :2], np.full_like(above, place)], axis=1)
    at = scene.seen(feet + above * SHIFT)[:, :2]
    flat = math.sin(math.radians(scene.camera.elevation_deg))
    cast = []
    for share in (2.0, 3.2, 4.4):  # wider ones are paler: a soft rim
        across = share * shot.radii
        cast.append(
            EllipseCollection(
                across,
                flat * across,
                np.zeros_like(across),
                units="xy",
                offsets=at,
                offset_transform=ax.transData,
                facecolor=INK,
                edgecolor="none",
                alpha=SHADOW / share,
                zorder=0.2,
            )
        )
    return cast


def _fill_walls(ax: Axes, facets: np.ndarray, scene: Scene) -> None:
    """A tint on the walls behind the grains, and on floors."""
    if not len(facets):
        return
    level = np.ptp(facets[..., 2], axis=1) < 1e-6 * scene.reach
    behind = scene.behind(facets).mean(axis=1) > 0
    for which, tint in ((behind & ~level, GLASS), (level, FLOOR)):
        seen = scene.seen(facets[which])[..., :2]
        tinted = PolyCollection(list(seen), facecolor=tint, edgecolor=tint, linewidth=0.4)
        tinted.set_zorder(0.5)
        ax.add_collection(tinted)


def _draw_edges(ax: Axes, facets: np.ndarray, scene: Scene) -> None:
    """Outlines: those behind the grains below them, those in front thin."""
    edges = outlines(facets, scene.camera)
    if not len(edges):
        return
    place = scene.behind(edges).mean(axis=1) / scene.reach
    upright = np.ptp(edges[..., 2], axis=1) > 0.2 * scene.ceiling
    seen = scene.seen(edges)[..., :2]
    middle = (np.abs(place) < 0.15) & upright
    for which, width, alpha, order in (
        ((place > 0) & ~middle, 0.9, 0.8, 1),
        ((place <= 0) & ~middle, 0.9, 0.5, 3),
        (middle, 1.3, 1.0, 3),
    ):
        lines = LineCollection(
            list(seen[which]), colors=INK, linewidths=width, alpha=alpha, capstyle="round"
        )
        lines.set_zorder(order)
        ax.add_collection(lines)


def scale_bar(ax: Axes, scene: Scene) -> None:
    """A bar of a round length in the lower left corner."""
    left, right, bottom, top = scene.box
    wanted = 0.25 * (right - left)
    decade = 10 ** np.floor(np.log10(wanted))
    length = max(n * decade for n in (1, 2, 5) if n * decade <= wanted)
    y, x = bottom + 0.02 * (top - bottom), left + 0.03 * (right - left)
    ax.plot([x, x + length], [y, y], color=INK, linewidth=2.2, solid_capstyle="butt", zorder=5)
    ax.text(
        x + length / 2, y + 0.012 * (top - bottom), f"{1e3 * length:g} mm",
        ha="center", va="bottom", color=INK, fontsize=8, zorder=5,
    )  # fmt: skip
