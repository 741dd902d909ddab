"""Tables as instruments write them, and units that are missing or contradict each other."""

import numpy as np
import pytest

from calibrator.errors import CalibratorError
from calibrator.laboratory.tables import Column, read_runs

TIME, MASS = frozenset(("time", "t", "zeit")), frozenset(("mass", "m", "gewicht"))


def columns(time="", mass=""):
    return Column("time", TIME, "s", time, "--time-unit"), Column(
        "mass", MASS, "kg", mass, "--mass-unit"
    )


def read(tmp_path, text, **units):
    path = tmp_path / "log.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_runs(path, columns(**units))


@pytest.mark.parametrize(
    "text",
    [
        "time [s],mass [g]\n0,1.5\n0.5,2.5\n",
        "Zeit [s];Gewicht [g]\n0;1,5\n0,5;2,5\n",
        "time (s)\tmass (g)\n0\t1,5\n0,5\t2,5\n",
        "t/s m/g\n0 1.5\n0.5 2.5\n",
        "time_s,mass_g\n0,1.5\n0.5,2.5\n",
        "time;mass\ns;g\n0;1,5\n0,5;2,5\n",
        "# a note\ntime,mass\n0 s,1.5 g\n0.5 s,2.5 g\n",
        "time;mass\n10:00:00,0;1,5 g\n10:00:00,5;2,5 g\n",
        "time [ms],mass [mg]\n0,1500\n500,2500\n",
        "number,mass [kg],time [min]\n1,0.0015,0\n2,0.0025,0.00833333333333\n",
        b"\xff\xfe" + "time [s]\tmass [g]\n0\t1.5\n0.5\t2.5\n".encode("utf-16-le"),
    ],
)
def test_separators_decimals_and_units_do_not_change_the_values(tmp_path, text):
    (run,), converted = read(tmp_path, text)
    assert run.first - run.first[0] == pytest.approx([0, 0.5])
    assert run.second == pytest.approx([1.5e-3, 2.5e-3])
    assert converted == [] or all(" to " in words for words in converted)


def test_what_is_converted_is_said(tmp_path):
    _, converted = read(tmp_path, "time [s],mass [g]\n0,1.5\n0.5,2.5\n")
    assert converted == ["log.csv: mass from g to kg (x 0.001)"]


@pytest.mark.parametrize(
    "text",
    [
        "time,mass\n0,1\n1,2\n\n0,3\n1,4\n",
        "time,mass\n0,1\n1,2\n\ntime,mass\n0,3\n1,4\n",
        "run,time,mass\n1,0,1\n1,1,2\n2,0,3\n2,1,4\n",
        "time,mass 1,mass 2\n0,1,3\n1,2,4\n",
    ],
)
def test_repeats_stand_between_empty_lines_under_a_number_or_side_by_side(tmp_path, text):
    runs, _ = read(tmp_path, text, time="s", mass="g")
    assert [run.source for run in runs] == ["log.csv, run 1", "log.csv, run 2"]
    assert np.concatenate([run.second for run in runs]) == pytest.approx([1e-3, 2e-3, 3e-3, 4e-3])


def test_an_empty_line_within_a_log_separates_nothing(tmp_path):
    runs, _ = read(tmp_path, "time,mass\n0,1\n1,2\n\n2,3\n3,4\n", time="s", mass="g")
    assert len(runs) == 1 and len(runs[0].first) == 4


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("time [s],mass\n0,1\n1,2\n", "mass has no unit.*--mass-unit"),
        ("time [s],mass [g]\n0,1 kg\n1,2 kg\n", "in g in its heading but kg in line 2"),
        ("time [s],mass [mm]\n0,1\n1,2\n", "unit of something else"),
        ("time [s],mass [stone]\n0,1\n1,2\n", "unknown unit"),
        ("time [s],mass [Mg]\n0,1\n1,2\n", "unknown unit"),
        ("time [s],mass [g]\n0,1\n1,OL\n2,3\n", "line 3: .*no row of numbers"),
        ("time [s],mass [g]\n0,1\n1,2,3\n2,3\n", "line 3: 3 cells"),
        ("time [s];mass [g]\n0;1.000,5\n1;2,5\n2;3,5\n", "no row of numbers|line"),
        ("a,b\n0,1\n1,2\n", "no column for the time"),
        ("0,1,2\n1,2,3\n", "without a heading"),
        ("nothing here\n", "no table"),
    ],
)
def test_what_could_be_misread_is_refused_with_what_to_write(tmp_path, text, why):
    with pytest.raises(CalibratorError, match=why):
        read(tmp_path, text)


def test_an_option_that_contradicts_the_file_is_refused(tmp_path):
    with pytest.raises(CalibratorError, match="but kg in --mass-unit"):
        read(tmp_path, "time [s],mass [g]\n0,1\n1,2\n", mass="kg")


def test_a_spreadsheet_and_a_missing_file_are_no_tables(tmp_path):
    with pytest.raises(CalibratorError, match="export the table as CSV"):
        read(tmp_path, b"PK\x03\x04\0\0\0\0")
    with pytest.raises(CalibratorError, match="correct its name"):
        read_runs(tmp_path / "none.csv", columns())
