"""What is verified belongs to the case as it is now, and what nothing measured is missed."""

import dataclasses
import json

import pytest

from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.plan.run import run_plan
from calibrator.search.calibrate import calibrate
from calibrator.search.outcome import current_calibration
from calibrator.verification.verify import verification_requests, verify
from tests.conftest import LAB, space_for
from tests.stand_in import World, put_in_place

FEW = ("sets = 14", "sets = 6")


def test_a_case_that_changed_since_calibrate_is_told_so(write_case, tmp_path, fake_yade):
    space = space_for(write_case(FEW), tmp_path)
    run_plan(space)
    calibrate(space)
    assert len(verification_requests(space, current_calibration(space))["compromise"]) == 4
    changes = {
        "parameters": ("low = 0.2", "low = 0.3"),
        "search settings": ("population = 60", "population = 80"),
        "fixed values": ("[plan]", "[fixed]\nrestitution = 0.8\n[plan]"),
        "set-ups": ("[plan]", "[setups.hourglass]\nneck_diameter = 0.015\n[plan]"),
        "interpolation": ("[plan]", "[interpolation]\nsimilarity = false\n[plan]"),
        "targets": ("[plan]", '[targets."hourglass.bulk_density"]\nweight = 2.0\n[plan]'),
    }
    for part, change in changes.items():
        other = dataclasses.replace(space, case=read_case(write_case(FEW, change)))
        if part == "interpolation":  # what is written out at its default is no change
            current_calibration(other)
            continue
        with pytest.raises(CalibratorError, match=rf"{part}.* changed since calibrate: run `cali"):
            verify(other)


def test_a_corrected_measurement_asks_for_a_new_calibration(write_case, tmp_path, fake_yade):
    path = write_case(FEW)
    space = space_for(path, tmp_path)
    run_plan(space)
    calibrate(space)
    lab = (path.parent / "lab.csv").read_text()
    (path.parent / "lab.csv").write_text(lab.replace("46.8,0.2", "46.8,0.4"))
    with pytest.raises(CalibratorError, match="targets changed since calibrate"):
        verify(space_for(path, tmp_path))


def test_a_run_that_is_added_to_the_database_asks_for_a_new_calibration(
    write_case, tmp_path, fake_yade
):
    space = space_for(write_case(FEW), tmp_path)
    run_plan(space)
    calibrate(space)
    first = next((space.path / "records").glob("*.json"))
    first.unlink()
    with pytest.raises(CalibratorError, match="runs changed since calibrate"):
        verify(space)


@pytest.mark.parametrize("clogged", [1, 3, 4])
def test_targets_that_fresh_runs_did_not_measure_are_missed(
    write_case, tmp_path, fake_yade, capsys, clogged
):
    path = write_case(("spread_replicates = 1", "spread_replicates = 0"))
    results = tmp_path / "results"
    for verb in ("run", "calibrate"):
        assert main([verb, str(path), "--results", str(results)]) == 0
    seed = read_case(path).verify.seed
    trouble = {str(seed + i): "clog" for i in range(clogged)}
    (results / "toy" / "misbehave.json").write_text(json.dumps(trouble))
    capsys.readouterr()
    status = main(["verify", str(path), "--results", str(results)])
    said = capsys.readouterr().out
    found = json.loads((results / "toy" / "summary.json").read_text())["verify"]
    verdict = found["candidates"]["compromise"]
    assert verdict["statuses"].get("clogged") == clogged and f"{clogged} clogged" in said
    # one of four is what its user would see too; three of four are no recommendation
    assert ("no recommendation" in said) == (clogged > 2)
    assert (status, found["passed"]) == ((0, True) if clogged == 1 else (1, False))
    if clogged == 4:
        assert status == 1 and not found["passed"] and verdict["o1"] is None
        assert said.count("not measured by any of 4 fresh runs: MISSED") == 3
        assert all(r["simulated"] is None and not r["passed"] for r in verdict["responses"])


def test_where_nothing_is_held_out_a_validation_has_no_verdict(
    write_case, tmp_path, monkeypatch, capsys
):
    put_in_place(monkeypatch, World())
    lines = [line for line in LAB.splitlines() if "held_out" not in line]
    path = write_case(FEW, lab="\n".join(lines) + "\n")
    for verb in ("run", "calibrate", "validate", "report"):
        assert main([verb, str(path), "--results", str(tmp_path / "results")]) == 0
    said = capsys.readouterr().out
    assert "nothing to validate" in said and "NOT passed" not in said
    summary = json.loads((tmp_path / "results" / "toy" / "summary.json").read_text())
    assert summary["validate"]["passed"] is None
