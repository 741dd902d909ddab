"""The numbers behind a figure, read off what was drawn.

They are those of the lines, points, bars, bands and matrices, so that a figure and its table cannot
differ. Pictures of grains have none.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.container import BarContainer, Container
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D

HEAD = ("panel", "what", "x", "y", "value")
MOST = 20_000
"""Rows: more are no table."""
BESIDE = 0.5  # of a named place: two bars of one name stand on either side of it
Row = tuple[str, str, str, str, str]
Drawn = tuple[str, float | None, float | None, float | None]


def rows_of(figure: Figure) -> list[Row]:
    """Rows under HEAD of all that was drawn; none where there are more than MOST, or only pictures.

    Where an axis has names for numbers, as those of bars, the names are given. What runs across a
    whole panel, as the line of a target does, has no number along that axis.
    """
    rows: list[Row] = []
    up = ""
    for number, ax in enumerate(figure.axes, 1):
        up = ax.get_ylabel() or up  # panels of one row are labelled once
        labels = [label for label in (up, ax.get_xlabel()) if label]
        rows += _panel(ax, ax.get_title() or " against ".join(labels) or f"panel {number}")
    return rows if len(rows) <= MOST else []


def csv_of(figure: Figure) -> bytes:
    """The rows as a CSV file that a spreadsheet opens; empty where there are none."""
    if not (rows := rows_of(figure)):
        return b""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\r\n").writerows([HEAD, *rows])
    return stream.getvalue().encode("utf-8-sig")


def _panel(ax: Axes, name: str) -> Iterator[Row]:
    """The rows of one panel."""
    across, up = _names(ax, 0), _names(ax, 1)
    for what, x, y, value in _drawn(ax):
        yield name, what, _cell(x, across), _cell(y, up), _cell(value, {})


def _names(ax: Axes, axis: int) -> dict[float, str]:
    """Names of places along an axis that are no numbers."""
    own = (ax.xaxis, ax.yaxis)[axis]
    found = {}
    for place, label in zip(own.get_ticklocs(), own.get_ticklabels(), strict=False):
        words = " ".join(label.get_text().split())
        if "$" not in words and sum(map(str.isalpha, words)) > 2:
            found[float(place)] = words
    return found


def _cell(value: float | None, names: dict[float, str]) -> str:
    if value is None or not np.isfinite(value):
        return ""
    near = min(names, key=lambda place: abs(place - value), default=np.inf)
    return names[near] if abs(near - value) < BESIDE else f"{value:.7g}"


def _drawn(ax: Axes) -> Iterator[Drawn]:
    """What each number is of, x, y and value."""
    found: list[Artist | Container] = [*ax.lines, *ax.collections, *ax.containers, *ax.images]
    for artist in found:
        what = _label(artist)
        if isinstance(artist, Line2D):
            across, up = artist.get_transform().contains_branch_seperately(ax.transData)
            for x, y in np.asarray(artist.get_xydata()):
                yield what or "line", x if across else None, y if up else None, None
        elif isinstance(artist, PathCollection):
            for x, y in np.ma.filled(np.ma.asarray(artist.get_offsets()), np.nan):
                yield what or "points", x, y, None
        elif isinstance(artist, PolyCollection):
            for path in artist.get_paths():
                for x, y in np.asarray(path.vertices):
                    yield what or "edge of a band", x, y, None
        elif isinstance(artist, BarContainer):
            for bar in artist.patches:
                end, middle = bar.get_x() + bar.get_width(), bar.get_y() + bar.get_height() / 2
                yield what or f"bars {ax.containers.index(artist) + 1}", end, middle, None
        elif isinstance(artist, AxesImage):
            values = np.asarray(artist.get_array())
            for (row, column), value in np.ndenumerate(values) if values.ndim == 2 else ():
                yield what or "matrix", column, row, value


def _label(artist: Artist | Container) -> str:
    """What the legend calls it, "" where it does not."""
    label = str(artist.get_label())
    return "" if label.startswith("_") else label
