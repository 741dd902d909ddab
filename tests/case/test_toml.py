"""Bad input gets one line that says what to do."""

import pytest
from tests.conftest import LAB

from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError


def test_the_toy_case_is_read(write_case):
    case = read_case(write_case())
    assert case.problem.names == ["rolling_friction", "sliding_friction", "young_modulus"]
    assert [t.key for t in case.problem.held_out] == [
        "ledge.ledge_equivalent_angle_deg",
        "conical_pile.pile_equivalent_angle_deg",
    ]
    assert case.problem.targets[0].standard_error == pytest.approx(5 / 8**0.5)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("population", "popolation", "did you mean population"),
        ("[plan]", "[plann]", "did you mean plan"),
        (
            "[parameters.rolling_friction]",
            "[parameters.roling_friction]",
            "did you mean rolling_friction",
        ),
        ("low = 0.2", "low = 0.8", "is not below high"),
        ("low = 0.2", "low = -0.2", "give a value from 0"),
        ("low = 0.2", "low = nan", "give a finite number"),
        ("low = 0.2", "low = '0.2'", "give a value of type float"),
        ("low = 0.2", "", "incomplete"),
        ("sets = 14", "sets = 0", "give 1 or more"),
        ("sets = 14", "sets = 1.5", "give a value of type int"),
        ('design = "sobol"', 'design = "sobel"', "did you mean sobol"),
        ('name = "toy"', 'name = "../toy"', "plain word"),
        ('measured = "lab.csv"', 'measured = "no.csv"', "no lab file"),
        ('name = "toy"', 'name = "toy', "not valid TOML"),
        ("[run]", "[fixed]\nrolling_friction = 0.1\n[run]", "both calibrated and fixed"),
        ("[run]", "[fixed]\nseed = 1\n[run]", "seed cannot be fixed"),
        ("[run]", "[setups.ledge]\nneck_diameter = 0.01\n[run]", "unknown parameter of ledge"),
        (
            "[run]",
            '[targets."hourglass.bulk_densty"]\nweight = 1.0\n[run]',
            "did you mean hourglass.bulk_density",
        ),
    ],
)
def test_a_mistake_in_the_case_is_named_with_its_remedy(write_case, old, new, why):
    with pytest.raises(CalibratorError, match=why):
        read_case(write_case((old, new)))


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("1605.6", "nan", "give a finite value"),
        ("1605.6", "0", "give a finite value"),
        ("1605.6", "1.6 t", "plain numbers"),
        ("kg/m3", "g/cm3", "convert it to kg/m3"),
        ("bulk_density", "bulk_densiti", "did you mean bulk_density"),
        ("calibrate", "calibrated", "did you mean calibrate"),
        ("hourglass,mass_flow_rate", "ledge,mass_flow_rate", "does not measure"),
        ("role\n", "rolle\n", "header must be"),
        (",8,kg/s", ",0,kg/s", "replicates"),
        (
            "hourglass,mass_flow_rate,0.026,0.0001,8,kg/s",
            "hourglass,bulk_density,1,1,1,kg/m3",
            "more than once",
        ),
    ],
)
def test_a_mistake_in_the_lab_file_is_named_with_its_remedy(write_case, old, new, why):
    assert old in LAB
    with pytest.raises(CalibratorError, match=why):
        read_case(write_case(lab=LAB.replace(old, new)))
