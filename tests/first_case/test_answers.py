"""Answers become SI; what is wrong or missing is said with what to write, all at once."""

import math

import pytest

from calibrator.case.lab import read_lab
from calibrator.errors import CalibratorError
from calibrator.first_case.answers import answers_of, read_answers, with_options
from calibrator.first_case.questions import ask_all


def answers(**changed):
    """Answers of glass beads with one heap; None takes a key out."""
    table = {
        "name": "beads",
        "shape": "spheres",
        "grain_diameter": "2 mm",
        "particle_density": "2.5 g/cm3",
        "conical_pile": {
            "cylinder_diameter": "50 mm",
            "fill_height": "6 cm",
            "measured": {"pile_angle_of_repose_deg": "22.1; 23.0; 22.6 deg"},
        },
    }
    return {k: v for k, v in {**table, **changed}.items() if v is not None}


def test_units_are_converted_and_said():
    found = answers_of(answers())
    assert found.grain == pytest.approx(2e-3) and found.spread == 0
    assert found.particle_density == pytest.approx(2500)
    assert found.vessels["conical_pile"]["fill_height"] == pytest.approx(0.06)
    assert any("g/cm3 to kg/m3" in words for words in found.converted)


def test_a_sieve_fraction_is_a_mean_and_a_spread():
    found = answers_of(answers(grain_diameter="4-6 mm"))
    assert found.grain == pytest.approx(5e-3)
    assert found.spread == pytest.approx(2 / math.sqrt(12) / 5)
    with pytest.raises(CalibratorError, match="smaller size first"):
        answers_of(answers(grain_diameter="6-4 mm"))


@pytest.mark.parametrize(
    "written",
    ["22.1; 23.0; 22.6 deg", "22.1 deg, 23.0 deg, 22.6 deg", ["22.1 deg", "23.0 deg", "22.6 deg"]],
)
def test_repeats_become_mean_scatter_and_number(written):
    pile = answers()["conical_pile"] | {"measured": {"pile_angle_of_repose_deg": written}}
    (row,) = answers_of(answers(conical_pile=pile)).rows
    assert row.value == pytest.approx((22.1 + 23.0 + 22.6) / 3)
    assert row.scatter == pytest.approx(0.4509, rel=1e-3)
    assert row.replicates == 3 and row.role == "calibrate"


def test_a_table_gives_value_scatter_and_replicates():
    given = {"value": "1.5 g/cm3", "scatter": "0.01 g/cm3", "replicates": 4}
    pile = answers()["conical_pile"] | {"measured": {"bulk_density": given}}
    (row,) = answers_of(answers(conical_pile=pile)).rows
    assert (row.value, row.scatter, row.replicates) == (1500, 10, 4)


def test_a_lab_file_is_read_beside_the_answers(tmp_path):
    (tmp_path / "own.csv").write_text(
        "setup,response,value,scatter,replicates,unit,role\n"
        "hourglass,mass_flow_rate,0.02,0.001,3,kg/s,calibrate\n"
    )
    vessel = {"cylinder_diameter": "60 mm", "neck_diameter": "20 mm", "fill_mass": "200 g"}
    found = answers_of(answers(lab="own.csv", hourglass=vessel), tmp_path)
    assert {r.key for r in found.rows} == {
        "hourglass.mass_flow_rate",
        "conical_pile.pile_angle_of_repose_deg",
    }
    assert read_lab(tmp_path / "own.csv")[0] in found.rows


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"name": None}, "name is missing"),
        ({"name": "my sand"}, "plain word"),
        ({"shape": "sphere"}, "did you mean spheres?"),
        ({"grain_diameter": "2"}, "has no unit"),
        ({"grain_diameter": "-2 mm"}, "positive"),
        ({"particle_density": "2.5 mm"}, "unit of something else"),
        ({"particle_density": None}, "particle_density is missing"),
        ({"restitution": "1.5"}, "give 0.3 to 0.95"),
        ({"budget": 0}, "positive number of core-hours"),
        ({"grain_size": "2 mm"}, "grain_size"),
        ({"conical_pile": None}, "nothing was measured"),
        ({"conical_pile": {"measured": {"pile_angle_of_repose_deg": "22 deg"}}}, "is missing"),
        ({"hourglass": "none"}, "must be a table"),
        ({"lab": "nowhere.csv"}, "nowhere.csv"),
    ],
)
def test_what_is_wrong_is_said_with_what_to_write(changed, said, tmp_path):
    with pytest.raises(CalibratorError, match=said.replace("?", r"\?")):
        answers_of(answers(**changed), tmp_path)


def test_all_mistakes_are_said_at_once():
    with pytest.raises(CalibratorError) as error:
        answers_of({"shape": "cube", "budget": "much"})
    assert len(error.value.messages) >= 5


def test_an_angle_measured_twice_is_refused(tmp_path):
    (tmp_path / "own.csv").write_text(
        "setup,response,value,scatter,replicates,unit,role\n"
        "conical_pile,pile_angle_of_repose_deg,22,1,3,deg,calibrate\n"
    )
    with pytest.raises(CalibratorError, match="measured twice"):
        answers_of(answers(lab="own.csv"), tmp_path)


def test_a_vessel_without_a_measurement_is_refused():
    vessel = {"cylinder_diameter": "60 mm", "neck_diameter": "20 mm", "fill_mass": "200 g"}
    with pytest.raises(CalibratorError, match="nothing was measured in hourglass"):
        answers_of(answers(hourglass=vessel))


def test_options_win_over_the_file(tmp_path):
    path = tmp_path / "answers.toml"
    path.write_text('name = "a"\n[ledge]\nbox_length = "3 cm"\n')
    table = with_options(
        read_answers(path), ["name=b", "ledge.fill_height = 2 cm", "ledge.measured.bulk_density=1"]
    )
    assert table == {
        "name": "b",
        "ledge": {"box_length": "3 cm", "fill_height": "2 cm", "measured": {"bulk_density": "1"}},
    }
    for wrong in ("name", "=b", "name.more=c"):
        with pytest.raises(CalibratorError):
            with_options({"name": "a"}, [wrong])


def test_the_questions_give_the_same_answers_and_ask_again_where_one_is_wrong():
    typed = {
        "name": ["my sand", "beads"],
        "shape": ["spheres"],
        "grain_diameter": ["2", "2 mm"],
        "particle_density": ["2.5 g/cm3"],
        "budget": [""],
        "lab": [""],
        "Did you measure a heap": ["y"],
        "  inner diameter": ["50 mm"],
        "  nominal filled height": ["", "6 cm"],
        "  filled bulk density": [""],
        "  poured angle of repose: line": ["22.1; 23.0; 22.6 deg"],
        "  poured angle of repose of the cone": [""],
    }
    said = []

    def ask(prompt):
        for start, replies in typed.items():
            if prompt.startswith(start):
                return replies.pop(0)
        return ""

    assert answers_of(ask_all(ask, said.append)) == answers_of(answers(budget="4"))
    assert any("plain word" in words for words in said) and any("no unit" in w for w in said)
