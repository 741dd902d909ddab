"""What is not known is said, from case file to page; nothing of it counts as agreement."""

import json
import re

import pytest

from calibrator.cli import main
from tests.conftest import LAB
from tests.report.outline import Outline
from tests.stand_in import World, put_in_place

GRID = ('design = "sobol"\nsets = 14\nreplicates = 2', 'design = "grid"\nreplicates = 1')
LINES = ("[run]", '[interpolation]\nmethod = "multilinear"\n[run]')
SMALL = ("population = 60\ngenerations = 15", "population = 20\ngenerations = 4\nrepeats = 1")
ONE = (
    "[parameters.sliding_friction]\nlow = 0.2\nhigh = 0.7\nsamples = 4\n"
    "[parameters.young_modulus]\nlow = 0.5e6\nhigh = 4e6\nsamples = 2\n",
    "",
)


@pytest.fixture
def calibrated(write_case, tmp_path, monkeypatch, capsys):
    """Do all verbs on a case in a world; returns status, summary, page and what was printed."""

    def call(*changes, world=None, lab=LAB):
        put_in_place(monkeypatch, world or World())
        path = write_case(SMALL, *changes, lab=lab)
        status = main(["all", str(path), "--results", str(tmp_path / "results")])
        folder = tmp_path / "results" / "toy"
        summary = json.loads((folder / "summary.json").read_text(), parse_constant=pytest.fail)
        page = Outline((folder / "report.html").read_text()).text
        return status, summary, page, capsys.readouterr().out

    return call


def test_one_parameter_and_one_target_have_an_answer(calibrated):
    lab = LAB.replace("hourglass,bulk_density,1605.6,5,8,kg/m3,calibrate\n", "")
    lab = lab.replace("hourglass,mass_flow_rate,0.026,0.0001,8,kg/s,calibrate\n", "")
    status, summary, page, _ = calibrated(ONE, lab=lab)
    assert status == 0 and summary["calibrate"]["sensitivity"]["first"] == [
        [pytest.approx(1, abs=0.05)]
    ]
    assert "least computing time" not in page and "To save computing time" not in page


def test_noise_that_no_replicate_measured_is_unknown_and_widens_the_intervals(calibrated):
    _, summary, page, told = calibrated(GRID, LINES, world=World(noise=0.04))
    assert set(summary["calibrate"]["seed_noise"].values()) == {None}
    assert "seed noise" in told and "is not known" in told and "not known" in page
    assert not re.search(r"\+- 0 ", told)
    rolling = summary["calibrate"]["identifiability"]["parameters"][0]
    assert rolling["interval_95"][0] <= 0.25 <= rolling["interval_95"][1]
    one = summary["verify"]["candidates"]["compromise"]["responses"][1]
    assert one["standard_error"] > one["scatter"] / 2


def test_a_rate_ten_times_too_large_is_a_question_of_its_unit(calibrated):
    status, summary, page, told = calibrated(
        lab=LAB.replace("mass_flow_rate,0.026", "mass_flow_rate,0.26")
    )
    assert status == 1 and "about 10 times what the box gives" in told
    found = summary["calibrate"]["identifiability"]
    assert found["refused"] and not any(p["pinned"] for p in found["parameters"])
    assert "Use rolling friction" not in page and "not verified" in page
    assert "No interval can be given" in page and "pin down every parameter" not in page


def test_an_honest_large_uncertainty_is_met(calibrated):
    lab = LAB.replace("bulk_density,1605.6,5,8", "bulk_density,1450,300,1")
    status, summary, page, _ = calibrated(lab=lab)
    assert status == 0 and "Use rolling friction" in page
    assert all(t["reachable"] for t in summary["calibrate"]["reachability"]["targets"])


def test_a_target_of_weight_zero_rules_nothing(calibrated):
    idle = ("[plan]", '[targets."hourglass.mass_flow_rate"]\nweight = 0.0\n[plan]')
    lab = LAB.replace("mass_flow_rate,0.026", "mass_flow_rate,0.26")
    status, summary, page, told = calibrated(idle, lab=lab)
    assert status == 0 and "reported only" in told and "reported only" in page
    reach = summary["calibrate"]["reachability"]
    assert reach["all"] and len(reach["targets"]) == 2
    assert not summary["calibrate"]["identifiability"]["refused"]


def test_what_no_run_changes_is_calibrated_without_a_number_that_json_lacks(calibrated):
    def constant(setup, p, seed):
        own = {
            "hourglass": {"drained_equivalent_angle_deg": 46.8, "mass_flow_rate": 0.026},
            "ledge": {"ledge_equivalent_angle_deg": 37.44},
            "conical_pile": {"pile_equivalent_angle_deg": 23.4},
        }
        return {"bulk_density": 1605.6, **own[setup]}

    status, summary, _, _ = calibrated(world=World(responses_of=constant, noise=0.0))
    assert status == 0
    assert not any(p["pinned"] for p in summary["calibrate"]["identifiability"]["parameters"])
