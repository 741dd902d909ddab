"""Snapshots of a run, and which of them make an animation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calibrator.errors import CalibratorError
from calibrator.files import read_arrays

MOVING = 0.02
"""Share of a stage's largest mean speed below which nothing moves that could be seen."""

SHAPES = {
    "ids": (None,),
    "clumps": (None,),
    "centres": (None, 3),
    "radii": (None,),
    "speeds": (None,),
    "facets": (None, 3, 3),
    "planes": (None, 2),
    "stage": (),
    "time": (),
}
"""Arrays of a snapshot's file; None stands for any length."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Spheres and walls at one moment.

    Attributes
    ----------
    stage : the run's wait, the first is the filling; time [s] : since the run began.
    ids, clumps (n,) : numbers of the spheres, and of the clumps that they belong to, which are
        their own where they belong to none.
    centres (n, 3) [m], radii (n,) [m], speeds (n,) [m/s].
    facets (m, 3, 3) [m] : corners of the walls; planes (k, 2) : axis and place [m] of those without
        end.
    """

    stage: int
    time: float
    ids: np.ndarray
    clumps: np.ndarray
    centres: np.ndarray
    radii: np.ndarray
    speeds: np.ndarray
    facets: np.ndarray
    planes: np.ndarray


@dataclass(frozen=True, eq=False)
class Film:
    """All snapshots of a run in their order: files, stages, times [s] and mean speeds [m/s]."""

    paths: tuple[Path, ...]
    stages: np.ndarray
    times: np.ndarray
    speeds: np.ndarray

    @classmethod
    def read(cls, folder: Path) -> Film:
        """The film in a folder.

        Raises CalibratorError where a snapshot is damaged, or one of the filling or of what follows
        it is missing.
        """
        paths = tuple(sorted(folder.glob("*.npz")))
        shots = [read_snapshot(path) for path in paths]
        if not {0, 1} <= {s.stage for s in shots}:
            raise CalibratorError(
                f"{folder} has no snapshot of a whole run, which may have ended too early: choose"
                " another run"
            )
        speeds = [float(s.speeds.mean()) if len(s.speeds) else 0.0 for s in shots]
        stages, times = [s.stage for s in shots], [s.time for s in shots]
        return cls(paths, np.array(stages), np.array(times), np.array(speeds))

    @property
    def filled(self) -> int:
        """Index of the snapshot at the end of the filling."""
        return int(np.flatnonzero(self.stages == 0)[-1])

    @property
    def released(self) -> float:
        """Time [s] of the release."""
        return float(self.times[self.filled])

    def chosen(self, count: int) -> list[int]:
        """Indices of at most so many snapshots, evenly over the time in which grains move.

        The last ones of the filling and of the run are among them.
        """
        moving = _moving_time(self.stages, self.times, self.speeds)
        wanted = np.linspace(0, moving[-1], max(count - 2, 2))
        nearest = {int(np.abs(moving - moment).argmin()) for moment in wanted}
        return sorted({*nearest, self.filled, len(self.times) - 1})

    def moments(self) -> list[int]:
        """Indices of the four snapshots of the picture: filled, two of the release, at rest."""
        moving = _moving_time(self.stages, self.times, self.speeds)
        begin, end = moving[self.filled], moving[-1]
        between = [
            int(np.abs(moving - (begin + share * (end - begin))).argmin()) for share in (0.25, 0.6)
        ]
        return [self.filled, *between, len(self.times) - 1]


def _moving_time(stages: np.ndarray, times: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Time (n,) [s] at each snapshot without that in which the grains of a stage only settle."""
    steps = np.diff(times, prepend=0.0)
    for stage in np.unique(stages):
        own = np.flatnonzero(stages == stage)
        last = own[np.flatnonzero(speeds[own] >= MOVING * speeds[own].max())[-1]]
        steps[own[own > last]] = 0.0
    return np.cumsum(steps)


def read_snapshot(path: Path) -> Snapshot:
    """One snapshot; CalibratorError, with the remedy, where its file is damaged."""
    try:
        arrays = read_arrays(path)
        wrong = [name for name, shape in SHAPES.items() if not _has_shape(arrays[name], shape)]
        counts = {len(arrays[name]) for name in ("ids", "clumps", "centres", "radii", "speeds")}
        if wrong or len(counts) > 1:
            raise ValueError(f"{' and '.join(wrong) or 'its arrays'} cannot be of one scene")
    except (FileNotFoundError, KeyError, ValueError) as error:
        raise CalibratorError(
            f"{path} is damaged ({error}): delete its folder, and run the same command again"
        ) from None
    numbers = {n: a.astype(int) for n, a in arrays.items() if n in ("ids", "clumps")}
    return Snapshot(
        int(arrays["stage"]),
        float(arrays["time"]),
        **numbers,
        **{n: arrays[n] for n in ("centres", "radii", "speeds", "facets", "planes")},
    )


def _has_shape(array: np.ndarray, shape: Sequence[int | None]) -> bool:
    return (
        array.ndim == len(shape)
        and all(want in (None, have) for want, have in zip(shape, array.shape, strict=True))
        and bool(np.isfinite(array).all())
    )
