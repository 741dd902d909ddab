"""Values from and to plain data: one codec for the tables of a case file and for what verbs note.

A dataclass is read from, and written as, a table of its fields; its annotations say what may stand
there. The same annotations give the JSON schema of what is written. A class may name properties in
DERIVED: they are written too, so that a script need not know how to compute them.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import types
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from calibrator.case.values import known
from calibrator.errors import CalibratorError, Mistakes, shown

T = TypeVar("T")
Table = dict[str, Any]
"""A table of a TOML file, or an object of JSON: values by key."""


def plain(value: Any) -> Any:
    """A value as JSON has it: dataclasses as objects, tuples and arrays as lists.

    A field whose metadata say `unmentioned` is left out at its default, so that what was written
    before there was such a field is still the same. An array's NaN becomes null, as JSON has none.
    Raises ValueError for a number that is not finite
    outside an array: there, whoever makes the value says None.

    >>> plain({"box": (0.5, np.array([1.0, np.nan]))})
    {'box': [0.5, [1.0, None]]}
    """
    if dataclasses.is_dataclass(value):
        names = [f.name for f in dataclasses.fields(value) if not _silent(f, value)]
        return {name: plain(getattr(value, name)) for name in (*names, *_derived(type(value)))}
    if isinstance(value, np.ndarray):
        return _listed(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, (tuple, list)):
        return [plain(one) for one in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{value} is no number in JSON")
    return str(value) if isinstance(value, Path) else value


def _silent(field: dataclasses.Field[Any], value: Any) -> bool:
    """Whether a field of a value is left out: at its default, and unmentioned there."""
    return "unmentioned" in field.metadata and getattr(value, field.name) == field.default


def _derived(cls: type) -> tuple[str, ...]:
    """Properties that are written beside the fields, for scripts, and not read back: DERIVED."""
    return getattr(cls, "DERIVED", ())


def _listed(value: Any) -> Any:
    """Nested lists of an array, with None for what is not finite."""
    if isinstance(value, list):
        return [_listed(one) for one in value]
    return value if not isinstance(value, float) or math.isfinite(value) else None


def finite(value: float) -> float | None:
    """The number, or None where it is infinite or not a number: JSON has neither."""
    return float(value) if math.isfinite(value) else None


def build(cls: type[T], table: Any, where: str) -> T:
    """A dataclass made from a table of its fields.

    Raises CalibratorError, with the key and what to write instead, for all unknown keys and values
    of another type; else for missing keys, and for whatever the dataclass itself refuses.

    >>> @dataclasses.dataclass
    ... class Vessel:
    ...     width: float
    ...     walls: tuple[str, ...] = ()
    >>> build(Vessel, {"width": 1, "walls": ["left"]}, "vessel")
    Vessel(width=1.0, walls=('left',))
    """
    table = as_table(table, where)
    kinds: Table = _kinds(cls)  # type: ignore[arg-type]
    values, mistakes = {}, Mistakes()
    for key, value in table.items():
        if key in _derived(cls):
            continue
        with mistakes.noted():
            kind = kinds[known(key, kinds, f"key in [{where}]")]
            values[key] = typed(f"{where}.{key}", kind, value)
    mistakes.raise_any()
    try:
        return cls(**values)
    except TypeError as error:
        raise CalibratorError(f"[{where}] is incomplete ({error}): add the missing key") from None


def as_table(value: Any, where: str) -> Table:
    """The value if it is a table, else CalibratorError."""
    if not isinstance(value, dict):
        raise CalibratorError(f"{where} must be a table: write [{where}] on a line of its own")
    return value


@functools.cache
def _kinds(cls: type) -> Table:
    """Type of each field."""
    hints = typing.get_type_hints(cls)
    return {f.name: hints[f.name] for f in dataclasses.fields(cls)}


def typed(where: str, kind: Any, value: Any) -> Any:
    """The value as a field of this type holds it.

    Raises CalibratorError where it is none.
    """
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (types.UnionType, typing.Union):
        return _one_of(where, inner, value)
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return build(kind, value, where)
    if origin is tuple and isinstance(value, list):
        return _tuple(where, kind, inner, value)
    if origin is dict and isinstance(value, dict):
        return {name: typed(f"{where}.{name}", inner[1], one) for name, one in value.items()}
    if kind is np.ndarray and isinstance(value, list):
        return _array(where, value)
    if read := SCALARS.get(kind):
        accepts, convert = read
        if accepts(value):
            return convert(value)
    raise CalibratorError(f"{where} = {shown(value)}: give a value of type {_name(kind)}")


def _whole(value: Any) -> bool:
    """Whether a value is an integer; True and False are none."""
    return isinstance(value, int) and not isinstance(value, bool)


SCALARS: dict[Any, tuple[Callable[[Any], bool], Callable[[Any], Any]]] = {
    float: (lambda value: _whole(value) or isinstance(value, float), float),
    int: (_whole, int),
    bool: (lambda value: isinstance(value, bool), bool),
    str: (lambda value: isinstance(value, str), str),
    types.NoneType: (lambda value: value is None, lambda value: None),
    Path: (lambda value: isinstance(value, str), Path),
    Any: (lambda value: True, lambda value: value),
}


def _one_of(where: str, kinds: tuple[Any, ...], value: Any) -> Any:
    """The value as the first of these types that takes it; an integer before it becomes a float."""
    for kind in sorted(kinds, key=lambda k: k is not int):
        try:
            return typed(where, kind, value)
        except CalibratorError:
            continue
    names = " or ".join(_name(kind) for kind in kinds)
    raise CalibratorError(f"{where} = {shown(value)}: give a value of type {names}")


def _tuple(where: str, kind: Any, inner: tuple[Any, ...], value: list[Any]) -> tuple[Any, ...]:
    """The list as a tuple of these types, the last of which may be an ellipsis."""
    if len(inner) == 2 and inner[1] is Ellipsis:
        inner = (inner[0],) * len(value)
    if len(inner) != len(value):
        raise CalibratorError(f"{where} = {shown(value)}: give a value of type {_name(kind)}")
    try:
        return tuple(typed(where, k, one) for k, one in zip(inner, value, strict=True))
    except CalibratorError:
        if any(dataclasses.is_dataclass(k) for k in inner):
            raise
        raise CalibratorError(
            f"{where} = {shown(value)}: give a value of type {_name(kind)}"
        ) from None


def _array(where: str, value: list[Any]) -> np.ndarray:
    """The nested lists as an array; null becomes NaN."""
    try:
        return np.array(value, float)  # null becomes NaN
    except (TypeError, ValueError):
        raise CalibratorError(f"{where}: give an array of numbers") from None


def _name(kind: Any) -> str:
    """A type as a message names it."""
    return kind.__name__ if isinstance(kind, type) and not typing.get_args(kind) else str(kind)


def schema_of(kind: Any) -> Table:
    """JSON schema (draft 2020-12) of what `plain` writes for a value of this type."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        kinds = dict(_kinds(kind))  # type: ignore[arg-type]
        for name in _derived(kind):  # type: ignore[arg-type]
            kinds[name] = typing.get_type_hints(getattr(kind, name).fget)["return"]
        silent = {f.name for f in dataclasses.fields(kind) if "unmentioned" in f.metadata}
        return {
            "type": "object",
            "description": " ".join((kind.__doc__ or "").split()),
            "properties": {name: schema_of(one) for name, one in kinds.items()},
            "required": [name for name in kinds if name not in silent],
            "additionalProperties": False,
        }
    if origin in (types.UnionType, typing.Union):
        return {"anyOf": [schema_of(one) for one in inner]}
    if origin is tuple:
        if len(inner) == 2 and inner[1] is Ellipsis:
            return {"type": "array", "items": schema_of(inner[0])}
        count, places = len(inner), [schema_of(one) for one in inner]
        return {"type": "array", "prefixItems": places, "items": False, "minItems": count}
    if origin is dict:
        return {"type": "object", "additionalProperties": schema_of(inner[1])}
    return dict(_SCHEMAS[kind])


_SCHEMAS: dict[Any, Table] = {
    float: {"type": "number"},
    int: {"type": "integer"},
    bool: {"type": "boolean"},
    str: {"type": "string"},
    types.NoneType: {"type": "null"},
    Path: {"type": "string"},
    np.ndarray: {"type": "array", "description": "nested lists of numbers, null for none"},
    Any: {},
}
