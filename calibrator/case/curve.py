"""A measured curve: a profile, or a mass over the time, as a file beside the lab file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from calibrator.case.cells import read_rows
from calibrator.case.values import LARGEST
from calibrator.errors import CalibratorError, Mistakes

FEWEST_POINTS = 5
COLUMNS, OPTIONAL = ("x", "value"), ("scatter",)


@dataclass(frozen=True)
class MeasuredCurve:
    """A measured curve, the mean of its target's replicates.

    Attributes
    ----------
    x, value : of each point, in SI units; x rises.
    scatter : standard deviation of one replicate at each point, in the value's unit; zeros where it
        is not known. How replicates scatter together from point to point is taken from simulated
        replicates.
    scale_error : standard deviation of an error that all points share, as a share of the value,
        such as that of the scale of a photograph; offset_error, shift_error : the same added to
        every value, and to every x, in their units. Replicates do not average these out.
    """

    x: tuple[float, ...]
    value: tuple[float, ...]
    scatter: tuple[float, ...]
    scale_error: float = 0.0
    offset_error: float = 0.0
    shift_error: float = 0.0

    def __post_init__(self) -> None:
        if len(self.x) < FEWEST_POINTS:
            raise CalibratorError(f"{len(self.x)} points: give {FEWEST_POINTS} or more")
        if not all(a < b for a, b in zip(self.x, self.x[1:], strict=False)):
            raise CalibratorError("x does not rise from row to row: sort them, each x once")
        numbers = (*self.x, *self.value, *self.scatter)
        if not all(abs(one) <= LARGEST for one in numbers) or min(self.scatter) < 0:
            raise CalibratorError("give finite numbers, and a scatter of zero or more")
        if not self.span:
            raise CalibratorError("all values are the same: a curve has to rise or fall")
        for name in ("scale_error", "offset_error", "shift_error"):
            if not 0 <= getattr(self, name) <= LARGEST:
                raise CalibratorError(
                    f"{name} = {getattr(self, name)}: give a standard deviation of zero or more"
                )

    @property
    def span(self) -> float:
        """Largest value less the smallest, what relative errors refer to."""
        return max(self.value) - min(self.value)

    @property
    def level(self) -> float:
        """Mean of the values."""
        return math.fsum(self.value) / len(self.value)


def read_curve(path: Path) -> MeasuredCurve:
    """Read a curve: the columns x, value and, where it is known, scatter, in SI units.

    Raises CalibratorError with the remedy.
    """
    rows, mistakes, points = read_rows(path, "curve", COLUMNS, OPTIONAL), Mistakes(), []
    for where, cells in rows:
        try:
            points.append([float(cells.get(n) or "0") for n in (*COLUMNS, *OPTIONAL)])
        except ValueError as error:
            mistakes.note([f"{where}: {error}; write plain numbers"])
        mistakes.note(f"{where}: {n} is empty; fill it in" for n in COLUMNS if not cells[n])
    mistakes.raise_any()
    x, value, scatter = zip(*points, strict=True) if points else ((), (), ())
    try:
        return MeasuredCurve(x, value, scatter)
    except CalibratorError as error:
        raise CalibratorError(f"{path}: {error}") from None


def curve_file(curve: MeasuredCurve) -> str:
    """The text of a curve's file, which `read_curve` reads."""
    rows = zip(curve.x, curve.value, curve.scatter, strict=True)
    lines = [",".join((*COLUMNS, *OPTIONAL)), *(f"{x!r},{y!r},{s!r}" for x, y, s in rows)]
    return "\n".join(lines) + "\n"
