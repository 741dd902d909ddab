"""The defaults in docs/case_file.md, as the code has them.

`python -m calibrator.case.reference docs/case_file.md` writes them into the page; its words are
written by hand.
"""

from __future__ import annotations

import dataclasses
import re
import sys
from pathlib import Path
from typing import Any

from calibrator.case.curve import MeasuredCurve
from calibrator.case.problem import Parameter, Target
from calibrator.case.settings import Diagnosis
from calibrator.case.toml import CURVE_OPTIONS, SECTIONS, TARGET_OPTIONS
from calibrator.errors import CalibratorError

ALL = "all"
"""Printed for a list that names every effect unless it is given."""


def keys_of(section: str) -> dict[str, str]:
    """{key: default as it is printed} of a table of the case file, in the code's order."""
    cls = {**SECTIONS, "parameters": Parameter, "targets": Target}[section]
    keys = {f.name: _printed(f) for f in dataclasses.fields(cls)}
    if section == "targets":
        keys |= {f.name: _printed(f) for f in dataclasses.fields(MeasuredCurve)}
        return {key: keys[key] for key in (*TARGET_OPTIONS, *CURVE_OPTIONS)}
    if section == "parameters":
        keys.pop("name")  # it is the heading
    return keys


def _printed(field: dataclasses.Field[Any]) -> str:
    """The default of a field, or what is said where it has none."""
    if field.default is dataclasses.MISSING:
        return "required" if field.default_factory is dataclasses.MISSING else "none"
    default = field.default
    if isinstance(default, tuple):
        return ALL if default == Diagnosis.effects else ", ".join(default) or "none"
    if isinstance(default, float):
        return f"{default:g}"
    return str(default).lower() or "none"


def renewed(page: str) -> str:
    """The page with the defaults of the code in the second column of its tables.

    Raises CalibratorError for a key of the code that the page lacks, and one that is not the
    code's.
    """
    parts = re.split("^(?=## )", page, flags=re.MULTILINE)
    for i, part in enumerate(parts):
        heading = re.search(r"`\[(\w+)[].]", part.splitlines()[0])
        if heading and heading[1] in {*SECTIONS, "parameters", "targets"}:
            parts[i] = _renewed_section(part, heading[1])
    return "".join(parts)


def _renewed_section(part: str, section: str) -> str:
    keys, lines, seen = keys_of(section), part.splitlines(keepends=True), []
    for i, line in enumerate(lines):
        if not line.startswith("| `"):
            continue
        cells = line.split("|")
        names = re.findall("`(.+?)`", cells[1])
        if unknown := [name for name in names if name not in keys]:
            raise CalibratorError(f"[{section}] has no key {unknown[0]}: take its row out")
        seen += names
        cells[2] = f" {', '.join(dict.fromkeys(keys[name] for name in names))} "
        lines[i] = "|".join(cells)
    if missing := [key for key in keys if key not in seen]:
        raise CalibratorError(f"[{section}] has a key {missing[0]}: give it a row with its meaning")
    return "".join(lines)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        Path(name).write_text(renewed(Path(name).read_text()))
