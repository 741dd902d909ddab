"""The verb `export`: which candidate, how far verified, where, and what it refuses."""

import json
import re

import pytest

from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.handover.export import export
from calibrator.search.calibrate import calibrate
from calibrator.verification.verify import verify
from tests.conftest import space_for


def plain(text):
    """A file's text in one line, without comments' signs."""
    return " ".join(text.replace("\n#", "\n").split())


def test_without_a_calibration_or_with_a_stale_one_it_refuses_and_says_what_to_run(
    space, write_case
):
    with pytest.raises(CalibratorError, match="calibrate has not been done yet: run `calibrator"):
        export(space)
    calibrate(space)
    assert export(space).files["yade"].exists()
    wider = write_case(("sets = 14", "sets = 8"), ("high = 0.7", "high = 0.8"))
    stale = space_for(wider, space.path.parent)
    with pytest.raises(CalibratorError, match=r"parameters.* changed since calibrate: run `calib"):
        export(stale)


def test_the_files_say_how_far_the_candidate_was_verified(space):
    calibrate(space)
    before = export(space)
    assert before.verified is None
    verified = verify(space)
    after = export(space)
    assert after.verified == verified.candidates["compromise"].passed
    for path in before.files.values():
        assert plain(after.standing) in plain(path.read_text())
        assert str(space.path.parent) not in path.read_text(), "no folder of this machine"
    assert "NOT VERIFIED: it is a promise" in before.standing
    assert f"run `{space.command('verify')}`" in before.standing
    assert "a promise of the interpolant" not in plain(after.files["lammps"].read_text())


def test_a_verification_that_is_stale_does_not_count(space, write_case):
    calibrate(space)
    verify(space)
    more = write_case(("sets = 14", "sets = 8"), ("replicates = 4", "replicates = 5"))
    # the number of fresh runs is part of a calibration too, so that it is made again first
    later = space_for(more, space.path.parent)
    calibrate(later)
    found = export(later)
    assert found.verified is None and "changed since it was verified" in found.standing


def test_another_candidate_has_files_of_its_own_name_and_values(space):
    found = calibrate(space)
    one = export(space, "B", "yade")
    assert one.candidate == "individual B" and list(one.files) == ["yade"]
    assert one.files["yade"].name == "toy_individual_B_yade.py"
    (value,) = re.findall(r'"rolling_friction": (.*),', one.files["yade"].read_text())
    assert float(value) == found.candidates["individual B"].parameters["rolling_friction"]
    assert export(space, "individual B", "yade").files == one.files
    with pytest.raises(CalibratorError, match=r"unknown candidate 'Z': .*individual A"):
        export(space, "Z")
    with pytest.raises(CalibratorError, match="unknown engine 'yad': did you mean yade"):
        export(space, engine="yad")


def test_the_command_writes_where_it_is_told_and_prints_what_is_missing(space, tmp_path, capsys):
    calibrate(space)
    results = ["--results", str(space.path.parent)]
    out = tmp_path / "elsewhere"
    path = str(space.case.path)
    assert main(["export", path, *results, "--to", "liggghts", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert [p.name for p in out.iterdir()] == ["toy.liggghts"] and "NOT VERIFIED" in said
    assert "NOT IN THIS FILE: rolling_stiffness_ratio = 4" in said
    assert main(["export", path, *results, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    noted = json.loads((space.path / "summary.json").read_text())
    assert printed == noted["export"] and len(printed["files"]) == 5


def test_the_calibrated_values_and_no_others_are_called_calibrated(space):
    calibrate(space)
    text = plain(export(space).files["edem"].read_text())
    for name in ("rolling_friction", "sliding_friction", "young_modulus"):
        assert re.search(rf"{name} = \S+( Pa)? \(calibrated\)", text)
    assert "restitution = 0.9 (fixed or default)" in text
