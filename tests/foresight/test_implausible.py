"""`check` doubts what can be run and is hardly meant, with numbers and what to do."""

import pytest

from calibrator.case.toml import read_case
from calibrator.check import Checked, check_case
from calibrator.errors import CalibratorError
from calibrator.plan.requests import make_request
from calibrator.runs.workspace import Workspace
from tests.conftest import LAB

DENSITY = '[targets."hourglass.bulk_density"]\n'


def test_a_plausible_case_is_not_doubted(checked):
    said = checked().warnings
    assert [w for w in said if not w.startswith("YADE fake is new here")] == []


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[run]", f"{DENSITY}tolerance = 3\n[run]", "write tolerance = 0.03"),
        ("[run]", f"{DENSITY}tolerance = 1\n[run]", "write tolerance = 0.01"),
        ("low = 0.5e6", "low = 1e4", 'set scale = "log"'),
        ("low = 0.5e6", "low = 1e4", "press grains into each other by 22% of their radius"),
        ('"sobol"', '"adaptive"\nmost_runs = 16', "the 16 runs that an adaptive design"),
        ("fill_mass = 20e-3", "fill_mass = 1.6", "longer than longest_time = 5 s"),
        ("high = 4e6", "high = 63e9", "young_modulus = 6.3e+10 Pa takes"),
        ("neck_diameter = 16e-3", "neck_diameter = 10e-3", "neck has 5 grain diameters, below 7"),
        ("cylinder_diameter = 34e-3", "cylinder_diameter = 10e-3", "= 0.01 m is 5.0 grain"),
        ("box_width = 12e-3", "box_width = 8e-3", "ledge: box_width = 0.008 m is 4.0 grain"),
        ("fill_mass = 20e-3", "fill_mass = 1.2e-3", "a run has 108 grains, below 200"),
        ("fill_mass = 20e-3", "fill_mass = 5e-3", "lower than the orifice of 16 mm"),
        ("lift_height = 22e-3", "lift_height = 1e-3", "raise lift_height"),
        ("replicates = 2", "replicates = 1", "the scatter of single runs stays unknown"),
        ("replicates = 4", "replicates = 1", "a single fresh run may pass or miss by luck"),
        ("fill_mass = 20e-3\n", "", "does not give fill_mass = 0.016 kg, the demo's vessel"),
        ("particle_radius = 1e-3\n", "", "does not give particle_radius, the default 0.001 m"),
        ("[parameters.sliding_friction]\nlow = 0.2\nhigh = 0.7\nsamples = 4\n", "",
         "does not give sliding_friction, the default 0.4 stands in"),
        ("[run]", "[run]\nbudget_core_hours = 0.001", "`run` will refuse: 28 runs would take"),
        ("[parameters.rolling", "[parameters.poisson_ratio]\nlow = 0.1\nhigh = 0.3\n"
         "[parameters.rolling", "4 parameters for 3 independent targets: they"),
    ],
)  # fmt: skip
def test_what_is_hardly_meant_is_doubted(checked, old, new, words):
    assert any(words in warning for warning in checked((old, new)).warnings)


def test_a_wrong_unit_is_named_beside_what_it_makes_impossible(checked):
    for old, new, refused, doubted in (
        ("radius = 1e-3", "radius = 1", "neck_diameter must be", "2000 mm; if mm are meant, write"),
        ("2650.0", "2.65", "above the density of the grains", "if it is in g/cm3, write 2650"),
    ):
        with pytest.raises(CalibratorError, match=refused) as caught:
            checked((old, new))
        assert doubted in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("1605.6", "1.605", "if it is in g/cm3, or its point separates thousands, write 1605"),
        ("1605.6", "2300", "denser than equal spheres can be packed"),
        ("0.026", "26", "Beverloo's law gives about"),
        ("mass_flow_rate,0.026,0.0001,8,kg/s", "discharge_time,6.5,,8,s", "raise longest_time"),
        ("mass_flow_rate,0.026,0.0001,8,kg/s", "residual_mass,5,,8,kg", "more than was filled in"),
        (
            "hourglass,mass_flow_rate,0.026,0.0001,8,kg/s",
            "hourglass,residual_fraction,0.3,0.01,8,1",
            "3 parameters for 2 independent targets",
        ),
        ("1605.6,5,8", "1605.6,,1", "hourglass.bulk_density: no scatter is given"),
        ("held_out", "diagnose", "no row is held out, so `validate` has nothing to predict"),
    ],
)
def test_a_measurement_that_is_hardly_meant_is_doubted(checked, old, new, words):
    assert any(words in warning for warning in checked(lab=LAB.replace(old, new)).warnings)


