"""Records: what a run left behind, believed only if it is complete and answers the request exactly."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from calibrator.quantities import DIAGNOSTICS, RESPONSES, SCHEMA, STATUSES
from calibrator.table import Request

KEYS = {"schema", "setup", "run_id", "parameters", "status", "responses", "error", "diagnostics", "provenance"}
OPTIONAL = {"traceback"}


class InvalidRecord(ValueError):
    """A record that must not be believed; the message says why."""


@dataclass(frozen=True)
class Record:
    """One finished run. responses is empty unless the status is ok (a clogged run keeps its filled density)."""

    request: Request
    status: str
    responses: dict[str, float] = field(default_factory=dict)
    error: str = ""
    diagnostics: dict[str, Any] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)

    @property
    def run_id(self) -> str:
        """The run id of the request."""
        return self.request.run_id


def read_record(path: Path, request: Request) -> Record:
    """Read the record of a request.

    Raises FileNotFoundError where there is none, InvalidRecord where it is damaged, of another schema version, has
    unknown keys, or echoes other parameters than were asked for.
    """
    try:
        raw = json.loads(path.read_text(), parse_constant=_refuse_constant)
    except FileNotFoundError:
        raise
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise InvalidRecord(f"not readable as JSON: {error}") from None
    _check_shape(raw)
    _check_echo(raw, request)
    responses = {_known_response(n, request.setup): _finite(n, v) for n, v in raw["responses"].items()}
    return Record(request, raw["status"], responses, raw["error"] or "", raw["diagnostics"], raw["provenance"])


def _refuse_constant(text: str) -> float:
    raise ValueError(f"{text} is not a number")


def _check_shape(raw: Any) -> None:
    if not isinstance(raw, dict):
        raise InvalidRecord("not a JSON object")
    missing, unknown = KEYS - set(raw), set(raw) - KEYS - OPTIONAL
    if missing or unknown:
        raise InvalidRecord(f"missing keys {sorted(missing)}, unknown keys {sorted(unknown)}")
    if raw["schema"] != SCHEMA:
        raise InvalidRecord(f"schema version {raw['schema']!r} instead of {SCHEMA}")
    if raw["status"] not in STATUSES:
        raise InvalidRecord(f"unknown status {raw['status']!r}")
    for key in ("parameters", "responses", "diagnostics", "provenance"):
        if not isinstance(raw[key], dict):
            raise InvalidRecord(f"{key} is not an object")
    unknown = set(raw["diagnostics"]) - set(DIAGNOSTICS)
    if unknown:
        raise InvalidRecord(f"unknown diagnostics {sorted(unknown)}")


def _check_echo(raw: dict[str, Any], request: Request) -> None:
    if raw["setup"] != request.setup or raw["run_id"] != request.run_id:
        raise InvalidRecord(f"answers run {raw['run_id']!r} of {raw['setup']!r}, not the one asked for")
    if raw["parameters"] != request.parameters:
        names = set(raw["parameters"]) | set(request.parameters)
        wrong = sorted(n for n in names if raw["parameters"].get(n) != request.parameters.get(n))
        raise InvalidRecord(f"was run with another value of {', '.join(wrong)} than asked for")


def _known_response(name: str, setup: str) -> str:
    if name not in RESPONSES or setup not in RESPONSES[name].setups:
        raise InvalidRecord(f"unknown response {name!r}")
    return name


def _finite(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InvalidRecord(f"response {name} = {value!r} is not a finite number")
    return float(value)
