"""The response database: one CSV row per finished run, with units and provenance.

Nothing in it depends on timing: the same runs give the same bytes.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

import pandas as pd

from calibrator.case.values import LARGEST, known
from calibrator.case.vocabulary import (
    PARAMETERS,
    RESPONSES,
    SCHEMA,
    SETUPS,
    STATUSES,
    parameters_of,
)
from calibrator.errors import CalibratorError, one_line
from calibrator.files import read_text, write_text
from calibrator.runs.record import Record
from calibrator.runs.request import Request

LEADING = ("run_id", "setup", "status")
TRAILING = ("particles", "steps", "yade", "scripts", "error")


class Database:
    """Finished runs by run id."""

    def __init__(self, records: Iterable[Record] = ()) -> None:
        self.records: dict[str, Record] = {r.run_id: r for r in records}

    def __len__(self) -> int:
        return len(self.records)

    def find(self, requests: Sequence[Request]) -> list[Record]:
        """The records of these requests that exist, in the requests' order."""
        return [self.records[r.run_id] for r in requests if r.run_id in self.records]

    def write(self, path: Path, note: str = "") -> None:
        """Write the CSV atomically, rows sorted by set-up and run id; note : lines of its head."""
        rows = sorted(self.records.values(), key=lambda r: (r.request.setup, r.run_id))
        parameters = [n for n in PARAMETERS if any(n in r.request.parameters for r in rows)]
        responses = [n for n in RESPONSES if any(n in r.responses for r in rows)]
        columns = [*LEADING, *parameters, *responses, *TRAILING]
        frame = pd.DataFrame(
            [_row(r, parameters, responses) for r in rows], columns=columns, dtype=str
        )
        notes = [
            f"response database, schema {SCHEMA}",
            *note.splitlines(),
            _units(parameters, responses),
        ]
        head = "".join(f"# {line}\n" for line in notes)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, head + frame.to_csv(index=False, lineterminator="\n"))

    @classmethod
    def read(cls, path: Path) -> Database:
        """Read a CSV that `write` made.

        Raises CalibratorError, with the line and the remedy, where it is none.
        """
        try:
            lines = read_text(path).splitlines(keepends=True)
        except OSError as error:
            raise CalibratorError(
                f"cannot read the database {path} ({error}): correct the path, or make it with the"
                " verb collect"
            ) from None
        notes = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
        if (
            not lines
            or not lines[0].startswith(f"# response database, schema {SCHEMA}")
            or notes == len(lines)
        ):
            raise CalibratorError(
                f"{path} is not a response database of schema {SCHEMA}: make it anew with"
                " the verb collect"
            )
        rows = csv.reader(io.StringIO("".join(lines[notes:]), newline=""), strict=True)
        database, columns = cls(), None
        try:
            columns = _columns(next(rows))
            for cells in rows:
                record = _record(dict(zip(columns, cells, strict=True)))
                if record.run_id in database.records:
                    raise ValueError(f"run {record.run_id} stands there twice")
                database.records[record.run_id] = record
        except (CalibratorError, ValueError, csv.Error, StopIteration) as error:
            where = f"{path} line {notes + rows.line_num}"
            raise CalibratorError(f"{where}: {error}; restore the file from its source") from None
        return database


def _columns(names: list[str]) -> list[str]:
    """The header, if every column is known and none is missing or given twice; else ValueError."""
    for name in names:
        known(name, (*LEADING, *PARAMETERS, *RESPONSES, *TRAILING), "column")
    missing = [n for n in (*LEADING, *TRAILING) if n not in names]
    if missing or len(set(names)) < len(names):
        raise ValueError(f"no column {missing[0]}" if missing else "a column is given twice")
    return names


def _units(parameters: list[str], responses: list[str]) -> str:
    quantities = [PARAMETERS[n] for n in parameters] + [RESPONSES[n] for n in responses]
    return "units: " + "; ".join(f"{q.name} [{q.unit}]" for q in quantities)


def _row(record: Record, parameters: list[str], responses: list[str]) -> list[str]:
    request = record.request
    return [
        record.run_id,
        request.setup,
        record.status,
        *(_text(request.parameters.get(n)) for n in parameters),
        *(_text(record.responses.get(n)) for n in responses),
        _text(record.diagnostics.get("particles")),
        _text(record.diagnostics.get("steps")),
        _text(record.provenance.get("yade")),
        _text(record.provenance.get("scripts")),
        one_line(record.error),
    ]


def _text(value: object) -> str:
    return "" if value is None else value if isinstance(value, str) else repr(value)


def _record(row: dict[str, str]) -> Record:
    setup = known(row["setup"], SETUPS, "set-up")
    given = {n: _value(n, row[n]) for n in parameters_of(setup) if row.get(n)}
    request = Request.of(setup, **given)
    if request.run_id != row["run_id"]:
        raise ValueError(f"run id {row['run_id']} does not belong to these parameters")
    responses = {
        known(n, _measured_by(setup), f"response of {setup}"): float(row[n])
        for n in RESPONSES
        if row.get(n)
    }
    if not all(abs(value) <= LARGEST for value in responses.values()):
        raise ValueError("a response is not finite")
    diagnostics = {n: int(row[n]) for n in ("particles", "steps") if row[n]}
    provenance = {n: one_line(row[n]) for n in ("yade", "scripts") if row[n]}
    return Record(
        request,
        known(row["status"], STATUSES, "status"),
        responses,
        one_line(row["error"]),
        diagnostics,
        provenance,
    )


def _measured_by(setup: str) -> list[str]:
    return [n for n, quantity in RESPONSES.items() if setup in quantity.setups]


def _value(name: str, text: str) -> float | int | str:
    quantity = PARAMETERS[name]
    if isinstance(quantity.default, str):
        return text
    return int(text) if quantity.unit == "integer" else float(text)
