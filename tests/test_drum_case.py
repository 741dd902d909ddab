"""A case of a drum at two speeds, with grains of given sizes, on the fake YADE."""

import pytest

from calibrator.cli import main
from calibrator.runs.database import Database

SIZES = "1.05:0.2|1.15:0.5|1.30:0.3"
LAB = """setup,condition,response,value,scatter,replicates,unit,role
rotating_drum,,drum_angle_deg,48.1,0.2,8,deg,calibrate
rotating_drum,,drum_filled_share,0.525,0.001,8,1,calibrate
rotating_drum,fast,drum_angle_deg,52.6,0.2,8,deg,held_out
"""
MORE = f"""[fixed]
size_distribution = "{SIZES}"
[setups.rotating_drum]
rotation_rpm = 45.0
[conditions.fast]
setup = "rotating_drum"
rotation_rpm = 90.0
"""


@pytest.fixture
def case(write_case, fake_yade, tmp_path, monkeypatch):
    """The path of the case; called in its own folder."""
    monkeypatch.chdir(tmp_path)
    return write_case(("[plan]", f"{MORE}[plan]"), lab=LAB)


def test_a_drum_is_calibrated_at_one_speed_and_predicted_at_another(case, capsys):
    for verb in ("check", "run", "collect", "calibrate", "verify", "validate", "report"):
        assert main([verb, str(case)]) == 0, capsys.readouterr()
    said = capsys.readouterr().out
    assert "rotating_drum@fast" in said
    found = Database.read(case.parent / "results" / "toy" / "database.csv").records.values()
    assert {r.request.value("size_distribution") for r in found} == {SIZES}
    assert {r.request.value("rotation_rpm") for r in found} <= {45.0, 90.0}


def test_sizes_that_cannot_stand_beside_another_effect_are_found_before_a_run(case, capsys):
    case.write_text(case.read_text().replace("[fixed]", "[fixed]\nsize_spread = 0.1"))
    assert main(["check", str(case)]) == 2
    said = capsys.readouterr().err
    assert "size_spread and size_distribution cannot be combined" in said


def test_a_drum_that_has_no_time_for_its_turns_is_found_before_a_run(case, capsys):
    case.write_text(case.read_text().replace("rotation_rpm = 45.0", "rotation_rpm = 15.0"))
    assert main(["check", str(case)]) == 2
    assert "longest_time is over before settling_turns" in capsys.readouterr().err
