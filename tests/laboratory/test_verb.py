"""The verb measure: from files to rows that `check` accepts."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from calibrator.case.lab import read_lab
from calibrator.cli import main
from calibrator.options import parser

REPO = Path(__file__).resolve().parents[2]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_log(path, rate=20.0, unit="g"):
    """A log of 100 g at a rate [g/s] from 2 s on, with decimal commas."""
    time = np.arange(0, 12, 0.05)
    mass = np.clip(rate * (time - 2), 0, 100)
    rows = [f"{t:.2f};{m:.2f}".replace(".", ",") for t, m in zip(time, mass, strict=True)]
    path.write_text("\n".join([f"Zeit [s];Masse [{unit}]", *rows]) + "\n", "utf-8")


def test_repeats_become_rows_with_mean_scatter_and_number(folder, capsys):
    for i, rate in enumerate((19.0, 20.0, 21.0)):
        write_log(folder / f"scale_{i}.csv", rate)
    call = ["measure", "discharge", "scale_0.csv", "scale_1.csv", "scale_2.csv", "--lab", "lab.csv"]
    assert main([*call, "--released", "2 s", "--fill-mass", "150 g"]) == 0
    found = {one.response: one for one in read_lab(folder / "lab.csv")}
    rate = found["mass_flow_rate"]
    assert rate.setup == "hourglass" and rate.role == "calibrate" and rate.replicates == 3
    assert rate.value == pytest.approx(0.020, rel=3e-3)
    assert rate.scatter == pytest.approx(0.001, rel=0.02)
    assert found["residual_mass"].value == pytest.approx(0.050, abs=1e-4)
    assert found["late_early_ratio"].role == "diagnose"
    said = capsys.readouterr().out
    assert "mass from g to kg" in said and "--fill-mass: g to kg" in said
    notes = [n for n in (folder / "lab.csv").read_text().splitlines() if n.startswith("#")]
    assert any("measure discharge" in n for n in notes) and any("scale_2.csv" in n for n in notes)


def test_rows_are_appended_once_and_a_second_time_refused(folder, capsys):
    write_log(folder / "scale.csv")
    (folder / "lab.csv").write_text(
        "# mine\nresponse,setup,condition,value,scatter,replicates,unit,role\n"
        "bulk_density,hourglass,,1530,8,5,kg/m3,calibrate\n"
    )
    call = ["measure", "discharge", "scale.csv", "--lab", "lab.csv"]
    assert main(call) == 0
    text = (folder / "lab.csv").read_text()
    assert text.startswith("# mine\n") and "hourglass.bulk_density" in [
        one.key for one in read_lab(folder / "lab.csv")
    ]
    assert main(call) == 2 and "has hourglass.mass_flow_rate already" in capsys.readouterr().err
    assert (folder / "lab.csv").read_text() == text
    assert main([*call, "--condition", "vented", "--role", "diagnose"]) == 0
    assert "hourglass@vented.mass_flow_rate" in [one.key for one in read_lab(folder / "lab.csv")]


def test_check_accepts_what_was_written(folder, write_case, fake_yade):
    case = write_case()
    (case.parent / "lab.csv").unlink()
    write_log(folder / "scale.csv")
    lab = str(case.parent / "lab.csv")
    assert main(["measure", "discharge", "scale.csv", "--released", "2 s", "--lab", lab]) == 0
    (folder / "density.csv").write_text(
        "response,value,unit\nbulk_density,1.60,g/cm3\nbulk_density,1.61,g/cm3\n"
    )
    assert main(["measure", "readings", "density.csv", "--setup", "hourglass", "--lab", lab]) == 0
    assert main(["check", str(case), "--results", str(folder / "results")]) == 0


def test_single_readings_are_converted_and_their_scatter_is_that_of_repeats(folder, capsys):
    (folder / "hand.csv").write_text(
        "response;value;unit\nbulk_density;1,60;g/cm3\nbulk_density;1,62;g/cm3\n"
        "mass_flow_rate;26;g/s\n"
    )
    assert main(["measure", "readings", "hand.csv", "--setup", "hourglass", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    rows = {row["response"]: row for row in found["rows"]}
    assert rows["bulk_density"]["value"] == pytest.approx(1610)
    assert rows["bulk_density"]["scatter"] == pytest.approx(10 * np.sqrt(2))
    assert rows["mass_flow_rate"]["value"] == pytest.approx(0.026)
    assert rows["mass_flow_rate"]["scatter"] is None
    assert found["converted"] == [
        "hand.csv: bulk_density from g/cm3 to kg/m3 (x 1000)",
        "hand.csv: mass_flow_rate from g/s to kg/s (x 0.001)",
    ]


def test_a_profile_in_millimetres_gives_the_rows_of_a_conical_pile(folder, capsys):
    x = np.arange(-60, 61)
    z = np.maximum(25 - np.abs(x) / 2, 0)
    table = "\n".join(f"{a}\t{b}" for a, b in zip(x, z, strict=True))
    (folder / "laser.txt").write_text(f"x [mm]\tz [mm]\n{table}\n")
    assert main(["measure", "profile", "laser.txt", "--lab", "lab.csv"]) == 0
    found = {one.response: one.value for one in read_lab(folder / "lab.csv")}
    assert found["pile_angle_of_repose_deg"] == pytest.approx(np.degrees(np.arctan(0.5)), abs=0.3)
    assert {"pile_equivalent_angle_deg", "pile_curvature", "pile_apex_rounding"} < set(found)
    assert "from mm to m" in capsys.readouterr().out


def test_the_mean_curve_of_repeats_becomes_a_row_that_can_be_read(folder):
    for i, slope in enumerate((0.45, 0.5, 0.55)):
        x = np.arange(-60, 61)
        rows = "\n".join(f"{a}\t{max(25 - abs(a) * slope, 0)}" for a in x.tolist())
        (folder / f"laser_{i}.txt").write_text(f"x [mm]\tz [mm]\n{rows}\n")
    call = ["measure", "profile", *(f"laser_{i}.txt" for i in range(3)), "--lab", "lab.csv"]
    assert main([*call, "--curve", "heap.csv"]) == 0
    (row,) = [one for one in read_lab(folder / "lab.csv") if one.curve]
    assert row.key == "conical_pile.profile_height" and row.replicates == 3
    at = np.array(row.curve.x)
    inside = (at > 5e-3) & (at < 40e-3)
    assert np.array(row.curve.value)[inside] == pytest.approx(25e-3 - at[inside] / 2, abs=3e-4)
    assert np.array(row.curve.scatter)[inside] == pytest.approx(0.05 * at[inside], abs=3e-4)


def test_the_mass_that_passed_is_a_curve_where_the_release_is_known(folder, capsys):
    for i, rate in enumerate((19.0, 21.0)):
        write_log(folder / f"scale_{i}.csv", rate)
    call = ["measure", "discharge", "scale_0.csv", "scale_1.csv", "--curve", "discharge.csv"]
    assert main(call) == 2 and "give --released" in capsys.readouterr().err
    assert main([*call, "--released", "2 s", "--lab", "lab.csv"]) == 0
    (row,) = [one for one in read_lab(folder / "lab.csv") if one.curve]
    at, mass = np.array(row.curve.x), np.array(row.curve.value)
    assert row.key == "hourglass.passed_mass" and at[0] == 0
    early = (at > 0.2) & (at < 4.5)
    assert mass[early] == pytest.approx(0.020 * at[early], abs=5e-4)
    assert mass[-1] == pytest.approx(0.1, abs=1e-4)


def test_a_curve_that_the_lab_file_could_not_name_is_refused(folder, capsys):
    write_log(folder / "scale.csv")
    (folder / "a" / "b").mkdir(parents=True)
    call = ["measure", "discharge", "scale.csv", "--released", "2 s", "--curve", "curve.csv"]
    assert main([*call, "--lab", "a/b/lab.csv"]) == 2
    assert "leaves the case's folder" in capsys.readouterr().err
    assert not (folder / "curve.csv").exists()
    assert main([*call, "--role", "diagnose"]) == 2
    assert "no evidence for a diagnosis" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["discharge", "none.csv"], "no file none.csv"),
        (["discharge", "scale.csv", "--mass-unit", "kg"], "but kg in --mass-unit"),
        (["discharge", "scale.csv", "--fill-mass", "150"], "has no unit"),
        (["discharge", "scale.csv", "--fill-mass", "150 mm"], "unit of something else"),
        (["discharge", "scale.csv", "--fall-height", "-1 mm"], "positive"),
        (["profile", "scale.csv"], "no column for the"),
        (["photo", "none.png"], "no file none.png"),
        (["photo", "none.png", "--tilt", "-3"], "looks up"),
        (["photo", "none.png", "--crop", "1,2"], "give 4 plain numbers"),
        (["photo", "none.png", "--grain-diameter", "2 mm"], "--known"),
        (["photo", "none.png", "--box-length", "2 mm"], "--known"),
    ],
)
def test_a_mistake_ends_with_what_to_do_and_writes_nothing(folder, capsys, arguments, why):
    write_log(folder / "scale.csv")
    assert main(["measure", *arguments, "--lab", "lab.csv"]) == 2
    error = capsys.readouterr().err
    assert why in error and error.count("\n") == 1 and not (folder / "lab.csv").exists()


def test_the_page_names_the_kinds_and_options_as_they_are():
    (verbs,) = (a for a in parser()._actions if a.dest == "verb")
    (kinds,) = (a for a in verbs.choices["measure"]._actions if a.dest == "kind")
    page = (REPO / "docs" / "measure.md").read_text()
    assert re.findall(r"^calibrator measure (\w+) ", page, re.M) == list(kinds.choices)
    taken = {
        s for own in kinds.choices.values() for a in own._actions for s in a.option_strings
    } - {"-h", "--help"}
    assert set(re.findall(r"`(--[a-z-]+)", page)) == taken
