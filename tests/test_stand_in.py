"""The world in place of YADE, on the toy case."""

import json

from calibrator.cli import main
from tests.stand_in import World, put_in_place


def test_the_toy_case_is_calibrated_from_case_file_to_page(
    write_case, tmp_path, monkeypatch, capsys
):
    made = put_in_place(monkeypatch, World())
    assert main(["all", str(write_case()), "--results", str(tmp_path / "results")]) == 0
    summary = json.loads((tmp_path / "results" / "toy" / "summary.json").read_text())
    assert summary["verify"]["passed"] and len(made.made) == 28 + 8 + 6
