"""`calibrator init` from answers to a case that `check` accepts."""

import json
import sys
import tomllib
from pathlib import Path

import pytest

from calibrator.case.toml import read_case
from calibrator.check import check_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.first_case.answers import answers_of
from calibrator.first_case.verb import init
from calibrator.runs.workspace import Workspace
from tests.first_case.test_answers import answers

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "init.md"
ORE = {
    "name": "ore",
    "shape": "angular",
    "grain_diameter": "4-6 mm",
    "particle_density": "4.2 g/cm3",
    "hourglass": {
        "cylinder_diameter": "200 mm",
        "neck_diameter": "60 mm",
        "fill_mass": "12 kg",
        "measured": {
            "mass_flow_rate": "0.60; 0.63; 0.62 kg/s",
            "emptying_time": "16 s",
            "onset_delay": {"value": "0.1 s", "scatter": "0.02 s", "replicates": 3},
        },
    },
    "ledge": {
        "box_length": "150 mm",
        "fill_height": "120 mm",
        "measured": {"ledge_angle_of_repose_deg": "38; 39; 37.5 deg", "bulk_density": "2.3 g/cm3"},
    },
}


@pytest.mark.parametrize("table", [answers(), answers(shape="rounded", budget=20), ORE])
def test_check_accepts_what_init_writes(table, tmp_path, fake_yade):
    begun = init(answers_of(table), tmp_path)
    case = read_case(begun.case)
    checked = check_case(Workspace(case, tmp_path / "results"))
    assert set(begun.doubts) <= set(checked.warnings)
    assert begun.core_hours <= begun.budget and begun.runs > 0
    assert set(begun.calibrated) == set(case.problem.names)


def test_a_larger_budget_never_makes_a_smaller_vessel_or_loses_more(tmp_path):
    found = []
    for budget in (3, 10, 100, 3000):
        begun = init(answers_of({**ORE, "budget": budget}), tmp_path / str(budget))
        found.append(begun)
    widths = [b.vessels["hourglass"].grains for b in found]
    assert widths == sorted(widths) and widths[-1] > widths[0]
    assert "hourglass.emptying_time" in found[0].lost and not found[-1].lost
    assert found[-1].vessels["hourglass"].across == pytest.approx(40)
    assert not found[-1].steps


def test_what_was_measured_stands_in_the_lab_file_beside_what_is_simulated(tmp_path):
    begun = init(answers_of({**ORE, "budget": 3}), tmp_path)
    text = (tmp_path / "ore_lab.csv").read_text()
    assert "# hourglass.mass_flow_rate: measured 0.616667; " in text
    assert "# hourglass.emptying_time: measured 16; left out: " in text
    rate = next(o for o in read_case(begun.case).observables if o.response == "mass_flow_rate")
    assert rate.value < 0.6
    assert "becomes" in begun.steps["hourglass.mass_flow_rate"]


def test_a_budget_that_pays_for_nothing_is_refused_with_what_it_takes(tmp_path):
    with pytest.raises(CalibratorError, match=r"takes .* core-hours, more than budget = 0\.01"):
        init(answers_of(answers(budget=0.01)), tmp_path)
    assert not list(tmp_path.iterdir())


def test_nothing_is_overwritten(tmp_path):
    init(answers_of(answers()), tmp_path)
    before = (tmp_path / "beads.toml").read_bytes()
    with pytest.raises(CalibratorError, match="not overwritten"):
        init(answers_of(answers(shape="angular")), tmp_path)
    assert (tmp_path / "beads.toml").read_bytes() == before


def test_the_equivalent_angle_is_fitted_and_the_line_through_the_same_heap_held_out(tmp_path):
    pile = answers()["conical_pile"] | {
        "measured": {
            "pile_angle_of_repose_deg": "22; 23; 22.5 deg",
            "pile_equivalent_angle_deg": "23; 24; 23.5 deg",
        }
    }
    begun = init(answers_of(answers(conical_pile=pile)), tmp_path)
    roles = {o.response: o.role for o in read_case(begun.case).observables}
    assert roles == {
        "pile_angle_of_repose_deg": "held_out",
        "pile_equivalent_angle_deg": "calibrate",
    }


def test_a_set_up_is_held_out_where_the_others_have_enough(tmp_path):
    more = {"bulk_density": "2.31; 2.33 g/cm3", "mass_flow_rate": "0.60; 0.63; 0.62 kg/s"}
    heap = {
        "cylinder_diameter": "150 mm",
        "fill_height": "150 mm",
        "measured": {"pile_angle_of_repose_deg": "35; 36 deg"},
    }
    flow = ORE["hourglass"] | {"measured": more}
    table = {**ORE, "hourglass": flow, "conical_pile": heap, "budget": 8}
    begun = init(answers_of(table), tmp_path)
    case = read_case(begun.case)
    assert set(begun.held_out) == {t.key for t in case.problem.held_out}
    assert {t.setup for t in case.problem.held_out} == {"conical_pile"}
    assert len(case.problem.targets) >= 3


