"""Generators of bad input: good files with a few changes, or bytes without any sense.

A change is another type, NaN, a huge number, a missing or doubled line, flipped bits, another
encoding, or a path that leads away. Drawn by hypothesis.
"""

import codecs
import copy
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
from hypothesis import strategies as st

WORDS = [
    "", " ", "nan", "-inf", "inf", "1e999", "1e308", "-1", "0", "-0.0", "5e-324", "1_000", "0x10",
    "True", "None", "٣", "1" * 5000, "9" * 400, "x" * 5000, "\0", "\x1b[2J", "a\nb", "a\r\nb",
    "\u2028", "\ufeff", "é", "漢字", "../../../../etc/passwd", "/etc/passwd", "/dev/zero", "pipe",
    "loop", "away", "zero", "folder", ".", "..", "../..", "~", "=1+1", '"', "'", '"""', ",",
    ",,,,,,,", "#", "\\", "hourglass", "rolling_friction", "epsd2'", "seed", "name", "__class__",
]  # fmt: skip
TOML_VALUES = [
    "nan", "-inf", "inf", "1e999", "1e308", "-1", "0", "2", "0.5", "-0.0", "5e-324", "true",
    "false", '""', "''", "[]", "{}", "[1]", '["error"]', '["error", "error"]', '["a\\nb"]',
    '"\\u0000"', '"\\n"', "1979-05-27", "07:32:00", "9" * 19, "9" * 400, "9" * 5000,
    "0x" + "f" * 5000, "[" * 500 + "]" * 500, "[" * 5 + "]" * 5, "{a = {a = {a = {}}}}", "1e-300",
    "9223372036854775807", "99999999", "2_000_000", '"grid"', '"adaptive"', '"log"',
    '"multilinear"', '"runs.csv"', '"../grid/runs.csv"', '"../grid/../../secret.csv"',
    '"../../secret.csv"', '"/etc/passwd"', '"/dev/zero"', '"pipe"', '"loop"', '"away"', '"zero"',
    '"folder"', '"."', '".."', '"lab.csv\\n"',
]  # fmt: skip
JSON_VALUES: list[Any] = [
    None, True, False, 0, 1, -1, 0.5, 1e308, float("nan"), float("inf"), -float("inf"), 10**400,
    -(10**400), 2**63, "", "ok", "crash", "x" * 3000, "\0", "\ud800", "a\nb", "\u2028", "é", [], {},
    [[]], [None], {"": {}}, {"kind": "crash"}, [1e999], "hourglass",
]  # fmt: skip
CHANGES = ("flip", "cut", "drop", "double", "insert", "end", "line", "lines", "code")


@st.composite
def damaged_bytes(draw: Any, bases: list[bytes], words: list[str]) -> bytes:
    """A good file with one to three changes, sometimes in another encoding, or senseless bytes."""
    if draw(st.integers(0, 19)) == 0:
        return draw(st.binary(max_size=200))
    data = draw(st.sampled_from(bases))
    for _ in range(draw(st.integers(1, 3))):
        data = changed(
            data,
            draw(st.sampled_from(CHANGES)),
            draw(st.integers(0, 2**20)),
            draw(st.sampled_from(words)),
        )
    return recoded(data, draw(st.integers(0, 29)))


def changed(data: bytes, change: str, place: int, word: str) -> bytes:
    """One change of a file. `place` says where, modulo the length."""
    at, new = place % (len(data) + 1), word.encode("utf-8", "surrogatepass")
    lines = data.split(b"\n")
    row = place % len(lines)
    if change == "flip" and at < len(data):
        return data[:at] + bytes([data[at] ^ (1 << place % 8)]) + data[at + 1 :]
    if change == "cut":
        return data[:at]
    if change == "drop":
        return b"\n".join(lines[:row] + lines[row + 1 :])
    if change == "double":
        return b"\n".join(lines[: row + 1] + lines[row:])
    if change == "insert":
        return data[:at] + new + data[at:]
    if change == "end":
        return data + new
    for separator in (b" = ", b",", b": "):  # another value of a key, another cell of a row
        if separator in lines[row]:
            cells = lines[row].split(separator)
            cells[place % len(cells) if separator == b"," else -1] = new
            return b"\n".join([*lines[:row], separator.join(cells), *lines[row + 1 :]])
    return b"\n".join([*lines[:row], new, *lines[row + 1 :]])


def recoded(data: bytes, how: int) -> bytes:
    """The file as another editor would save it."""
    if how == 0:
        return codecs.BOM_UTF8 + data
    if how == 1:
        return data.replace(b"\n", b"\r\n")
    if how == 2:
        return data.decode("utf-8", "replace").encode("utf-16")
    if how == 3:
        return data.decode("utf-8", "replace").encode("latin-1", "replace") + b"\xe9"
    return data


@st.composite
def damaged_json(draw: Any, bases: list[Any], words: list[str]) -> bytes:
    """JSON with one to three values, keys or branches replaced, or damaged bytes of it."""
    whole = draw(st.sampled_from(bases))
    if draw(st.integers(0, 3)) == 0:
        return draw(damaged_bytes([json.dumps(whole, indent=1).encode()], words))
    whole = json.loads(json.dumps(whole))
    for _ in range(draw(st.integers(1, 3))):
        new = draw(st.sampled_from(JSON_VALUES) | st.sampled_from(words))
        new = copy.deepcopy(new)
        whole = json_changed(
            whole,
            draw(st.sampled_from(("value", "key", "gone", "more"))),
            draw(st.integers(0, 2**20)),
            new,
        )
    text = json.dumps(whole, indent=draw(st.sampled_from([None, 1])))
    return text.encode()


def json_changed(whole: Any, change: str, place: int, new: Any) -> Any:
    """One change of a JSON tree; `place` picks the branch."""
    spots = list(_spots(whole))
    if not spots:
        return new
    branch, key = spots[place % len(spots)]
    if change == "gone":
        del branch[key]
    elif change == "more" and isinstance(branch, dict):
        branch[str(new)[:50]] = new
    elif change == "key" and isinstance(branch, dict):
        branch[str(new)[:50]] = branch.pop(key)
    else:
        branch[key] = new
    return whole


def _spots(value: Any) -> Iterator[tuple[Any, Any]]:
    for key, inner in list(
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    ):
        yield value, key
        yield from _spots(inner)


VALUES = st.one_of(
    st.sampled_from(
        [*JSON_VALUES, 10**5000, b"1", 1j, (1,), object, np.float64(0.3), np.int64(3), range(3)]
    ),
    st.floats(),
    st.integers(),
    st.text(max_size=20),
    st.sampled_from(WORDS),
)
