"""The curves of repeats as one: a file beside the lab file, and a row that names it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calibrator.case.curve import MeasuredCurve, curve_file
from calibrator.case.vocabulary import CURVES, OPEN_ENDED
from calibrator.errors import CalibratorError
from calibrator.files import named_file, write_text
from calibrator.laboratory.outcome import Reading, Row

POINTS = 51
DIGITS = 6


def write_curve(
    path: Path, lab: Path | None, readings: Sequence[Reading], kind: tuple[str, str, str, str]
) -> Row:
    """Write the mean curve of repeats; returns the row of the lab file that names it.

    lab : the lab file that the row goes to, None where it is only printed; kind : set-up,
    condition, name of the curve and role. Raises CalibratorError for a repeat without a curve, and
    a file that the lab file cannot name.
    """
    setup, condition, name, role = kind
    if role == "diagnose":
        raise CalibratorError("a curve is no evidence for a diagnosis; give --role, or no --curve")
    curve = mean_curve(readings, (name, setup) in OPEN_ENDED)
    own = path.name if lab is None else os.path.relpath(path, lab.parent)
    if lab is not None:
        named_file(lab, own, "--curve")
    write_text(path, curve_file(curve))
    unit = CURVES[name].unit
    return Row(setup, condition, name, curve.level, None, len(readings), unit, role, own)


def mean_curve(readings: Sequence[Reading], open_ended: bool) -> MeasuredCurve:
    """Mean and scatter of the repeats' curves, where all have one.

    open_ended : whether a curve goes on as it ends, so that the longest one sets the end.
    """
    if bare := [r.source for r in readings if not len(r.profile[0])]:
        raise CalibratorError(
            f"{bare[0]}: no curve to write, as it is not known when the neck was opened; give"
            " --released, or --fall-height"
        )
    ends = [r.profile[0][-1] for r in readings]
    start, end = max(r.profile[0][0] for r in readings), max(ends) if open_ended else min(ends)
    at = np.linspace(start, end, POINTS)
    rows = np.array([np.interp(at, *r.profile) for r in readings])
    scatter = rows.std(axis=0, ddof=1) if len(rows) > 1 else np.zeros(POINTS)
    x, value, spread = (
        tuple(float(f"{one:.{DIGITS}g}") for one in own) for own in (at, rows.mean(axis=0), scatter)
    )
    return MeasuredCurve(x, value, spread)
