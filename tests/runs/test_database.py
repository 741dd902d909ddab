"""The response database."""

import random

import numpy as np
import pytest

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.errors import CalibratorError
from calibrator.responses.table import response_table
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


def test_failed_and_clogged_runs_never_reach_the_interpolation():
    problem = Problem(
        (Parameter("sliding_friction", 0.1, 0.9),), (Target("hourglass", "discharge_time", 1.0),)
    )
    points, values = response_table(
        problem, some_records(), ["hourglass.discharge_time", "ledge.bulk_density"]
    )
    assert len(points) == 10 and np.isfinite(values).sum(axis=1).tolist() == [1] * 10
