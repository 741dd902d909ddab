"""A curve's file is read as it stands, or refused with what to write instead."""

import pytest

from calibrator.case.curve import MeasuredCurve, curve_file, read_curve
from calibrator.case.lab import read_lab
from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError
from tests.curve_world import HEAD, photographed_heap, write

ROW = "conical_pile,profile_height,heap.csv,,5,m,calibrate\n"
GOOD = "x,value,scatter\n" + "".join(f"{i},{9 - i},0.1\n" for i in range(9))


def test_a_curve_is_read_as_it_was_written(tmp_path):
    curve = photographed_heap()
    (tmp_path / "heap.csv").write_text(curve_file(curve))
    assert read_curve(tmp_path / "heap.csv") == curve
    (tmp_path / "bare.csv").write_text("x;value\n" + "".join(f"{i};0,{i}\n" for i in range(1, 9)))
    bare = read_curve(tmp_path / "bare.csv")
    assert bare.value[0] == 0.1 and set(bare.scatter) == {0.0}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("3,6,", "1,6,", "x does not rise"),
        ("3,6,", "three,6,", "line 5: .*plain numbers"),
        ("3,6,", "3,,", "line 5: value is empty"),
        ("3,6,", "3,inf,", "finite numbers"),
        ("3,6,0.1", "3,6,-0.1", "scatter of zero or more"),
        ("x,value,scatter", "r,h,scatter", "the header must be x,value"),
    ],
)
def test_what_is_no_curve_is_refused(tmp_path, old, new, said):
    assert old in GOOD
    (tmp_path / "heap.csv").write_text(GOOD.replace(old, new))
    with pytest.raises(CalibratorError, match=said):
        read_curve(tmp_path / "heap.csv")


def test_short_and_level_curves_are_refused():
    with pytest.raises(CalibratorError, match="give 5 or more"):
        MeasuredCurve((1.0, 2.0), (1.0, 2.0), (0.0, 0.0))
    with pytest.raises(CalibratorError, match="has to rise or fall"):
        MeasuredCurve(tuple(range(9)), (1.0,) * 9, (0.0,) * 9)


def test_a_row_of_the_lab_file_names_a_curve(tmp_path):
    curve = photographed_heap()
    case = read_case(
        write(
            tmp_path,
            ROW,
            {"heap.csv": curve},
            '[targets."conical_pile.profile_height"]\nscale_error = 0.01\ntolerance = 0.05\n',
        )
    )
    (target,) = case.problem.targets
    assert target.key == "conical_pile.profile_height" and target.tolerance == 0.05
    assert target.curve.value == curve.value and target.curve.scale_error == 0.01
    assert case.has_curves and not case.observables  # a diagnosis sees numbers only


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (ROW.replace("calibrate", "diagnose"), "no evidence for a diagnosis"),
        (ROW.replace(",,5", ",0.1,5"), "column of its file; leave the cell empty"),
        (ROW.replace("heap.csv", "../../heap.csv"), "leaves the case's folder"),
        (ROW.replace("heap.csv", "none.csv"), "no curve .*none.csv"),
        (
            ROW.replace("conical_pile", "hourglass").replace("profile_height", "passed_mas"),
            "passed",
        ),
        (ROW.replace("profile_height", "passed_mass").replace(",m,", ",kg,"), "use hourglass"),
        (ROW.replace(",m,", ",mm,"), "convert it to m"),
    ],
)
def test_a_row_that_names_none_is_refused(tmp_path, row, said):
    (tmp_path / "heap.csv").write_text(curve_file(photographed_heap()))
    (tmp_path / "lab.csv").write_text(HEAD + row)
    with pytest.raises(CalibratorError, match=said):
        read_lab(tmp_path / "lab.csv")


def test_errors_that_points_share_belong_to_curves_only(tmp_path):
    rows = ROW + "hourglass,bulk_density,1600,5,5,kg/m3,calibrate\n"
    options = '[targets."hourglass.bulk_density"]\nscale_error = 0.01\n'
    with pytest.raises(CalibratorError, match="scale_error"):
        read_case(write(tmp_path, rows, {"heap.csv": photographed_heap()}, options))
    negative = '[targets."conical_pile.profile_height"]\nscale_error = -0.01\n'
    with pytest.raises(CalibratorError, match="standard deviation of zero or more"):
        read_case(write(tmp_path, rows, {"heap.csv": photographed_heap()}, negative))
