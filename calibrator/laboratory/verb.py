"""The verb `measure`: its arguments, and what it does with them."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from calibrator.case.lab import ROLES
from calibrator.case.vocabulary import SETUPS
from calibrator.errors import CalibratorError, Mistakes, shown
from calibrator.files import own_folder
from calibrator.laboratory.camera import Camera
from calibrator.laboratory.curve import write_curve
from calibrator.laboratory.discharge import Bench, measure_discharge
from calibrator.laboratory.outcome import Measured, Reading, Row
from calibrator.laboratory.photo import Shot, measure_photo
from calibrator.laboratory.profile import Ground, measure_profile
from calibrator.laboratory.readings import read_readings
from calibrator.laboratory.rows import check_rows, combined, notes_of, write_rows
from calibrator.laboratory.tables import Column, read_runs
from calibrator.laboratory.units import quantity

KINDS = {
    "discharge": "logs of a scale: time and mass",
    "profile": "profiles of a heap, slope or crater: position and height",
    "photo": "photographs of a heap, a slope or a drum",
    "readings": "single readings: response,value,unit",
}
HOMES = {"heap": "conical_pile", "slope": "ledge", "crater": "hourglass", "drum": "rotating_drum"}
"""The set-up whose responses a shape has."""

TIME_WORDS = frozenset(("time", "t", "zeit", "elapsed", "seconds", "timestamp", "clock"))
MASS_WORDS = frozenset(("mass", "m", "masse", "weight", "w", "gewicht", "reading", "balance"))
X_WORDS = frozenset(("x", "position", "distance", "radius", "r"))
Z_WORDS = frozenset(("z", "height", "h", "y", "elevation"))


def add_arguments(parser: argparse.ArgumentParser, path: Callable[[str], Path]) -> None:
    """Add the kinds of raw data and their options; path : makes one of an argument."""
    kinds = parser.add_subparsers(dest="kind", required=True, metavar="KIND")
    for kind, about in KINDS.items():
        own = kinds.add_parser(kind, help=about, description=about)
        own.add_argument(
            "files", type=path, nargs="+", metavar="FILE", help="a repeat or more each"
        )
        own.add_argument("--lab", type=path, metavar="FILE", help="lab file to append the rows to")
        own.add_argument("--condition", default="", help="of the case, that was measured under")
        own.add_argument("--role", choices=ROLES, default="calibrate", help="of the rows")
        own.add_argument("--json", action="store_true", help="print the outcome as JSON")
        if kind != "readings":
            own.add_argument(
                "--curve", type=path, metavar="FILE", help="for the mean curve, which a row names"
            )
        if kind == "readings":
            own.add_argument("--setup", choices=SETUPS, required=True)
        for name, text in _OPTIONS[kind].items():
            own.add_argument(f"--{name}", metavar="VALUE", default="", help=text)
        if kind in ("profile", "photo"):
            shapes = [s for s in HOMES if s != ("drum" if kind == "profile" else "crater")]
            own.add_argument("--shape", choices=shapes, default="heap", help="(default: heap)")
        if kind == "photo":
            own.add_argument(
                "--results", type=path, default=Path("results"), help="for <name>_measured.png"
            )


_SIZES = {
    "cylinder-diameter": "of the vessel, such as '30 mm'",
    "neck-diameter": "of the round neck in its bottom",
}
_SURFACE = {
    "grain-diameter": "such as '2 mm': half of it is the width that heights are averaged over",
    "box-length": "of a ledge, from its back wall to its edge",
}
_OPTIONS = {
    "discharge": {
        "time-unit": "where the log has none",
        "mass-unit": "where the log has none",
        "released": "when the neck was opened, by the log's clock, such as '3.2 s'",
        "fall-height": "of the neck above the pan, where the release is not known",
        "fill-mass": "that was filled in, such as '16 g'",
        "bulk-density": "of the filling, such as '1.53 g/cm3'",
        **_SIZES,
    },
    "profile": {
        "length-unit": "where the profile has none",
        "axis": "position of the heap's or crater's axis, such as '0 mm'",
        "base": "height of the ground, such as '0 mm'",
        **_SURFACE,
        **_SIZES,
    },
    "photo": {
        "known": "a length in the picture: 'x1,y1 x2,y2 = 84 mm', or '406 = 84 mm' for 406 pixels",
        "tilt": "by how much the camera looks down, in degrees (default: 0)",
        "tilt-error": "how well that is known, in degrees (default: 1)",
        "roll": "by how much the horizon is turned anticlockwise, in degrees (default: 0)",
        "crop": "left,top,right,bottom in pixels",
        "base": "row of the ground, in pixels from the top",
        "circle": "column,row,radius of a drum in pixels (default: the picture's own)",
        **_SURFACE,
    },
    "readings": {},
}


def measure(options: argparse.Namespace, command: Sequence[str]) -> Measured:
    """Measure raw data; writes rows where --lab is given. command : as it was called, for notes.

    Raises CalibratorError for everything that is wrong, with what to do.
    """
    given = _Given(options)
    converted: dict[str, None] = {}
    readings: list[Reading] = []
    mistakes = Mistakes()
    readers: dict[str, Callable[[Path, _Given], tuple[list[Reading], list[str]]]] = {
        "discharge": _discharges,
        "profile": _profiles,
        "photo": _photos,
        "readings": lambda path, _: read_readings(path),
    }
    read = readers[options.kind]
    for path in options.files:
        with mistakes.noted():
            some, words = read(path, given)
            readings += some
            converted.update(dict.fromkeys(words))
    mistakes.raise_any()
    converted.update(dict.fromkeys(given.converted))
    setup = getattr(options, "setup", None) or HOMES.get(getattr(options, "shape", "crater"), "")
    rows = combined(readings, setup, options.condition, options.role) if setup else []
    _all_belong(readings, rows, setup)
    check_rows(rows)
    if getattr(options, "curve", None) is not None:
        rows.append(_curve(options, given, readings, setup))
    warnings = []
    if rows and max(row.replicates for row in rows) == 1:
        warnings.append(
            "one repeat: the scatter is the error of its reading only; measure at least three"
        )
    lab = str(options.lab) if options.lab and rows else ""
    found = Measured(
        options.kind, tuple(readings), tuple(rows), tuple(converted), tuple(warnings), lab
    )
    if lab:
        write_rows(options.lab, rows, notes_of(found, command))
    return found


def _curve(
    options: argparse.Namespace, given: _Given, readings: Sequence[Reading], setup: str
) -> Row:
    """The row of the mean curve, which is written."""
    if options.kind == "photo" and not given.text("known"):
        raise CalibratorError("--curve needs lengths: give one in the picture with --known")
    name = "passed_mass" if options.kind == "discharge" else "profile_height"
    kind = (setup, options.condition, name, options.role)
    return write_curve(options.curve, options.lab, readings, kind)


def _all_belong(readings: Sequence[Reading], rows: Sequence[object], setup: str) -> None:
    """Raise CalibratorError for readings of a response that the set-up does not have."""
    have = {getattr(row, "response", "") for row in rows}
    lost = {n for r in readings for n, v in r.values.items() if v.response and n not in have}
    if setup and lost:
        raise CalibratorError(
            f"{setup} does not measure {', '.join(sorted(lost))}; correct --setup"
        )


class _Given:
    """The options that are quantities, in SI, and what was converted of them."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.converted: dict[str, None] = {}

    def text(self, name: str) -> str:
        """An option as it was given; "" where it was not."""
        return str(getattr(self.options, name.replace("-", "_"), "") or "")

    def si(self, name: str, unit: str, positive: bool = True) -> float | None:
        """A quantity in SI; None where it was not given."""
        if not (text := self.text(name)):
            return None
        value, words = quantity(text, unit, f"--{name}")
        if positive and value <= 0:
            raise CalibratorError(f"--{name} {shown(text)}: give a positive value")
        if words:
            self.converted[words] = None
        return value

    def numbers(self, name: str, count: int) -> tuple[float, ...] | None:
        """Plain numbers between commas; None where they were not given."""
        if not (text := self.text(name)):
            return None
        try:
            found = tuple(float(cell) for cell in text.split(","))
        except ValueError:
            found = ()
        if len(found) != count or not all(abs(one) < 1e6 for one in found):
            raise CalibratorError(
                f"--{name} {shown(text)}: give {count} plain number{'s' * (count > 1)}"
                f"{' between commas' * (count > 1)}"
            )
        return found

    def one(self, name: str, default: float) -> float:
        """A plain number."""
        found = self.numbers(name, 1)
        return found[0] if found else default

    def ground(self) -> Ground:
        """What is known of a surface."""
        grain = self.si("grain-diameter", "m")
        photo = self.options.kind == "photo"
        return Ground(
            None if grain is None else grain / 2,
            None if photo else self.si("axis", "m", False),
            None if photo else self.si("base", "m", False),
            self.si("box-length", "m"),
            self.si("cylinder-diameter", "m"),
            self.si("neck-diameter", "m"),
        )


