"""What `init` is told: a table of answers, from a file, from options or from questions, in SI."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.case.codec import Table
from calibrator.case.lab import Observable, read_lab
from calibrator.case.physics import GRAVITY
from calibrator.case.values import known
from calibrator.case.vocabulary import PARAMETERS, RESPONSES, SETUPS
from calibrator.errors import CalibratorError, shown
from calibrator.files import read_text
from calibrator.first_case.grains import SHAPES
from calibrator.first_case.quantities import (
    Reader,
    as_text,
    budget_of,
    plain_word,
    positive,
    rate_of,
    repeats_of,
    restitution_of,
    sizes_of,
    speed_of,
)
from calibrator.first_case.vessels import LEDGE_WIDTH, clear_height
from calibrator.foresight.smallest import LEAST
from calibrator.laboratory.rows import LESSER

KEYS = {
    "name": "a plain word for the material, such as my_sand",
    "about": "one line for the report",
    "shape": "spheres, rounded or angular",
    "grain_diameter": "such as '2 mm', or of a sieve fraction '1.6-2.0 mm'",
    "particle_density": "of the solid, such as '2.65 g/cm3'",
    "restitution": "normal coefficient of restitution, where it is known",
    "budget": "core-hours for everything, such as 2",
    "lab": "lab file that `calibrator measure` has written",
    "particle_steps_per_second": "of a core, up to a thousand grains; measured here otherwise",
}
"""The answers beside those of a set-up, and what each is."""

REQUIRED = ("name", "shape", "grain_diameter", "particle_density")
BUDGET = 4.0
VESSELS = {
    "hourglass": ("cylinder_diameter", "neck_diameter", "fill_mass"),
    "ledge": ("box_length", "fill_height"),
    "conical_pile": ("cylinder_diameter", "fill_height"),
    "rotating_drum": ("drum_diameter", "drum_depth", "rotation_rpm"),
}
"""What has to be known of each vessel."""
FURTHER = {
    "hourglass": (),
    "ledge": ("box_width",),
    "conical_pile": ("lift_speed", "lift_height"),
    "rotating_drum": ("fill_fraction", "shell_friction_ratio", "face_friction_ratio"),
}
"""What may be."""
EVEN_SPREAD = 0.03
"""Coefficient of variation below which grains count as of one size."""


@dataclass(frozen=True, kw_only=True)
class Answers:
    """What is known of a material and its measurements, in SI.

    Attributes
    ----------
    name, about, shape : as in KEYS.
    grain : mean diameter [m]; spread : coefficient of variation of the diameter.
    particle_density [kg/m3]; restitution : None where it is not known; budget : core-hours.
    rate : particle-steps a second and core; None where nobody has measured it.
    vessels : geometry of each set-up that measured something, by name, the laboratory's own.
    rows : what was measured.
    converted : units, in words; assumed : what nobody said, in words.
    """

    name: str
    about: str
    shape: str
    grain: float
    spread: float
    particle_density: float
    restitution: float | None
    budget: float
    rate: float | None
    vessels: dict[str, dict[str, float]]
    rows: tuple[Observable, ...]
    converted: tuple[str, ...]
    assumed: tuple[str, ...]


def read_answers(path: Path) -> Table:
    """The table of an answers file; CalibratorError, with the remedy, where it is none."""
    try:
        return tomllib.loads(read_text(path, 0.25))
    except FileNotFoundError:
        raise CalibratorError(f"no file {path}: give the path of a TOML file of answers") from None
    except (OSError, ValueError, RecursionError) as error:
        raise CalibratorError(f"cannot read {path} ({error}): correct that line") from None


def with_options(table: Table, given: list[str]) -> Table:
    """The table with `key=value` of the command line put into it, dots in a key going deeper."""
    for text in given:
        key, equals, value = text.partition("=")
        *outer, last = [part.strip() for part in key.split(".")]
        if not equals or not last:
            raise CalibratorError(
                f"--set {shown(text)}: write KEY=VALUE, such as grain_diameter='2 mm'"
            )
        own = table
        for part in outer:
            own = own.setdefault(part, {})
            if not isinstance(own, dict):
                raise CalibratorError(f"--set {shown(text)}: {part} has a value, and no keys below")
        own[last] = value.strip()
    return table


def answers_of(table: Mapping[str, Any], folder: Path = Path()) -> Answers:
    """The answers of a table, checked; folder : that a lab file is relative to.

    Raises CalibratorError with all that is wrong or missing.
    """
    reader, found = Reader(), Table()
    for key in table:
        with reader.mistakes.noted():
            known(key, (*KEYS, *SETUPS), "answer")
    for name in REQUIRED:
        if not str(table.get(name, "")).strip():
            reader.mistakes.note([f"{name} is missing: give {KEYS[name]}"])
    readers: dict[str, Callable[[], Any]] = {
        "name": lambda: plain_word(as_text(table["name"])),
        "shape": lambda: known(as_text(table["shape"]), SHAPES, "shape"),
        "grain": lambda: sizes_of(reader, as_text(table["grain_diameter"])),
        "particle_density": lambda: positive(
            reader.si(table["particle_density"], "kg/m3", "particle_density"), "particle_density"
        ),
        "restitution": lambda: restitution_of(reader, table.get("restitution")),
        "budget": lambda: budget_of(table.get("budget", BUDGET)),
        "rate": lambda: rate_of(table.get("particle_steps_per_second")),
    }
    for key, read in readers.items():
        asked = "grain_diameter" if key == "grain" else key
        if asked in REQUIRED and not str(table.get(asked, "")).strip():
            continue
        with reader.mistakes.noted():
            found[key] = read()
    vessels, rows = _measurements(table, reader, folder)
    reader.mistakes.raise_any()
    if not rows:
        raise CalibratorError(
            "nothing was measured: give a lab file (lab) that `calibrator measure` has written, or"
            " values under conical_pile.measured, ledge.measured or hourglass.measured"
        )
    _no_set_up_without_rows(vessels, rows)
    grain, spread = found.pop("grain")
    for setup, own in vessels.items():
        _assume(reader, setup, own, grain, rows)
    return Answers(
        **found,
        about=as_text(table.get("about", "")),
        grain=grain,
        spread=spread,
        vessels=vessels,
        rows=tuple(rows),
        converted=tuple(reader.converted),
        assumed=tuple(reader.assumed),
    )


def _measurements(
    table: Mapping[str, Any], reader: Reader, folder: Path
) -> tuple[dict[str, dict[str, float]], list[Observable]]:
    """Vessels, and rows of the lab file and of the answers themselves."""
    vessels: dict[str, dict[str, float]] = {}
    rows: list[Observable] = []
    if lab := as_text(table.get("lab", "")):
        with reader.mistakes.noted():
            rows += _lab_rows(folder / lab)
    for setup in SETUPS:
        own = table.get(setup, {})
        if not isinstance(own, dict) or not isinstance(own.get("measured", {}), dict):
            reader.mistakes.note([f"{setup} must be a table, and {setup}.measured one too"])
            continue
        for response, value in own.get("measured", {}).items():
            with reader.mistakes.noted():
                rows.append(_row(reader, setup, response, value))
        if own or any(r.setup == setup for r in rows):
            vessels[setup] = _vessel(reader, setup, own)
    keys = [r.key for r in rows]
    if twice := sorted({k for k in keys if keys.count(k) > 1}):
        reader.mistakes.note([f"{', '.join(twice)}: measured twice, here and in the lab file"])
    return vessels, rows


def _lab_rows(path: Path) -> list[Observable]:
    """The rows of a lab file, none of which may have a condition."""
    rows = list(read_lab(path))
    if others := sorted({r.condition for r in rows if r.condition}):
        raise CalibratorError(
            f"{path} has rows under {', '.join(others)}: leave them out here, and add the condition"
            " to the case afterwards (docs/case_file.md)"
        )
    return rows


def _vessel(reader: Reader, setup: str, own: Mapping[str, Any]) -> dict[str, float]:
    found = {}
    for name in own:
        with reader.mistakes.noted():
            allowed = (*VESSELS[setup], *FURTHER[setup], "measured")
            known(name, allowed, f"answer under {setup}")
    for name in (*VESSELS[setup], *FURTHER[setup]):
        if name in own:
            with reader.mistakes.noted():
                unit = PARAMETERS[name].unit
                value = own[name]
                given = speed_of(value) if unit == "m/s" else reader.si(value, unit, name)
                found[name] = positive(given, f"{setup}.{name}")
        elif name in VESSELS[setup]:
            reader.mistakes.note(
                [f"{setup}.{name} is missing: give the {PARAMETERS[name].about}, with its unit"]
            )
    return found


def _row(reader: Reader, setup: str, response: str, value: Any) -> Observable:
    """One measurement: repeats between commas, or a list of them, each with its unit or the last.

    Or value, scatter and replicates in a table.
    """
    what = f"{setup}.{response}"
    here = [n for n, q in RESPONSES.items() if setup in q.setups]
    unit = RESPONSES[known(response, here, f"response of {setup}")].unit
    role = "diagnose" if response in LESSER else "calibrate"
    if isinstance(value, dict):
        for key in value:
            known(key, ("value", "scatter", "replicates"), f"answer under {what}")
        number = reader.si(value.get("value", ""), unit, what)
        scatter = reader.si(value["scatter"], unit, what) if "scatter" in value else 0.0
        return Observable(setup, response, number, scatter, int(value.get("replicates", 1)), role)
    repeats = value if isinstance(value, list) else repeats_of(as_text(value))
    numbers = [reader.si(one, unit, what) for one in repeats]
    scatter = float(np.std(numbers, ddof=1)) if len(numbers) > 1 else 0.0
    return Observable(setup, response, float(np.mean(numbers)), scatter, len(numbers), role)


def _assume(
    reader: Reader, setup: str, vessel: dict[str, float], grain: float, rows: list[Observable]
) -> None:
    """Fill in what nobody said of a vessel, and say so."""
    if setup == "rotating_drum" and "fill_fraction" not in vessel:
        seen = [r.value for r in rows if r.response == "drum_filled_share"]
        vessel["fill_fraction"] = seen[0] if seen else 0.5
        reader.assumed.append(
            f"fill_fraction = {vessel['fill_fraction']:.3g}{', as the picture shows' * bool(seen)}"
        )
    if setup == "ledge" and "box_width" not in vessel:
        vessel["box_width"] = LEDGE_WIDTH * grain
        reader.assumed.append(f"box_width = {vessel['box_width']:g} m, without side walls")
    if setup == "conical_pile":
        if "lift_speed" not in vessel:
            vessel["lift_speed"] = float(f"{LEAST['lift'].least * math.sqrt(GRAVITY * grain):.2g}")
            reader.assumed.append(
                f"lift_speed = {vessel['lift_speed']:g} m/s, slow; measure yours: a faster lift"
                " makes a flatter heap"
            )
        if "lift_height" not in vessel:
            vessel["lift_height"] = float(f"{clear_height(vessel, grain):.3g}")
            reader.assumed.append(
                f"lift_height = {vessel['lift_height']:g} m, clear of any heap of that fill"
            )


def _no_set_up_without_rows(vessels: Table, rows: list[Observable]) -> None:
    if idle := [s for s in vessels if not any(r.setup == s for r in rows)]:
        raise CalibratorError(
            f"nothing was measured in {', '.join(idle)}: give values under {idle[0]}.measured, or"
            " leave it out"
        )
