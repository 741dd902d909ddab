"""The curves of a run are the same beside its record and beside a shipped database."""

import numpy as np
import pytest

from calibrator.errors import CalibratorError
from calibrator.runs.curves import (
    POINTS,
    companion,
    curves_of,
    read_companion,
    write_companion,
)
from calibrator.runs.folder import RunFolder
from calibrator.runs.record import Record
from calibrator.runs.request import Request


@pytest.fixture
def run(tmp_path):
    """A folder with the arrays of one hourglass run."""
    folder, record = RunFolder(tmp_path), Record(Request.of("hourglass", seed=1), "ok")
    time = np.linspace(0, 2, 441)
    folder.curves(record.run_id).parent.mkdir()
    np.savez(
        folder.curves(record.run_id),
        time=time,
        passed_mass=np.minimum(time, 1.5) / 100,
        profile_radius=np.linspace(0, 0.01, 13),
        profile_height=np.linspace(0, 0.005, 13),
        filled=np.zeros((9, 3)),
    )
    return folder, record


def test_what_a_run_left_and_what_is_shipped_are_the_same_numbers(run, tmp_path):
    folder, record = run
    here = curves_of(folder, record)
    assert {name: curve.shape for name, curve in here.items()} == {
        "passed_mass": (2, POINTS),
        "profile_height": (2, 13),
    }
    at = here["passed_mass"][0]
    assert here["passed_mass"][1] == pytest.approx(np.minimum(at, 1.5) / 100, abs=1e-6)
    database = tmp_path / "runs.csv"
    write_companion(database, {record.run_id: here})
    first = companion(database).read_bytes()
    there = read_companion(database, [record.run_id, "0" * 16])
    assert list(there) == [record.run_id]
    for name, curve in here.items():
        assert (there[record.run_id][name] == curve).all()
    write_companion(database, there)
    assert companion(database).read_bytes() == first


def test_what_is_missing_is_no_curve_and_what_is_damaged_is_said(run, tmp_path):
    folder, record = run
    assert curves_of(folder, Record(Request.of("hourglass", seed=2), "ok")) == {}
    assert read_companion(tmp_path / "none.csv", [record.run_id]) == {}
    folder.curves(record.run_id).write_bytes(b"no arrays")
    with pytest.raises(CalibratorError, match=r"damaged.*delete it and its record"):
        curves_of(folder, record)
    companion(tmp_path / "runs.csv").write_bytes(b"no arrays")
    with pytest.raises(CalibratorError, match=r"damaged.*restore it"):
        read_companion(tmp_path / "runs.csv", [record.run_id])


def test_columns_that_are_none_of_a_curve_are_refused(run):
    folder, record = run
    np.savez(folder.curves(record.run_id), time=np.arange(3.0), passed_mass=np.arange(4.0))
    with pytest.raises(CalibratorError, match="not those of a curve"):
        curves_of(folder, record)
