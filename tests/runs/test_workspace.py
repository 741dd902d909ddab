"""The folder of a case's results, and the summary in it: whole and unedited, or not believed."""

import pytest

from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.plan.forecast import forecast
from calibrator.plan.outcome import Forecast
from calibrator.runs import workspace


@pytest.mark.parametrize("name", ["", "plan"])
def test_a_link_in_place_of_a_results_folder_is_refused(write_case, tmp_path, name, capsys):
    outside = tmp_path / "outside"
    outside.mkdir()
    link = tmp_path / "out" / "toy" / name
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(outside)
    assert main(["plan", str(write_case()), "--results", str(tmp_path / "out")]) == 2
    assert "symbolic link" in capsys.readouterr().err and not list(outside.iterdir())


@pytest.mark.parametrize(
    "state",
    [
        "{}",
        "[]",
        "null",
        '{"calibrate": {}}',
        '{"calibrate": {"candidates": {"compromise": 1}}}',
        "[" * 9999,
        '{"seal": "0"}',
        "",
    ],
)
@pytest.mark.parametrize("verb", ["verify", "validate", "report", "plan"])
def test_a_damaged_summary_is_one_line_for_every_verb(write_case, tmp_path, capsys, state, verb):
    (tmp_path / "out" / "toy").mkdir(parents=True)
    (tmp_path / "out" / "toy" / "summary.json").write_text(state)
    assert (
        main([verb, str(write_case(("sets = 14", "sets = 2"))), "--results", str(tmp_path / "out")])
        == 2
    )
    error = capsys.readouterr().err
    assert "summary.json is damaged" in error and error.count("\n") == 1


def test_a_summary_edited_by_hand_is_not_believed(write_case, tmp_path):
    space = workspace.Workspace(read_case(write_case(("sets = 14", "sets = 2"))), tmp_path / "toy")
    forecast(space)
    assert space.outcome("plan", Forecast).runs == 4
    path = space.path / "summary.json"
    path.write_text(path.read_text().replace('"runs": 4', '"runs": 5', 1))
    with pytest.raises(CalibratorError, match="edited"):
        space.summary()
