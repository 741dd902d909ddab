"""`check` refuses what a later verb, or YADE's scripts, would refuse after hours of runs."""

import pytest

from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError
from calibrator.plan.run import collect, run_plan
from calibrator.runs.workspace import Workspace
from calibrator.search.calibrate import calibrate
from tests.conftest import LAB
from tests.stand_in import World, put_in_place
from tests.toy_laboratory import NUISANCES, SMALL, lab

ON_THE_LEDGE = LAB.replace("deg,held_out", "deg,calibrate", 1)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("box_width = 12e-3", "box_width = 5e-3", "ledge: box_width must be at least three grain"),
        ("neck_diameter = 16e-3", "neck_diameter = 1.9e-3", "neck_diameter is below a grain"),
        ("neck_diameter = 16e-3", "neck_diameter = 28e-3", "must be smaller than cylinder_diam"),
        ("cylinder_diameter = 34e-3", "cylinder_diameter = 2e-3", "conical_pile: no grain fits"),
        ("box_length = 30e-3", "box_length = 2e-3", "ledge: no grain fits into the vessel"),
        ("sets = 14", "sets = 3", "was measured at 3 distinct points: give at least 5 for 3"),
        ("[run]", '[interpolation]\nmethod = "multilinear"\n[run]', "needs a full grid"),
        ("[run]", "[interpolation]\nsimilarity = true\n[run]", "needs both particle_density and"),
        ("[search]", '[search]\nobjectives = ["error", "tim_cost"]', "did you mean time_cost"),
        ("[verify]", '[verify]\nshipped = "gone.csv"', "cannot read the database"),
        (
            "[setups.ledge]\nbox_length = 30e-3\nbox_width = 12e-3",
            "[parameters.box_width]\nlow = 1e-2\nhigh = 2e-2\n[setups.ledge]",
            "box_width is no parameter of hourglass",
        ),
        ("[fixed]", "[fixed]\nsize_spread = 0.1\nclump_aspect = 1.2", "cannot be combined"),
    ],
)
def test_what_cannot_work_is_refused_before_a_run_is_made(checked, old, new, why):
    with pytest.raises(CalibratorError, match=why):
        checked((old, new))


def test_every_corner_of_the_box_is_looked_at(checked):
    """At the middle of the box, and at the first set of the plan, these vessels would do."""
    radius = ("[fixed]\nparticle_radius = 1e-3", "[parameters.particle_radius]\nlow = 0.2e-3\n"
              "high = 2.5e-3\n[fixed]")  # fmt: skip
    with pytest.raises(CalibratorError) as caught:
        checked(radius, ("neck_diameter = 16e-3", "neck_diameter = 4e-3"))
    assert "2 mistakes:" in str(caught.value)
    assert "hourglass at particle_radius = 0.0025: neck_diameter is below" in str(caught.value)
    assert "ledge at particle_radius = 0.0025: box_width must be at least" in str(caught.value)


def test_a_set_up_that_takes_none_of_the_parameters_cannot_be_calibrated_on(write_case, checked):
    neck = "[parameters.neck_diameter]\nlow = 12e-3\nhigh = 16e-3"
    changes = [
        (f"[parameters.{name}]\nlow = {low}\nhigh = {high}\nsamples = {n}\n", "")
        for name, low, high, n in (
            ("rolling_friction", 0.05, 0.45, 4),
            ("sliding_friction", 0.2, 0.7, 4),
        )
    ]
    modulus = "[parameters.young_modulus]\nlow = 0.5e6\nhigh = 4e6\nsamples = 2"
    with pytest.raises(CalibratorError, match="ledge has none of the calibrated parameters"):
        checked(*changes, (modulus, neck), ("neck_diameter = 16e-3\n", ""), lab=ON_THE_LEDGE)


