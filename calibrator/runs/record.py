"""Records: what a run left, believed only if it is complete and answers the request exactly."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from calibrator.case.values import LARGEST, is_number
from calibrator.case.vocabulary import DIAGNOSTICS, RESPONSES, SCHEMA, STATUSES
from calibrator.errors import one_line, shown
from calibrator.files import parse_json, read_text
from calibrator.runs.request import Request

KEYS = {
    "schema",
    "setup",
    "run_id",
    "parameters",
    "status",
    "responses",
    "error",
    "diagnostics",
    "provenance",
}
OPTIONAL = {"traceback", "seal"}  # records from before there were seals have none
TEXTS, NUMBERS = {"yade", "scripts", "host", "resumed"}, {"started", "wall_time"}
"""What the provenance may hold."""

COUNTS = {"particles", "particles_left", "steps"}
"""Diagnostics that are whole numbers."""

Noted = Mapping[str, float | int | str]
"""Diagnostics and provenance: a number or one line of text by name."""


class InvalidRecord(ValueError):
    """A record that must not be believed; the message, one line, says why."""

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


@dataclass(frozen=True)
class Record:
    """One finished run.

    Attributes
    ----------
    responses : by name, in SI units unless the name says otherwise; empty unless the status is ok
        (a clogged run keeps its filled density). error : one line, empty where the run ended well.
    """

    request: Request
    status: str
    responses: dict[str, float] = field(default_factory=dict)
    error: str = ""
    diagnostics: Noted = field(default_factory=dict)
    provenance: Noted = field(default_factory=dict)

    @property
    def run_id(self) -> str:
        """The run id of the request."""
        return self.request.run_id


def read_record(path: Path, request: Request) -> Record:
    """Read the record of a request.

    Raises FileNotFoundError where there is none, InvalidRecord where it is damaged, of another
    schema version, has unknown keys, or echoes other parameters than were asked for.
    """
    try:
        raw = parse_json(read_text(path, 16, links=False))
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:
        raise InvalidRecord(f"not readable as JSON: {error}") from None
    _check_shape(raw)
    _check_echo(raw, request)
    _check_seal(raw)
    responses = {
        _known_response(n, request.setup): _finite(n, v) for n, v in raw["responses"].items()
    }
    return Record(
        request,
        raw["status"],
        responses,
        one_line(raw["error"] or ""),
        raw["diagnostics"],
        raw["provenance"],
    )


def _check_shape(raw: Any) -> None:
    if not isinstance(raw, dict):
        raise InvalidRecord("not a JSON object")
    missing, unknown = KEYS - set(raw), set(raw) - KEYS - OPTIONAL
    if missing or unknown:
        raise InvalidRecord(f"missing keys {sorted(missing)}, unknown keys {sorted(unknown)}")
    if raw["schema"] != SCHEMA or isinstance(raw["schema"], bool):
        raise InvalidRecord(f"schema version {shown(raw['schema'])} instead of {SCHEMA}")
    if not isinstance(raw["status"], str) or raw["status"] not in STATUSES:
        raise InvalidRecord(f"unknown status {shown(raw['status'])}")
    if not isinstance(raw["error"], str | None):
        raise InvalidRecord("error is not a text")
    for key in ("parameters", "responses", "diagnostics", "provenance"):
        if not isinstance(raw[key], dict):
            raise InvalidRecord(f"{key} is not an object")
    unknown = set(raw["diagnostics"]) - set(DIAGNOSTICS)
    if unknown:
        raise InvalidRecord(f"unknown diagnostics {sorted(unknown)}")
    texts = {n for n, unit in DIAGNOSTICS.items() if unit == "text"}
    _check_values("diagnostics", raw["diagnostics"], texts, set(DIAGNOSTICS) - texts)
    _check_values("provenance", raw["provenance"], TEXTS, NUMBERS)


def _check_values(section: str, given: dict[str, Any], texts: set[str], numbers: set[str]) -> None:
    """Whatever follows computes with the numbers and writes the texts into lines of CSV."""
    for name, value in given.items():
        if name in texts and not (isinstance(value, str) and value.isprintable()):
            raise InvalidRecord(f"{section}.{name} is not one line of text")
        if name in numbers and not (is_number(value) and abs(value) <= LARGEST):
            raise InvalidRecord(f"{section}.{name} = {shown(value)} is not a number")
        if name in COUNTS and not isinstance(value, int):
            raise InvalidRecord(f"{section}.{name} = {shown(value)} is not a whole number")


def _check_echo(raw: dict[str, Any], request: Request) -> None:
    if raw["setup"] != request.setup or raw["run_id"] != request.run_id:
        raise InvalidRecord(
            f"answers run {shown(raw['run_id'])} of {shown(raw['setup'])}, not the one asked for"
        )
    echo, asked = raw["parameters"], request.parameters
    # A parameter that was not asked for is wrong also where it is null, and Python's True equals 1,
    # a record's does not.
    wrong = sorted(
        echo.keys() ^ asked.keys()
        | {n for n in echo if echo[n] != asked.get(n) or isinstance(echo[n], bool)}
    )
    if wrong:
        raise InvalidRecord(f"was run with another value of {', '.join(wrong)} than asked for")


def _check_seal(raw: dict[str, Any]) -> None:
    if "seal" not in raw:
        return
    try:
        rest = json.dumps(
            {key: value for key, value in raw.items() if key != "seal"}, sort_keys=True
        )
    except RecursionError:
        raise InvalidRecord("nested too deeply") from None
    if raw["seal"] != hashlib.sha256(rest.encode()).hexdigest()[:16]:
        raise InvalidRecord("was changed after the run: its seal does not fit")


def _known_response(name: str, setup: str) -> str:
    if name not in RESPONSES or setup not in RESPONSES[name].setups:
        raise InvalidRecord(f"unknown response {name!r}")
    return name


def _finite(name: str, value: Any) -> float:
    if not is_number(value) or abs(value) > LARGEST:
        raise InvalidRecord(f"response {name} = {shown(value)} is not a finite number")
    return float(value)
