"""What the co-kriging inside an interpolant knows: how full and cheap runs hang together."""

from __future__ import annotations

import numpy as np

from calibrator.responses.cautious import Cautious
from calibrator.responses.cokriging import CoKriged
from calibrator.responses.coordinates import Changed
from calibrator.responses.dear_process import Link
from calibrator.responses.interpolant import Interpolant, average_replicates
from calibrator.responses.parted import Parted


def links_of(interpolant: Interpolant) -> dict[str, tuple[Link, float]]:
    """How each response hangs on the cheap one, and that one's standard deviation, by key.

    The latter is over the cheap runs, in the response's unit. Empty without cheap runs.
    """
    match interpolant:
        case Cautious() | Changed():
            return links_of(interpolant.inner)
        case Parted():
            return {k: v for part in interpolant.parts for k, v in links_of(part.inner).items()}
        case CoKriged():
            scales = [float(process.scale) for process in interpolant.cheap.processes]
            return dict(
                zip(interpolant.responses, zip(interpolant.links, scales, strict=True), strict=True)
            )
    return {}


def told(interpolant: Interpolant, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """By how much a cheap run, and a full one, lowers the variance of the mean at its own point.

    points : (k, d); both (k, m), in squares of the responses' units; zeros for what has no cheap
    runs. Raises CalibratorError outside the box.
    """
    found = np.zeros((2, len(points), len(interpolant.responses)))
    match interpolant:
        case Cautious():
            return told(interpolant.inner, points)
        case Changed():
            return told(interpolant.inner, interpolant.coordinates.inward(points))
        case Parted():
            for part in interpolant.parts:
                found[:, :, part.columns] = told(part.inner, points[:, part.seen])
        case CoKriged():
            return interpolant.told(points)
    return found[0], found[1]


def both_ways(
    points: np.ndarray, values: np.ndarray, cheap_points: np.ndarray, cheap_values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean cheap and mean full responses, both (k, m), at the sets that were run both ways.

    points (n, d), values (n, m), NaN where a parameter or a response is none of a run's.
    """
    sets, full, _ = average_replicates(points, values)
    others, cheap, _ = average_replicates(cheap_points, cheap_values)
    row_of = {tuple(row): i for i, row in enumerate(np.nan_to_num(others).tolist())}
    rows = [(row_of.get(tuple(row)), i) for i, row in enumerate(np.nan_to_num(sets).tolist())]
    pairs = [(low, high) for low, high in rows if low is not None]
    return cheap[[low for low, _ in pairs]], full[[high for _, high in pairs]]