def test_a_grid_that_similarity_spoils_is_refused(checked):
    density = "[parameters.particle_density]\nlow = 2600\nhigh = 2700\nsamples = 2\n[fixed]"
    method = '[interpolation]\nmethod = "multilinear"\nsimilarity = true\n[run]'
    with pytest.raises(CalibratorError, match="one with holes"):
        checked(
            ('design = "sobol"', 'design = "grid"'),
            ("[fixed]", density),
            ("particle_density = 2650.0\n", ""),
            ("[run]", method),
        )


def test_a_condition_that_fixes_what_similarity_needs_is_refused(checked):
    density = "[parameters.particle_density]\nlow = 2600\nhigh = 2700\n[fixed]"
    soft = '[conditions.soft]\nsetup = "hourglass"\nyoung_modulus = 1e6\n'
    rows = [line.replace(",", ",,", 1) for line in LAB.splitlines()[2:]]
    rows.append(rows[2].replace(",,", ",soft,"))
    head = "setup,condition,response,value,scatter,replicates,unit,role"
    with pytest.raises(CalibratorError, match="needs both particle_density and young_modulus"):
        checked(
            ("[fixed]", density),
            ("particle_density = 2650.0\n", ""),
            ("[run]", f"[interpolation]\nsimilarity = true\n{soft}[run]"),
            lab="\n".join([head, *rows]) + "\n",
        )


def test_a_bulk_density_above_that_of_the_grains_is_refused(checked):
    with pytest.raises(CalibratorError, match="above the density of the grains, 2650"):
        checked(lab=LAB.replace("1605.6", "2700"))


def test_everything_that_cannot_work_is_said_at_once(checked):
    with pytest.raises(CalibratorError) as caught:
        checked(
            ("box_width = 12e-3", "box_width = 5e-3"),
            ("neck_diameter = 16e-3", "neck_diameter = 1.9e-3"),
            ("sets = 14", "sets = 3"),
            ("[verify]", "[validate]\nseed = 500000\n[verify]"),
            lab=LAB.replace("1605.6", "2700"),
        )
    assert len(caught.value.messages) == 5


def test_check_and_calibrate_refuse_too_few_sets_in_the_same_words(
    write_case, tmp_path, monkeypatch, checked
):
    with pytest.raises(CalibratorError) as caught:
        checked(("sets = 14", "sets = 3"))
    put_in_place(monkeypatch, World())
    space = Workspace(read_case(write_case(("sets = 14", "sets = 3"))), tmp_path / "late")
    run_plan(space)
    collect(space)
    with pytest.raises(CalibratorError) as late:
        calibrate(space)
    assert str(late.value) in str(caught.value)


def test_a_response_that_no_run_has_is_named_with_its_set_up(write_case, tmp_path, monkeypatch):
    def without_rate(setup, p, seed):
        return {"bulk_density": 1500.0 + seed % 7, "drained_equivalent_angle_deg": 40.0}

    put_in_place(monkeypatch, World(responses_of=without_rate))
    space = Workspace(read_case(write_case()), tmp_path / "results")
    run_plan(space)
    with pytest.raises(CalibratorError, match="no good run of hourglass has measured mass_flow_ra"):
        calibrate(space)


@pytest.mark.parametrize(
    ("change", "nuisances", "why"),
    [
        (
            ("sets = 12\nreplicates = 2", "sets = 4\nreplicates = 1"),
            NUISANCES,
            r"diagnosis.sets = 4 is too few .*: raise it to 18",
        ),
        (("neck_diameter = 0.016", "neck_diameter = 0.001"), NUISANCES, "@wide_neck: neck_diamet"),
        (
            ("neck_diameter = 0.016", "size_spread = 0.2"),
            NUISANCES.replace("effect:bed_viscosity,1e-6,Pa s", "effect:tilt_deg,0.1,deg"),
            "nuisance neck is a small tilt_deg, which diagnosis.effects lacks",
        ),
    ],
)
def test_what_a_diagnosis_would_refuse_is_refused(checked, tmp_path, change, nuisances, why):
    (tmp_path / "nuisances.csv").write_text(nuisances)
    with pytest.raises(CalibratorError, match=why):
        checked(SMALL, change, lab=lab(conditions=True))