@pytest.mark.parametrize(
    ("vessel", "said"),
    [
        ({"neck_diameter": "3 mm"}, "below a grain diameter"),
        ({"neck_diameter": "300 mm"}, "smaller than cylinder_diameter"),
    ],
)
def test_a_vessel_that_cannot_be_is_refused_before_it_is_sized(vessel, said, tmp_path):
    flow = ORE["hourglass"] | vessel
    with pytest.raises(CalibratorError, match=said):
        init(answers_of({**ORE, "hourglass": flow}), tmp_path)


def test_a_slow_machine_gets_a_smaller_vessel_for_the_same_budget(tmp_path):
    """It was given the vessel of a fast one, and the budget was spent before the plan was done."""
    fast, slow = (
        init(answers_of(answers(budget=6, particle_steps_per_second=rate)), tmp_path / str(rate))
        for rate in (4e6, 1e6)
    )
    assert slow.vessels["conical_pile"].grains < fast.vessels["conical_pile"].grains
    assert slow.core_hours <= 6 and slow.rate_known
    assert read_case(slow.case).run.particle_steps_per_second == 1e6
    assert "1 million particle-steps a second" in "\n".join(slow.lines())


def test_the_machine_is_timed_once_nothing_else_is_wrong_and_is_not_where_the_answers_say_it(
    tmp_path,
):
    timed = []

    def half():
        timed.append(1)
        return 1e6

    begun = init(answers_of(answers(budget=20)), tmp_path, half)
    assert begun.particle_steps_per_second == 1e6 and len(timed) == 1
    with pytest.raises(CalibratorError, match="not overwritten"):
        init(answers_of(answers()), tmp_path, half)
    init(answers_of(answers(particle_steps_per_second=3e6)), tmp_path / "given", half)
    assert len(timed) == 1


def test_hours_of_another_machine_are_called_so(tmp_path):
    begun = init(answers_of(answers()), tmp_path)
    assert not begun.rate_known and "another machine" in "\n".join(begun.lines())
    assert "particle_steps_per_second" not in Path(begun.case).read_text()


@pytest.mark.parametrize("given", [0, "fast", 1e12])
def test_a_rate_that_no_machine_has_is_refused(given):
    with pytest.raises(CalibratorError, match="particle_steps_per_second = "):
        answers_of(answers(particle_steps_per_second=given))


def test_what_says_nothing_of_smaller_vessels_is_said_where_the_budget_is_too_small(tmp_path):
    flow = ORE["hourglass"] | {"measured": {"drained_angle_of_repose_deg": "33; 34 deg"}}
    only = {k: v for k, v in ORE.items() if k != "ledge"}
    with pytest.raises(CalibratorError, match=r"more than budget.*crater of few grains"):
        init(answers_of({**only, "hourglass": flow, "budget": 0.5}), tmp_path)


def test_the_command_takes_a_file_and_options_and_prints_json(tmp_path, capsys):
    path = tmp_path / "answers.toml"
    path.write_text('name = "sand"\nshape = "rounded"\ngrain_diameter = "1 mm"\n')
    given = [
        "particle_density=2650 kg/m3",
        "conical_pile.cylinder_diameter=30 mm",
        "conical_pile.fill_height=30 mm",
        "conical_pile.measured.pile_angle_of_repose_deg=30, 31 deg",
        "particle_steps_per_second=1.9e6",
    ]
    options = [word for one in given for word in ("--set", one)]
    out = tmp_path / "out"
    assert main(["init", "--answers", str(path), *options, "--out", str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["case"] == str(out / "sand.toml") and (out / "sand_lab.csv").exists()
    assert main(["init", "--answers", str(path), *options, "--out", str(tmp_path / "b")]) == 0
    assert f"next: calibrator check {tmp_path / 'b' / 'sand.toml'}" in capsys.readouterr().out


def test_without_a_terminal_and_without_answers_there_is_a_remedy(monkeypatch, capsys):
    monkeypatch.setattr(sys.stdin, "isatty", lambda: False, raising=False)
    assert main(["init"]) == 2
    assert "--answers FILE" in capsys.readouterr().err


def test_the_answers_of_the_document_make_a_case(tmp_path):
    text = (DOCUMENT.read_text().split("```toml\n")[1]).split("```")[0]
    begun = init(answers_of(tomllib.loads(text)), tmp_path)
    assert read_case(begun.case).name == "glass_beads"


def test_a_number_near_zero_is_left_out_where_the_simulated_vessel_is_another(tmp_path, fake_yade):
    drum = {
        "drum_diameter": "45 mm",
        "drum_depth": "12 mm",
        "rotation_rpm": "30 rpm",
        "measured": {
            "drum_angle_deg": {"value": "38 deg", "scatter": "0.6 deg", "replicates": 1},
            "drum_lower_angle_deg": {"value": "30 deg", "scatter": "0.6 deg", "replicates": 1},
            "drum_height_centre": {"value": "-0.009 1", "scatter": "0.008 1", "replicates": 1},
            "drum_height_lower_03": {"value": "-0.24 1", "scatter": "0.008 1", "replicates": 1},
        },
    }
    table = {
        "name": "pellets",
        "shape": "rounded",
        "grain_diameter": "1.5 mm",
        "particle_density": "1.5 g/cm3",
        "budget": 0.6,
        "rotating_drum": drum,
    }
    begun = init(answers_of(table), tmp_path)
    assert list(begun.lost) == ["rotating_drum.drum_height_centre"]
    assert not any("% of the measured value" in doubt for doubt in begun.doubts)