def test_the_price_of_stiff_grains_is_said_beside_that_of_softer_ones(checked):
    (warning,) = [w for w in checked(("high = 4e6", "high = 63e9")).warnings if "takes" in w]
    assert "core-hours a run, 1e+07 Pa" in warning and "steps" in warning and "lower it" in warning


def test_every_value_is_listed_with_where_it_comes_from(checked):
    condition = '[conditions.wide]\nsetup = "hourglass"\nneck_diameter = 0.018\n[run]'
    found = checked(("[run]", condition))
    values = found.values
    assert values["hourglass"]["rolling_friction"].value == (0.05, 0.45)
    assert values["hourglass"]["rolling_friction"].source == "calibrated"
    assert values["ledge"]["box_width"].source == "[setups.ledge]"
    assert values["ledge"]["particle_radius"].source == "[fixed]"
    assert values["conical_pile"]["poisson_ratio"].source == "default"
    wide = values["hourglass@wide"]["neck_diameter"]
    assert (wide.value, wide.source) == (0.018, "[conditions.wide]")
    said = "\n".join(found.lines())
    for words in (
        "every set-up, calibrated: rolling_friction 0.05 to 0.45, sliding_friction 0.2 to 0.7",
        "every set-up, [fixed]: particle_radius 0.001 m, particle_density 2650 kg/m3",
        "poisson_ratio 0.3",
        "ledge, [setups.ledge]: box_length 0.03 m, box_width 0.012 m, fill_height 0.02 m",
        "hourglass@wide, [conditions.wide]: neck_diameter 0.018 m",
    ):
        assert words in said
    assert said.count("poisson_ratio") == 1 and said.count("neck_diameter") == 2


def test_the_values_are_those_of_the_requests(checked, tmp_path):
    """Else the list would say one thing and the runs do another."""
    found = checked()
    case = read_case(tmp_path / "toy.toml")
    for setup, own in found.values.items():
        request = make_request(case, setup, case.problem.low, 1)
        lowest = {n: r.value[0] if isinstance(r.value, tuple) else r.value for n, r in own.items()}
        assert {**lowest, "seed": 1} == request.parameters


def test_what_check_found_can_be_read_back(checked, tmp_path):
    found = checked()
    space = Workspace(read_case(tmp_path / "toy.toml"), tmp_path)
    assert space.outcome("check", Checked) == found == check_case(space)


DRUM = """[setups.rotating_drum]
drum_diameter = 45e-3
drum_depth = 12e-3
drum_fill_mass = 9e-3
rotation_rpm = 30
longest_time = 20
"""


@pytest.mark.parametrize(
    ("more", "said"),
    [("", []), ("fill_fraction = 0.4\n", ["fill_fraction changes nothing beside drum_fill_mass"])],
)
def test_a_drum_is_filled_by_mass_or_by_share(checked, more, said):
    rows = "rotating_drum,drum_angle_deg,38,0.6,3,deg,calibrate\n"
    head = "setup,response,value,scatter,replicates,unit,role\n"
    found = checked(("[run]", DRUM + more + "[run]"), lab=head + rows).warnings
    assert [w for w in found if "fill_fraction" in w] == [
        f"rotating_drum: {words}; remove one of them" for words in said
    ]
    assert not any("every target is an angle" in w for w in found)