def _discharges(path: Path, given: _Given) -> tuple[list[Reading], list[str]]:
    columns = (
        Column("time", TIME_WORDS, "s", given.text("time-unit"), "--time-unit"),
        Column("mass", MASS_WORDS, "kg", given.text("mass-unit"), "--mass-unit"),
    )
    runs, words = read_runs(path, columns)
    bench = Bench(
        given.si("released", "s", False),
        given.si("fall-height", "m"),
        given.si("fill-mass", "kg"),
        given.si("bulk-density", "kg/m3"),
        given.si("cylinder-diameter", "m"),
        given.si("neck-diameter", "m"),
    )
    return [measure_discharge(run, bench) for run in runs], words


def _profiles(path: Path, given: _Given) -> tuple[list[Reading], list[str]]:
    unit = given.text("length-unit")
    columns = (
        Column("position", X_WORDS, "m", unit, "--length-unit"),
        Column("height", Z_WORDS, "m", unit, "--length-unit"),
    )
    runs, words = read_runs(path, columns)
    readings = []
    for run in runs:
        try:
            found = measure_profile(run.first, run.second, given.options.shape, given.ground())
        except CalibratorError as error:
            raise CalibratorError(*(f"{run.source}: {m}" for m in error.messages)) from None
        profile = (tuple(map(float, found.position)), tuple(map(float, found.height)))
        readings.append(Reading(run.source, found.values, found.notes, found.warnings, profile))
    return readings, words


def _photos(path: Path, given: _Given) -> tuple[list[Reading], list[str]]:
    ground = given.ground()
    if (ground.grain_radius or ground.box_length) and not given.text("known"):
        raise CalibratorError(
            "--grain-diameter and --box-length say nothing in pixels; give a length in the picture"
            " with --known"
        )
    camera = Camera(
        tilt=given.one("tilt", 0.0),
        tilt_error=given.one("tilt-error", 1.0),
        roll=given.one("roll", 0.0),
    )
    base = given.numbers("base", 1)
    shot = Shot(
        given.options.shape,
        camera,
        given.text("known"),
        given.numbers("crop", 4),
        base[0] if base else None,
        given.numbers("circle", 3),
        ground,
        own_folder(given.options.results) / f"{path.stem}_measured.png",
    )
    try:
        reading, words = measure_photo(path, shot)
    except CalibratorError as error:
        named = (m if path.name in m else f"{path.name}: {m}" for m in error.messages)
        raise CalibratorError(*named) from None
    return [reading], words
