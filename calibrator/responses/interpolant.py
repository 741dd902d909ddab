"""What interpolating raw bulk responses over the parameter space has in common.

Two interpolants with the same verbs: `multilinear.Multilinear` on a full grid, as in the reference
paper, and `gaussian_process.GaussianProcess` on any design. Both refuse to extrapolate, and a
misfit is never interpolated. Arrays in, arrays out: rows are points, columns are parameters or
responses.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from calibrator.errors import CalibratorError

# Pooled seed noise with fewer degrees of freedom is uncertain by more than a factor of two.
FEWEST_DEGREES = 4


@dataclass(frozen=True, eq=False)
class Learnt:
    """State of an interpolant beyond its runs.

    kernels : (m, q), empty where there are none, NaN behind the shorter ones; noise : (m,) seed
    noise of a single run.
    """

    kernels: np.ndarray
    noise: np.ndarray

    def of(self, columns: Sequence[int]) -> Learnt:
        """The state of some responses, whose kernels are equally long."""
        kernels = self.kernels[columns]
        return Learnt(kernels[:, np.isfinite(kernels).all(axis=0)], self.noise[columns])


class Interpolant(Protocol):
    """What every interpolant offers: m responses by key, their seed noise, and predictions."""

    @property
    def responses(self) -> list[str]:
        """Keys of the interpolated responses, in column order."""

    @property
    def points(self) -> np.ndarray:
        """Distinct points (p, d) that it was fitted to."""

    @property
    def values(self) -> np.ndarray:
        """Mean responses (p, m) at the distinct points; NaN where not measured."""

    @property
    def noise_sources(self) -> tuple[str, ...]:
        """Where the seed noise of each response (m,) is from."""

    @property
    def noise(self) -> np.ndarray:
        """Seed noise (m,): standard deviation of one run about the mean, in the response's unit."""

    @property
    def learnt(self) -> Learnt:
        """What a search found beyond the runs: enough to fit the same again without it."""

    @property
    def trend(self) -> np.ndarray:
        """Degrees of freedom (m,) that the trend takes from the points of each response."""

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Mean responses (k, m) at points (k, d)."""

    def predict_with_error(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean responses and their standard deviations, both (k, m)."""

    def leave_one_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Prediction of each distinct point without it and its expected scatter, both (p, m)."""


class Around:
    """What an interpolant that stands around another one passes on as it is."""

    inner: Interpolant

    @property
    def responses(self) -> list[str]:
        """Keys of the responses."""
        return self.inner.responses

    @property
    def noise(self) -> np.ndarray:
        """Seed noise (m,) of a single run; of other coordinates, at the box's mean density."""
        return self.inner.noise

    @property
    def noise_sources(self) -> tuple[str, ...]:
        """Where the seed noise is from."""
        return self.inner.noise_sources

    @property
    def learnt(self) -> Learnt:
        """What the interpolant inside has learnt."""
        return self.inner.learnt

    @property
    def trend(self) -> np.ndarray:
        """Degrees of freedom (m,) that the trend takes."""
        return self.inner.trend


def known_noise(interpolant: Interpolant) -> np.ndarray:
    """Seed noise (m,) of a single run where replicates or the caller gave it, else NaN.

    What a likelihood makes of single runs serves to smooth them; it is no measurement.
    """
    measured = np.isin(interpolant.noise_sources, ("given", "replicates"))
    return np.where(measured, interpolant.noise, np.nan)


