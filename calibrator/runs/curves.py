"""The curves that runs leave: beside their records, and beside a database that is shipped.

A curve travels as at most POINTS of its points, so that those of hundreds of runs fit beside a
database, and so that a run says the same whether it was made here or shipped.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from calibrator.case.vocabulary import ACROSS, CURVES
from calibrator.errors import CalibratorError
from calibrator.files import packed, read_arrays, write_bytes
from calibrator.runs.folder import RunFolder
from calibrator.runs.record import Record

POINTS = 101
ARRAYS = {*CURVES, *(across for own in ACROSS.values() for across in own.values())}

Curves = dict[str, np.ndarray]
"""Curves (2, n) of a run by name: what they run over, and their values."""


def companion(database: Path) -> Path:
    """Where the curves of a database's runs are: runs.csv has runs_curves.npz beside it."""
    return database.with_name(f"{database.stem}_curves.npz")


def curves_of(folder: RunFolder, record: Record) -> Curves:
    """The curves that a run left in this folder; none where it left no arrays.

    Raises CalibratorError where they are damaged.
    """

    def thinned(arrays: Curves) -> Curves:
        return {
            name: _thinned(arrays[across], arrays[name])
            for name, own in ACROSS.items()
            if (across := own.get(record.request.setup)) and {name, across} <= set(arrays)
        }

    return arrays_of(folder, record, thinned, ARRAYS)


def arrays_of(
    folder: RunFolder,
    record: Record,
    checked: Callable[[Curves], Curves],
    names: Collection[str] | None = None,
) -> Curves:
    """What is made of the arrays that a run left in this folder; nothing where it left none.

    checked : makes it, and raises ValueError where they are damaged; names : of the arrays that are
    wanted, None for all. Raises CalibratorError where they are damaged.
    """
    path = folder.curves(record.run_id)
    try:
        return checked(read_arrays(path, names=names))
    except FileNotFoundError:
        return {}
    except ValueError as error:
        raise CalibratorError(
            f"{path} is damaged ({error}): delete it and its record, then run the verbs again"
        ) from None


def _thinned(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A curve (2, n) of no more than POINTS points, evenly spaced where there were more."""
    if x.ndim != 1 or x.shape != y.shape or not len(x) or not np.isfinite([x, y]).all():
        raise ValueError("its columns are not those of a curve")
    if len(x) > POINTS:
        at = np.linspace(x[0], x[-1], POINTS)
        x, y = at, np.interp(at, x, y)
    return np.array([x, y], np.float32).astype(float)


def write_companion(database: Path, curves: Mapping[str, Curves]) -> None:
    """Write the curves of runs, by run id, beside their database; nothing where there are none.

    The same curves give the same bytes.
    """
    arrays = {
        f"{run_id}.{name}": curve.astype(np.float32)
        for run_id in sorted(curves)
        for name, curve in sorted(curves[run_id].items())
    }
    if arrays:
        write_bytes(companion(database), packed(arrays))


def read_companion(database: Path, run_ids: Sequence[str]) -> dict[str, Curves]:
    """The curves of these runs, by run id; of those that the file beside a database has.

    Raises CalibratorError where it is damaged.
    """
    path, found = companion(database), dict[str, Curves]()
    wanted = [f"{run_id}.{name}" for run_id in run_ids for name in CURVES]
    try:
        for key, curve in read_arrays(path, names=wanted).items():
            if curve.ndim != 2 or len(curve) != 2 or not np.isfinite(curve).all():
                raise ValueError(f"{key} is no curve")
            run_id, name = key.split(".")
            found.setdefault(run_id, {})[name] = curve
    except FileNotFoundError:
        return {}
    except ValueError as error:
        raise CalibratorError(
            f"{path} is damaged ({error}): restore it from its source, or delete it"
        ) from None
    return found
