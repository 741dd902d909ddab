"""`calibrator preflight`: what could be seen, before anything is measured."""

import json

import jsonschema

from calibrator.cli import main
from calibrator.summary import schema
from tests.toy_laboratory import lab


def test_preflight_says_in_physical_units_what_could_be_seen_and_which_experiment_would_help(
    space, tmp_path, capsys
):
    here = space()
    assert main(["preflight", str(here.case.path), "--results", str(tmp_path / "results")]) == 0
    said = capsys.readouterr().out
    assert "bed_viscosity [Pa s], plausible 0.001" in said and "seen from" in said
    assert "hourglass@wide_neck helps most" in said
    summary = json.loads((here.path / "summary.json").read_text())
    jsonschema.validate(summary, schema())
    found = summary["preflight"]
    assert found["self_test"]["none"]["no gap"] >= 10
    right = found["self_test"]["bond_number"]
    assert right["bond_number"] >= 6 and "bed_viscosity" not in right
    power = {p["effect"]: p for p in found["effects"]}["bond_number"]
    rows = [line.split(",") for line in lab().splitlines()]
    others = [rows[0], *([*row[:3], str(0.5 * float(row[3])), *row[4:]] for row in rows[1:])]
    # the values play no part
    (here.case.path.parent / "lab.csv").write_text("".join(",".join(row) + "\n" for row in others))
    assert main(["preflight", str(here.case.path), "--results", str(tmp_path / "results")]) == 0
    assert json.loads((here.path / "summary.json").read_text())["preflight"] == found
    assert (
        0 < power["smallest_detectable"] <= power["smallest_nameable"] < 1
        and 0 < power["absorbed"] < 1
    )