def seed_noise(points: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Seed noise of each response, pooled over all points that were run more than once.

    Parameters
    ----------
    points : (n, d) parameter sets; replicates are rows that agree exactly
    values : (n, m) responses, NaN where not measured

    Returns
    -------
    std : (m,) square root of the summed squared deviations from each point's mean over the degrees
        of freedom, in the response's unit; NaN without replicates. It assumes that the noise is the
        same all over the parameter space.
    degrees : (m,) degrees of freedom, the runs less the distinct points
    """
    group, means, counts = grouped(points, values, np.ones(len(points)))
    squares = np.nansum((values - means[group]) ** 2, axis=0)
    degrees = np.maximum(counts - 1, 0).sum(axis=0).astype(int)
    return (
        np.sqrt(np.divide(squares, degrees, out=np.full(len(degrees), np.nan), where=degrees > 0)),
        degrees,
    )


def alike_seeds(points: np.ndarray, values: np.ndarray) -> np.ndarray:
    """How much of the seed noise any two responses share, (m, m): squared correlations, 0 to 1.

    points (n, d), values (n, m) as in `seed_noise`. It is r^2 - (1 - r^2) / degrees of freedom,
    which is zero on average where nothing is shared (Wherry, Ann. Math. Stat. 2 (1931) 440), and 0
    where there are no replicates.
    """
    group, means, _ = grouped(points, values, np.ones(len(points)))
    left, m = values - means[group], values.shape[1]
    shared = np.eye(m)
    for i, j in itertools.combinations(range(m), 2):
        both = np.isfinite(left[:, i] + left[:, j])
        degrees = int(both.sum()) - len(np.unique(group[both]))
        a, b = left[both, i], left[both, j]
        power = float((a @ a) * (b @ b))
        if degrees > 0 and power > 0:
            r2 = float(a @ b) ** 2 / power
            shared[i, j] = shared[j, i] = max(0.0, r2 - (1 - r2) / degrees)
    return shared


def average_replicates(
    points: np.ndarray, values: np.ndarray, counts: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means over the rows at the same point.

    Parameters
    ----------
    points : (n, d) parameter sets
    values : (n, m) responses, NaN where not measured
    counts : (n,) runs that each row already averages, or None

    Returns
    -------
    points : (p, d) distinct points in lexical order
    means : (p, m), NaN where nothing was measured
    counts : (p, m) runs behind each mean
    """
    _, means, totals = grouped(
        points, values, np.ones(len(points)) if counts is None else np.asarray(counts, float)
    )
    return _distinct(points)[0], means, totals


def _distinct(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distinct points (p, d) in lexical order and the group of each row (n,); NaN equals NaN."""
    filled = np.where(np.isnan(points), np.inf, points)
    distinct, group = np.unique(filled, axis=0, return_inverse=True)
    return np.where(np.isinf(distinct), np.nan, distinct), group


def grouped(
    points: np.ndarray, values: np.ndarray, counts: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Group of each row (n,), and mean and count of each group and response (p, m)."""
    distinct, group = _distinct(points)
    weights = np.where(np.isnan(values), 0.0, counts[:, None])
    totals, sums = np.zeros((2, len(distinct), values.shape[1]))
    np.add.at(totals, group, weights)
    np.add.at(sums, group, weights * np.nan_to_num(values))
    return group, np.divide(sums, totals, out=np.full_like(sums, np.nan), where=totals > 0), totals


@dataclass(frozen=True, eq=False)
class TrainingRuns:
    """Checked training runs, averaged over replicates: what both interpolants start from.

    Attributes
    ----------
    raw_points, raw_values : (n, d) and (n, m), a row per run
    points, values, counts : (p, d), (p, m) and (p, m), a row per distinct point
    noise : (m,) seed noise of a single run, NaN where it has to be estimated
    noise_sources : (m,) "given", "replicates" or "estimated"
    responses, parameters : m keys and d names
    """

    raw_points: np.ndarray
    raw_values: np.ndarray
    points: np.ndarray
    values: np.ndarray
    counts: np.ndarray
    noise: np.ndarray
    noise_sources: tuple[str, ...]
    responses: list[str]
    parameters: list[str]


def checked_runs(
    points: np.ndarray,
    values: np.ndarray,
    names: Sequence[str],
    noise: np.ndarray | None,
    counts: np.ndarray | None,
    parameters: Sequence[str] | None,
    fewest_degrees: int,
) -> TrainingRuns:
    """The runs as an interpolant needs them: finite, averaged, with their seed noise.

    Parameters
    ----------
    points, values, names, noise, counts, parameters : as for the interpolants' `fit`
    fewest_degrees : of freedom, from which seed noise is pooled from replicates

    Raises
    ------
    CalibratorError : shapes that do not fit, points that are not finite, or counts without noise
    """
    points, values = np.asarray(points, float), np.asarray(values, float)
    if points.ndim != 2 or values.shape != (len(points), len(names)) or not len(points):
        raise CalibratorError(
            f"points {points.shape} and values {values.shape} do not fit {len(names)} responses:"
            " give (n, d) and (n, m), n > 0"
        )
    if not np.isfinite(points).all() or np.isinf(values).any():
        raise CalibratorError(
            "a training point is not finite or a response is infinite: leave failed runs out"
        )
    if counts is not None and noise is None:
        raise CalibratorError(
            "rows that already average several runs hide the seed noise: give noise together with"
            " counts"
        )
    known_noise, sources = _noise_of(points, values, noise, fewest_degrees)
    parameters = (
        list(parameters)
        if parameters is not None
        else [f"parameter {i + 1}" for i in range(points.shape[1])]
    )
    return TrainingRuns(
        points,
        values,
        *average_replicates(points, values, counts),
        known_noise,
        sources,
        list(names),
        parameters,
    )


def _noise_of(
    points: np.ndarray, values: np.ndarray, noise: np.ndarray | None, fewest_degrees: int
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Seed noise (m,), NaN where it has to be estimated, and where each is from."""
    if noise is not None:
        return (
            np.broadcast_to(np.asarray(noise, float), values.shape[1]).copy(),
            ("given",) * values.shape[1],
        )
    pooled, degrees = seed_noise(points, values)
    measured = degrees >= fewest_degrees
    return np.where(measured, pooled, np.nan), tuple(
        "replicates" if m else "estimated" for m in measured
    )


def common_source(sources: Sequence[str]) -> str:
    """The one source that all have, else "mixed"."""
    return sources[0] if len(set(sources)) == 1 else "mixed"
