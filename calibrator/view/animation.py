"""The animation of a run, as a GIF."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from calibrator.view.drawing import Scene, draw, scale_bar
from calibrator.view.snapshots import Snapshot

LARGEST = 2_000_000
"""Bytes of an animation."""

DOTS, TITLE = 100, 30
"""Per inch, and pixels above the scene for the time."""

SIZES = ((520, 96), (460, 64), (400, 48), (340, 32), (260, 24), (180, 16))
"""Longer side in pixels, and colours: the first that are small enough are taken."""

STEP, HOLD, END = 80, 700, 1800
"""Milliseconds of a frame, of the filled vessel, and of the last one before it begins anew."""


def animation(shots: Sequence[Snapshot], scene: Scene) -> bytes:
    """GIF of some snapshots in a loop that rests on the filled vessel and at the end."""
    longest = [STEP] * len(shots)
    longest[[s.time for s in shots].index(scene.released)] = HOLD
    longest[-1] = END
    largest = [_frame(shot, scene, SIZES[0][0]) for shot in shots]
    for side, colours in SIZES:
        share = side / SIZES[0][0]
        size = [round(share * n) for n in largest[0].size]
        frames = [image.resize(size, Image.Resampling.LANCZOS) for image in largest]
        made = _gif(frames, colours, longest)
        if len(made) <= LARGEST:
            break
    return made


def _frame(shot: Snapshot, scene: Scene, side: int) -> Image.Image:
    """One frame whose scene's longer side has so many pixels."""
    wide, high = scene.box[1] - scene.box[0], scene.box[3] - scene.box[2]
    width, height = (round(side * length / max(wide, high)) for length in (wide, high))
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        figure = Figure(figsize=(width / DOTS, (height + TITLE) / DOTS), dpi=DOTS)
        canvas = FigureCanvasAgg(figure)
        ax = figure.add_axes((0, 0, 1, height / (height + TITLE)))
        draw(ax, shot, scene, wide / width)
        scale_bar(ax, scene)
        canvas.draw()  # type: ignore[no-untyped-call]
        dots = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        return Image.fromarray(dots[..., :3].copy())


def _gif(frames: Sequence[Image.Image], colours: int, longest: Iterable[int]) -> bytes:
    """The file, all frames in one palette: then what stands still does not flicker."""
    # of a picture of several frames, as the first has few grains
    some = [np.asarray(frames[i]) for i in {0, len(frames) // 2, len(frames) - 1}]
    palette = Image.fromarray(np.concatenate(some)).quantize(colours, Image.Quantize.MEDIANCUT)
    colours_of = np.array(palette.getpalette()).reshape(-1, 3)
    colours_of[colours_of.sum(axis=1).argmax()] = 255  # the page is white, not nearly so
    palette.putpalette(colours_of.ravel().tolist())
    plain = [f.quantize(palette=palette, dither=Image.Dither.NONE) for f in frames]
    stream = io.BytesIO()
    plain[0].save(
        stream, "GIF", save_all=True, append_images=plain[1:], duration=list(longest), loop=0,
        optimize=False, disposal=1,
    )  # fmt: skip
    return stream.getvalue()
