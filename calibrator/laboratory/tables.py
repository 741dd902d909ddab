"""Two columns of numbers as instruments and people write them, with units, for several repeats.

Cells stand between tabs, semicolons, spaces or commas; decimals have points, or commas where commas
do not separate cells. A heading names the columns. Repeats have a column of their own for the
second quantity, a column that numbers them, or an empty line between them. Nothing is guessed that
changes a value: without a unit, or with two that differ, a table is refused.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np

from calibrator.errors import CalibratorError, Mistakes, shown
from calibrator.files import read_bytes
from calibrator.laboratory.units import Unit, is_unit, number, parts, unit_of

SEPARATORS = ("\t", ";", " ", ",")
NAMES = {"\t": "tabs", ";": "semicolons", " ": "spaces", ",": "commas"}
RUN_WORDS = frozenset(("run", "repeat", "replicate", "series", "test", "versuch", "wiederholung"))
_DATE = r"\d{4}-\d\d-\d\d"
_CLOCK = re.compile(rf"(?:({_DATE})[T ]\s*)?(\d{{1,2}}):(\d\d)(?::(\d\d(?:[.,]\d+)?))?", re.ASCII)
_HEADING = re.compile(r"(.*?)\s*(?:[\[(]\s*(.*?)\s*[\])]|/\s*(\S+)|\sin\s+(\S+)|_([a-zA-Z]\S*))?")


@dataclass(frozen=True)
class Column:
    """A quantity that a table has to have.

    words : by which a heading may name it; si : unit of its kind; unit : that an option gives, ""
    where none does; option : by which it is given.
    """

    name: str
    words: frozenset[str]
    si: str
    unit: str
    option: str


@dataclass(frozen=True)
class Run:
    """One repeat: where it stands, and its two quantities (n,) in SI with the lines they are in."""

    source: str
    lines: np.ndarray
    first: np.ndarray
    second: np.ndarray


@dataclass
class _Table:
    """The rows of numbers of a file: line, block between empty lines, cells."""

    path: Path
    separator: str
    headings: list[list[str]] = field(default_factory=list)
    rows: list[tuple[int, int, list[str]]] = field(default_factory=list)


def read_runs(path: Path, columns: tuple[Column, Column]) -> tuple[list[Run], list[str]]:
    """The repeats of a table of two quantities, and what was converted, in words.

    Raises CalibratorError for a file that is none, for every line that cannot be read, and for
    columns or units that are missing or contradict each other, with what to write.
    """
    table = _read(path)
    where, run_column = _places(table, columns)
    units: dict[int, Unit | None] = {}
    for column, places in zip(columns, where, strict=True):
        for place in places:
            units[place] = _unit(table, column, place)
    runs: list[Run] = []
    for place in where[1]:
        runs += _runs(table, (where[0][0], place), units, run_column)
    named = [
        Run(f"{path.name}, run {i}" if len(runs) > 1 else path.name, r.lines, r.first, r.second)
        for i, r in enumerate(runs, 1)
    ]
    words = {
        f"{path.name}: {column.name} from {unit.converted}": None
        for column, places in zip(columns, where, strict=True)
        if (unit := units[places[0]]) and unit.converted
    }
    return named, list(words)


def _read(path: Path) -> _Table:
    """Headings and rows of a file, whatever stands between its cells."""
    lines = [
        (i, line.strip())
        for i, line in enumerate(_text(path).splitlines(), 1)
        if not line.strip().startswith(("#", "%", "//"))
    ]
    filled = [line for _, line in lines if line]
    good = {s: sum(_is_data(_cells(line, s)) for line in filled) for s in SEPARATORS}
    separator = max(SEPARATORS, key=good.__getitem__)
    if good[separator] < 2:
        raise CalibratorError(
            f"{path}: no table of at least two columns of numbers; write two numbers a line, with"
            " a heading that names them and their units"
        )
    table, block, mistakes = _Table(path, separator), 0, Mistakes()
    for i, line in lines:
        cells = _cells(line, separator)
        if not line:
            block += 1
        elif _is_data(cells):
            table.rows.append((i, block, cells))
        elif not table.rows and not (table.headings and any(map(_parsed, cells))):
            table.headings.append(cells)
        elif cells not in table.headings:  # it may be repeated above each repeat
            mistakes.note([f"{path} line {i}: {shown(line)} is no row of numbers; {_ROW}"])
    widths = [len(cells) for _, _, cells in table.rows]
    usual = max(set(widths), key=widths.count)
    mistakes.note(
        f"{path} line {i}: {len(cells)} cells between {NAMES[separator]} instead of {usual}; {_ROW}"
        for i, _, cells in table.rows
        if len(cells) != usual
    )
    mistakes.raise_any()
    return table


_ROW = "correct the line, or delete it where the reading was spoiled"


def _text(path: Path) -> str:
    """The text of a file of at most 64 MB; instruments write many encodings."""
    try:
        raw = read_bytes(path, 64)
    except FileNotFoundError:
        raise CalibratorError(f"no file {path}: correct its name") from None
    except OSError as error:
        raise CalibratorError(f"cannot read {path} ({error}): give a file of text") from None
    if b"\0" in raw and not raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise CalibratorError(f"{path} is no text: export the table as CSV")
    wide = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):
        try:
            return raw.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise CalibratorError(f"{path} is no text: export the table as UTF-8")


def _cells(line: str, separator: str) -> list[str]:
    """The cells of a line; a unit or a date that a space separates belongs to its number."""
    if separator != " ":
        cells = [cell.strip().strip('"').strip() for cell in line.split(separator)]
        while cells and not cells[-1]:
            cells.pop()
        return cells
    found: list[str] = []
    for word in line.replace('"', " ").split():
        after = found and (
            re.match(r"[\[(]", word)
            or (re.match(r"[+-]?[\d.,]+$", found[-1]) and is_unit(word) and not word[0].isdigit())
            or (re.fullmatch(_DATE, found[-1]) and _CLOCK.fullmatch(word))
        )
        if after:
            found[-1] += f" {word}"
        else:
            found.append(word)
    return found


def _is_data(cells: Sequence[str]) -> bool:
    """Whether these are the cells of a row of at least two numbers."""
    return len(cells) >= 2 and all(_parsed(cell) for cell in cells)


def _parsed(cell: str) -> tuple[float, str] | None:
    """Number and unit of a cell, seconds for a time of day; None for anything else."""
    if clock := _CLOCK.fullmatch(cell):
        date, hours, minutes, seconds = clock.groups()
        day = datetime.fromisoformat(date).toordinal() * 86400.0 if date else 0.0
        return day + 3600 * int(hours) + 60 * int(minutes) + number(seconds or "0"), "s"
    try:
        value, unit = parts(cell)
    except ValueError:
        return None
    return None if unit and not is_unit(unit) else (value, unit)


def _heading(cell: str) -> tuple[set[str], str]:
    """Words and unit of a heading, such as Mass [g], t/s or mass_g; "" where it has no unit."""
    found = _HEADING.fullmatch(cell.strip())
    name, unit = cell, ""
    if found and (given := next((g for g in found.groups()[1:] if g), "")):
        bracketed = found[2] is not None
        if bracketed or (is_unit(given) and not given.isdigit()):
            name, unit = found[1], given
    words = {re.sub(r"\d+$", "", w) for w in re.split(r"[\W_]+", name.lower())}
    return words - {""}, unit


def _places(
    table: _Table, columns: tuple[Column, Column]
) -> tuple[tuple[list[int], list[int]], int | None]:
    """Where the two quantities stand, and the column that numbers repeats, if there is one."""
    width = len(table.rows[0][2])
    names = next((h for h in table.headings if len(h) == width and not _all_units(h)), None)
    if names is None:
        if width == 2:
            return ([0], [1]), None
        raise CalibratorError(
            f"{table.path}: {width} columns without a heading; name them in the first line, as in"
            f" {columns[0].name} [{columns[0].si}], {columns[1].name} [{columns[1].si}]"
        )
    words = [_heading(cell)[0] for cell in names]
    where = [[i for i, one in enumerate(words) if one & c.words] for c in columns]
    where[1] = [i for i in where[1] if i not in where[0][:1]]
    for column, places in zip(columns, where, strict=True):
        if not places:
            raise CalibratorError(
                f"{table.path}: no column for the {column.name} among"
                f" {', '.join(map(shown, names))}; call it {column.name}"
            )
    run = next((i for i, one in enumerate(words) if one & RUN_WORDS), None)
    return (where[0], where[1]), run


def _all_units(cells: Sequence[str]) -> bool:
    """Whether a heading holds units only: a second line below the names."""
    return any(cells) and all(not cell or is_unit(cell) for cell in cells)


def _unit(table: _Table, column: Column, place: int) -> Unit:
    """The unit of a column, from its heading, the line below, its cells or the option."""
    told: dict[str, str] = {}
    for cells in table.headings:
        if place < len(cells):
            unit = cells[place] if _all_units(cells) else _heading(cells[place])[1]
            if unit and ":" not in unit:  # hh:mm:ss says how a time is written
                told.setdefault(unit, "its heading")
    for i, _, cells in table.rows:
        parsed = _parsed(cells[place])
        if parsed and parsed[1]:
            told.setdefault(parsed[1], f"line {i}")
    if column.unit:
        told.setdefault(column.unit, column.option)
    what = f"{table.path}: {column.name}"
    units = {unit_of(text, what, column.si): origin for text, origin in told.items()}
    if not units:
        raise CalibratorError(
            f"{what} has no unit; write it into the heading, {column.name} [{column.si}], or give"
            f" {column.option}"
        )
    if len({unit.factor for unit in units}) > 1:
        said = " but ".join(f"{unit.written} in {origin}" for unit, origin in units.items())
        raise CalibratorError(f"{what} is in {said}; correct the one that is wrong")
    return next(iter(units))


def _runs(
    table: _Table, places: tuple[int, int], units: dict[int, Unit | None], run: int | None
) -> list[Run]:
    """The repeats in two columns: as they are numbered, else as empty lines separate them."""
    groups: list[list[tuple[int, float, float]]] = []
    last: tuple[object, float] | None = None
    for line, block, cells in table.rows:
        pair = [_in_si(cells[place], units[place]) for place in places]
        mark: object = block if run is None else cells[run]
        fresh = last is None or (
            mark != last[0] and (run is not None or _restarts(groups[-1], pair))
        )
        if fresh:
            groups.append([])
        groups[-1].append((line, pair[0], pair[1]))
        last = (mark, pair[0])
    arrays = [np.array(group).T for group in groups]
    return [Run("", lines.astype(int), first, second) for lines, first, second in arrays]


def _restarts(group: list[tuple[int, float, float]], pair: Sequence[float]) -> bool:
    """Whether the first quantity does not go on from a block in the direction that it had."""
    forwards = group[-1][1] >= group[0][1]
    return pair[0] <= group[-1][1] if forwards else pair[0] >= group[-1][1]


def _in_si(cell: str, unit: Unit | None) -> float:
    """The value of a cell in SI."""
    parsed = _parsed(cell)
    assert parsed is not None and unit is not None
    return parsed[0] * unit.factor
