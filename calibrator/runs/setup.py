"""What there is to know of a set-up beside its script and the vocabulary: the form of an entry."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

Numbers = Mapping[str, float]
"""The parameters of a request that are numbers, by name [SI]."""

Outline = tuple[np.ndarray, ...]
"""Walls as polylines (k, 2) of x and z [m]."""


@dataclass(frozen=True)
class Curve:
    """Two arrays that a run leaves, one to be drawn over the other.

    Attributes
    ----------
    name : of the figure.
    across, up : names of the arrays, both of shape (n,).
    labels : of the two axes, with their units.
    scales : from the arrays' units to those of the labels.
    caption : of the figure; {setup} stands for the set-up in words.
    true_to_scale : whether a unit is as long on both axes.
    """

    name: str
    across: str
    up: str
    labels: tuple[str, str]
    scales: tuple[float, float]
    caption: str
    true_to_scale: bool = False


def surface(across: str, label: str) -> Curve:
    """The scanned surface at rest, over an array of positions [m] that is labelled so."""
    return Curve(
        "profiles",
        across,
        "profile_height",
        (f"{label} [mm]", "surface height [mm]"),
        (1e3, 1e3),
        "Scanned surface of the {setup} at rest, every run.",
        true_to_scale=True,
    )


@dataclass(frozen=True)
class Doubt:
    """What is implausible in a geometry.

    kind : of doubt, badness : by which the worst one of a kind is chosen, larger is worse; sentence
    : says it with numbers, and what to do.
    """

    kind: str
    badness: float
    sentence: str


@dataclass(frozen=True, kw_only=True)
class Setup:
    """What is known of a set-up.

    Attributes
    ----------
    name : as the vocabulary has it.
    base : area [m2] that the grains fall on.
    particles : number of grains, not yet rounded.
    release : seconds from the release until the grains only settle; some tens of per cent will do.
    outline : walls while filled, and after the release, up to a height [m] in the first case.
    profile : the scanned surface at rest, None where none is scanned.
    mirrored : whether the profile is scanned over the radius, and pictures show it on both sides.
    history : what happens over time, None where nothing is recorded.
    last : the second moment that pictures show, in words.
    cut : whether pictures leave out the grains in front of the axis, so that a crater can be seen.
    across : widths of the vessel, and how many grain diameters they should have at least.
    impossible : what the set-up's script refuses in a geometry, in the script's own words.
    doubts : of a geometry that the script takes.
    """

    name: str
    base: Callable[[Numbers], float]
    particles: Callable[[Numbers], float]
    release: Callable[[Numbers], float]
    outline: Callable[[Numbers, float], tuple[Outline, Outline]]
    profile: Curve | None = None
    mirrored: bool = False
    history: Curve | None = None
    last: str = "at rest after the release"
    cut: bool = False
    across: Mapping[str, float] = field(default_factory=dict)
    impossible: Callable[[Numbers], list[str]] = lambda p: []
    doubts: Callable[[Numbers], list[Doubt]] = lambda p: []

    @property
    def curves(self) -> tuple[Curve, ...]:
        """What runs leave to be drawn."""
        return tuple(curve for curve in (self.history, self.profile) if curve is not None)
