"""A named effect as a new case: the old one, with the effect among its parameters."""

import dataclasses

import pytest

from calibrator.case.curve import curve_file
from calibrator.case.toml import read_case
from calibrator.case.vocabulary import EFFECTS
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.explanations import Effect
from calibrator.diagnosis.new_case import write_new_case
from calibrator.runs.workspace import Workspace
from tests.curve_world import photographed_heap
from tests.toy_laboratory import NUISANCES, lab

AWKWARD = """
name = "odd"
about = 'a "quoted" word, # no comment, and \\ two strokes'
measured = "lab.csv" # not the name
truth_file = "truth.toml"
[parameters.rolling_friction] # name = "x"
  low = 0.05 # a comment behind a value
  high = 0.45
[fixed]
young_modulus = 1e6
  bond_number = 0.0 # dry
[setups.hourglass]
bond_number = 0
neck_diameter = 14e-3
[conditions.shipped]
setup = "hourglass"
neck_diameter = 0.016
[targets."hourglass.bulk_density"]
tolerance = 0.01
[search]
objectives = ["error", "time_cost"]
[interpolation]
similarity = false
[diagnosis]
  nuisances = "nuisances.csv" # of the balance
effects = ["bond_number", "bed_viscosity"]
  shipped = "runs.csv"
[run]
  shipped = "runs.csv"
jobs = 1
"""


@pytest.mark.parametrize("name", ["odd", "o" * 64])
def test_the_new_case_is_the_old_one_with_the_effect_among_its_parameters(tmp_path, name):
    for file, text in (
        ("lab.csv", lab(bond_number=0.6)),
        ("nuisances.csv", NUISANCES),
        ("truth.toml", "[parameters]\nrolling_friction = 0.2\n"),
        ("runs.csv", ""),
        ("odd.toml", AWKWARD.replace('"odd"', f'"{name}"')),
    ):
        (tmp_path / file).write_text(text)
    case = read_case(tmp_path / "odd.toml")
    effect = next(e for e in ex.library(case) if e.name == "bond_number")
    path = write_new_case(Workspace(case, tmp_path / "results"), effect, 1.0, 0.2)
    new = read_case(path)
    assert new.name == ("odd" if name == "odd" else "o" * 47) + "_with_bond_number"
    assert new.problem.parameters[:-1] == case.problem.parameters
    added = new.problem.parameters[-1]
    assert added.name == "bond_number"
    assert (added.low, added.high) == pytest.approx((0.4 * effect.scale, 1.6 * effect.scale))
    assert new.problem.fixed == {"young_modulus": 1e6}
    assert new.problem.setups == {"hourglass": {"neck_diameter": 14e-3}}
    assert new.problem.held_out == case.problem.held_out
    assert [t.key for t in new.problem.targets] == [
        o.key for o in case.observables if o.role != "held_out"
    ]
    assert new.problem.targets[0].tolerance == 0.01
    assert [dataclasses.replace(o, role="diagnose") for o in new.observables] == [
        dataclasses.replace(o, role="diagnose") for o in case.observables
    ]
    for same in (
        "plan", "interpolation", "search", "verify", "validate", "cluster", "about", "conditions",
        "nuisances",
    ):  # fmt: skip
        assert getattr(new, same) == getattr(case, same), same
    assert new.run == dataclasses.replace(case.run, shipped="")
    assert dataclasses.replace(new.diagnosis, nuisances="") == dataclasses.replace(
        case.diagnosis, nuisances="", shipped=""
    )
    assert new.truth == {}
    for line in (
        "with adhesion, which a diagnosis named",
        "# Added: [parameters.bond_number].",
        "# Targets: 9 of 11 rows, 3 before",
        "# Taken out: fixed.bond_number = 0.0.",
        "# Taken out: setups.hourglass.bond_number = 0.",
    ):
        assert line in path.read_text()


@pytest.mark.parametrize("size", [-0.4, 0.0, 2.5])
def test_the_bounds_of_the_new_parameter_are_within_what_its_column_can_take(
    write_case, tmp_path, size
):
    case = read_case(write_case())
    column = EFFECTS["wall_friction_ratio"]
    effect = Effect("wall_friction_ratio", "+-", 0.1 + 0.2, least=-1 / (0.1 + 0.2))
    path = write_new_case(Workspace(case, tmp_path / "results"), effect, size, float("inf"))
    added = read_case(path).problem.parameters[-1]
    assert column.low <= added.low < added.high <= column.high


def test_the_new_case_keeps_the_old_one_s_curves(tmp_path):
    row = "conical_pile,,profile_height,heap.csv,,5,m,calibrate\n"
    for file, text in (
        ("lab.csv", lab(bond_number=0.6) + row),
        ("nuisances.csv", NUISANCES),
        ("truth.toml", "[parameters]\nrolling_friction = 0.2\n"),
        ("runs.csv", ""),
        ("odd.toml", AWKWARD),
        ("heap.csv", curve_file(photographed_heap())),
    ):
        (tmp_path / file).write_text(text)
    case = read_case(tmp_path / "odd.toml")
    effect = next(e for e in ex.library(case) if e.name == "bond_number")
    new = read_case(write_new_case(Workspace(case, tmp_path / "results"), effect, 1.0, 0.2))
    before, after = ([t for t in c.problem.targets if t.curve] for c in (case, new))
    assert len(before) == 1 and after == before
