"""From a TOML table to a dataclass: unknown keys and wrong types are refused."""

from __future__ import annotations

import dataclasses
from typing import Any

from calibrator.case.problem import known
from calibrator.errors import CalibratorError, shown


def build(cls: type, table: Any, where: str) -> Any:
    """Make a settings dataclass from a TOML table; unknown keys and wrong types are refused."""
    if not isinstance(table, dict):
        raise CalibratorError(f"{where} must be a table: write [{where}] on a line of its own")
    fields = {f.name: f for f in dataclasses.fields(cls)}
    values = {}
    for key, value in table.items():
        known(key, fields, f"key in [{where}]")
        values[key] = typed(f"{where}.{key}", str(fields[key].type), value)
    try:
        return cls(**values)
    except TypeError as error:
        raise CalibratorError(f"[{where}] is incomplete ({error}): add the missing key") from None


def typed(where: str, annotation: str, value: Any) -> Any:
    if (
        annotation == "tuple[str, ...]"
        and isinstance(value, list)
        and all(isinstance(v, str) for v in value)
    ):
        return tuple(value)
    if annotation == "float" and isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    if annotation == "dict[str, float]" and isinstance(value, dict):
        return {name: typed(f"{where}.{name}", "float", one) for name, one in value.items()}
    if annotation == "int" and isinstance(value, int) and not isinstance(value, bool):
        return value
    if annotation == "bool" and isinstance(value, bool):
        return value
    if annotation == "str" and isinstance(value, str):
        return value
    raise CalibratorError(f"{where} = {shown(value)}: give a value of type {annotation}")
