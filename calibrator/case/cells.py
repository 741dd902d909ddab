"""Small tables of words and numbers, as spreadsheets, data frames and people write them.

Cells stand between commas, semicolons or tabs, with quotation marks or without; the file is UTF-8
or UTF-16. Nothing is guessed: where a number could mean two things, the line is refused.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from calibrator.errors import CalibratorError, Mistakes, shown
from calibrator.files import read_bytes

SEPARATORS = (",", ";", "\t")
WITH_COMMA = re.compile(r"[+-]?[\d.]*,\d+(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
WITH_POINT = re.compile(r"[+-]?\d*\.\d+(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)

Row = tuple[str, dict[str, str]]
"""The place of a row, as a message names it, and its cells by column."""


def read_rows(
    path: Path, what: str, columns: Sequence[str], optional: Sequence[str] = ()
) -> list[Row]:
    """The rows of a table that are not empty, in the columns' own words.

    Parameters
    ----------
    path : of the table; lines that start with # are notes.
    what : the table is, for messages.
    columns, optional : that it must have, in any order and in capitals or not, and those that it
        may have.

    Raises
    ------
    CalibratorError : with every line that is wrong and what to write instead.
    """
    lines = [
        (i, line)
        for i, line in enumerate(_text(path, what, columns).splitlines(), 1)
        if line.strip() and not line.lstrip(' "').startswith("#")
    ]
    if lines and re.fullmatch('"?sep=.[,;\t"]*', lines[0][1]):  # a spreadsheet's own note
        lines = lines[1:]
    separator, header = _header(path, lines[0][1] if lines else "", columns, optional)
    found, mistakes = [], Mistakes()
    for i, line in lines[1:]:
        with mistakes.noted():
            where = f"{path} line {i}"
            cells = _cells(where, line, separator, header)
            if any(cells.values()):
                found.append((where, cells))
    mistakes.raise_any()
    if separator == ",":
        _refuse_commas(found)
        return found
    return _with_points(found)


def whole(text: str) -> int:
    """A whole number, which a data frame may have written as 8.0; else ValueError."""
    value = float(text)
    if not value.is_integer():
        raise ValueError(f"{shown(text)} is no whole number")
    return int(value)


def _text(path: Path, what: str, columns: Sequence[str]) -> str:
    """The text of a table of at most 1 MB."""
    try:
        raw = read_bytes(path, 1)
        wide = raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        return raw.decode("utf-16" if wide else "utf-8-sig")
    except FileNotFoundError:
        raise CalibratorError(
            f"no {what} {path}: create it with the columns {','.join(columns)}"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        reason = error.reason if isinstance(error, UnicodeDecodeError) else error
        raise CalibratorError(f"cannot read {path} ({reason}): save it as UTF-8 text") from None


def _header(
    path: Path, line: str, columns: Sequence[str], optional: Sequence[str]
) -> tuple[str, list[str]]:
    """The separator, and the names of the columns, "" for one without a name.

    What stands there is not repeated: the file may be none that its owner wants to be shown.
    """
    must = f"the header must be {','.join(columns)}; correct the first line"
    readings = [(separator, _names(line, separator)) for separator in SEPARATORS]
    separator, names = max(readings, key=lambda one: len(set(one[1]) & set(columns)))
    if missing := [name for name in columns if name not in names]:
        lacks = f" lacks {','.join(missing)}:" if len(missing) < len(columns) else ":"
        raise CalibratorError(f"{path}{lacks} {must}")
    for i, name in enumerate(names, 1):
        if name and (name not in {*columns, *optional} or names.count(name) > 1):
            raise CalibratorError(f"{path}: column {i} is one too many: {must}")
    return separator, names


def _names(line: str, separator: str) -> list[str]:
    """The cells of a header, without empty ones at its end."""
    try:
        names = [cell.strip().lower() for cell in _parsed(line, separator)]
    except csv.Error:
        return []
    while names and not names[-1]:
        names.pop()
    return names


def _parsed(line: str, separator: str) -> list[str]:
    # line by line: an open quotation mark must not swallow the next row
    (cells,) = csv.reader([line], delimiter=separator, strict=True, skipinitialspace=True)
    return cells


def _cells(where: str, line: str, separator: str, header: Sequence[str]) -> dict[str, str]:
    """The cells of one line by column."""
    try:
        cells = [cell.strip() for cell in _parsed(line, separator)]
    except (csv.Error, ValueError) as error:
        raise CalibratorError(
            f"{where}: {error}; write plain words and numbers between the separators"
        ) from None
    while len(cells) > len(header) and not cells[-1]:
        cells.pop()
    if len(cells) != len(header):
        raise CalibratorError(
            f"{where}: {len(cells)} cells instead of {len(header)}; fill in"
            f" {','.join(filter(None, header))}, with a point in decimal numbers"
        )
    for i, (name, cell) in enumerate(zip(header, cells, strict=True)):
        if cell and not name and not (i == 0 and cell.isdigit()):  # the index of a data frame
            raise CalibratorError(f"{where}: {shown(cell)} has no heading; take it out")
    return {name: cell for name, cell in zip(header, cells, strict=True) if name}


def _refuse_commas(rows: Iterable[Row]) -> None:
    """Refuse numbers with a comma, of decimals or thousands, where commas separate cells."""
    mistakes = Mistakes()
    for where, cells in rows:
        mistakes.note(
            f"{where}: {shown(cell)} has a comma; write numbers with a decimal point and without"
            " separators of thousands"
            for cell in cells.values()
            if WITH_COMMA.fullmatch(cell)
        )
    mistakes.raise_any()


def _has_point(cell: str) -> bool:
    """Whether a cell is a number with a decimal point, or one of thousands before a comma."""
    return bool(WITH_POINT.fullmatch(cell) or ("." in cell and WITH_COMMA.fullmatch(cell)))


def _with_points(rows: list[Row]) -> list[Row]:
    """The rows with decimal points for decimal commas; where both occur, points are refused."""
    commas = any(WITH_COMMA.fullmatch(cell) for _, cells in rows for cell in cells.values())
    mistakes = Mistakes()
    for where, cells in rows:
        mistakes.note(
            f"{where}: {shown(cell)} has a point where other numbers have decimal commas; write"
            " the number without separators of thousands, and a comma before decimals"
            for cell in cells.values()
            if commas and _has_point(cell)
        )
    mistakes.raise_any()
    return [
        (
            where,
            {n: c.replace(",", ".") if WITH_COMMA.fullmatch(c) else c for n, c in cells.items()},
        )
        for where, cells in rows
    ]
