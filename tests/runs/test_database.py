"""The response database."""

import random

import pytest

from calibrator.errors import CalibratorError
from calibrator.runs.database import Database
from calibrator.runs.record import Record
from calibrator.runs.request import Request


def some_records(count=12):
    rng = random.Random(1)
    records = []
    for i in range(count):
        setup = ("hourglass", "ledge")[i % 2]
        request = Request.of(setup, sliding_friction=rng.uniform(0.1, 0.9), seed=i)
        status = "clogged" if i == 4 else "timeout" if i == 5 else "ok"
        responses = {"bulk_density": rng.uniform(1400, 1600)} if status != "timeout" else {}
        if status == "ok" and setup == "hourglass":
            responses["discharge_time"] = rng.random()
        records.append(
            Record(
                request,
                status,
                responses,
                'it, "stalled"' if status == "timeout" else "",
                {"particles": 7},
            )
        )
    return records


def test_a_database_survives_the_way_to_disk_and_back(tmp_path):
    database = Database(some_records())
    database.write(tmp_path / "d.csv", "made by a test")
    back = Database.read(tmp_path / "d.csv")
    for run_id, record in database.records.items():
        twin = back.records[run_id]
        assert (twin.request, twin.status, twin.responses, twin.error) == (
            record.request,
            record.status,
            record.responses,
            record.error,
        )


def test_the_order_in_which_runs_finish_does_not_change_a_byte(tmp_path):
    records = some_records()
    Database(records).write(tmp_path / "a.csv")
    random.Random(2).shuffle(records)
    Database(records).write(tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_an_edited_row_is_refused_with_its_line(tmp_path):
    Database(some_records()).write(tmp_path / "d.csv")
    lines = (tmp_path / "d.csv").read_text().splitlines()
    cells = lines[3].split(",")
    cells[4] = "0.123"
    (tmp_path / "d.csv").write_text("\n".join([*lines[:3], ",".join(cells), *lines[4:]]) + "\n")
    with pytest.raises(CalibratorError, match="line 4: run id"):
        Database.read(tmp_path / "d.csv")


def test_another_file_is_refused(tmp_path):
    (tmp_path / "d.csv").write_text("a,b\n1,2\n")
    with pytest.raises(CalibratorError, match="not a response database"):
        Database.read(tmp_path / "d.csv")


REQUEST = Request.of("ledge", seed=1)


@pytest.mark.parametrize("error", ["a\rb", "a\nb", 'a "quoted", thing', "\ud800", "\0", "\u2028"])
def test_an_error_of_any_text_survives_the_way_into_a_database_and_back(tmp_path, error):
    Database([Record(REQUEST, "crash", error=error)]).write(tmp_path / "d.csv")
    (back,) = Database.read(tmp_path / "d.csv").records.values()
    assert back.error.isprintable() and back.status == "crash"


def damaged(tmp_path, old, new):
    Database([Record(REQUEST, "ok", {"bulk_density": 1500.0})]).write(tmp_path / "d.csv")
    text = (tmp_path / "d.csv").read_text()
    assert old in text
    (tmp_path / "d.csv").write_text(text.replace(old, new))
    return tmp_path / "d.csv"


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("bulk_density,particles", "bulk_densiti,particles", "did you mean bulk_density"),
        ("bulk_density,particles", "discharge_time,particles", "unknown response of ledge"),
        (",error\n", "\n", "no column error"),
        ("1500.0", "inf", "not finite"),
        ("1500.0", "1500.0,", "line 4: "),
        ("1500.0", '"1500.0', "line 4: "),
    ],
)
def test_a_damaged_database_is_refused_with_its_line(tmp_path, old, new, why):
    with pytest.raises(CalibratorError, match=why):
        Database.read(damaged(tmp_path, old, new))


def test_a_run_that_stands_twice_in_a_database_is_refused(tmp_path):
    path = damaged(tmp_path, "1500.0", "1500.0")
    path.write_text(path.read_text() + path.read_text().splitlines()[-1] + "\n")
    with pytest.raises(CalibratorError, match="stands there twice"):
        Database.read(path)
