"""Nothing of a calibration is dropped from a file without a word."""

import dataclasses

import pytest

from calibrator.handover.chosen import SWITCHES
from calibrator.handover.export import FILES
from calibrator.handover.unmapped import MAPPED, unmapped
from tests.handover.materials import material

ON = {
    "bond_number": 0.7,
    "bed_viscosity": 0.013,
    "wall_friction_ratio": 0.5,
    "neck_error": 3e-4,
    "tilt_deg": 4.0,
    "twisting_stiffness": 1.0,
    "size_spread": 0.2,
    "clump_aspect": 1.3,
    "shaking": 0.8,
    "size_distribution": "0.9:1|1.1:1",
}


def words(text):
    """The text without its comments' signs and line breaks."""
    return " ".join(text.replace("\n#", "\n").split())


def test_every_switch_of_the_vocabulary_is_tried():
    assert set(ON) == set(SWITCHES)


@pytest.mark.parametrize("engine", FILES)
@pytest.mark.parametrize("name", ON)
def test_an_effect_is_either_in_the_law_or_said_to_be_missing(engine, name):
    plain, chosen = material(), material(**{name: ON[name]})
    text = FILES[engine][1]
    said = unmapped(chosen, engine)
    if name in MAPPED[engine]:
        code = [line for line in text(chosen).splitlines() if not line.startswith("#")]
        assert code != [line for line in text(plain).splitlines() if not line.startswith("#")]
        assert not any(s.startswith("NOT IN THIS FILE: " + name) for s in said)
    else:
        assert any(name in s and str(ON[name]) in s for s in said)
        for sentence in said:
            assert words(sentence) in words(text(chosen))


@pytest.mark.parametrize(
    ("engine", "speaks"),
    [("yade", False), ("liggghts", True), ("lammps", False), ("mercury", True), ("edem", True)],
)
def test_the_soft_rolling_spring_is_spoken_of_where_it_is_not_yades(engine, speaks):
    said = unmapped(material(rolling_spring="epsd"), engine)
    assert any("rolling_spring = epsd" in s for s in said) == speaks


def test_what_the_set_ups_of_a_calibration_do_not_share_is_said():
    chosen = dataclasses.replace(material(), differing=("bond_number",))
    for engine in FILES:
        assert "bond_number differ between the set-ups" in words(FILES[engine][1](chosen))


def test_a_step_that_the_case_fixes_is_every_file_s():
    chosen = material(time_step=1.25e-6)
    for engine in ("liggghts", "lammps"):
        assert "\ntimestep 1.25e-06\n" in FILES[engine][1](chosen)
    assert "Time Step,1.25e-06,s" in FILES["edem"][1](chosen)


@pytest.mark.parametrize("engine", ["liggghts", "lammps"])
def test_no_difference_is_claimed_for_the_soft_spring_which_was_not_compared(engine):
    for spring, claims in (("epsd", False), ("epsd2", True)):
        text = words(FILES[engine][1](material(rolling_spring=spring)))
        assert ("heap, equivalent angle" in text) == claims
        assert ("nothing with the soft spring" in text) == (not claims)


def test_the_ratio_of_the_rolling_spring_is_missing_in_liggghts_only():
    for engine in FILES:
        said = " ".join(unmapped(material(rolling_stiffness_ratio=4.0), engine))
        assert ("rolling_stiffness_ratio = 4" in said) == (engine == "liggghts")
    assert not unmapped(material(rolling_stiffness_ratio=1.0), "liggghts")
