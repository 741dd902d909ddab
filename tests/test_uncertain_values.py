"""A value that the case fixes and the laboratory's grains do not have: no missing effect."""

import pytest

from calibrator.case.toml import read_case
from calibrator.diagnosis.diagnose import diagnose
from calibrator.diagnosis.runs import asked
from calibrator.diagnosis.uncertain import uncertain
from calibrator.errors import CalibratorError
from calibrator.runs.workspace import Workspace
from tests import fake_yade
from tests.stand_in import World, put_in_place
from tests.toy_laboratory import NUISANCES, SMALL, TRUTH, lab

FIXED, TRUE = 0.9, 0.7
ROW = "restitution of the grains,fixed:restitution,0.1,1\n"


def bouncing(setup, p, seed=0):
    """Responses that the restitution moves, in a direction that no parameter or effect has."""
    found = fake_yade.responses_of(setup, p)
    softer = FIXED - p.get("restitution", FIXED)
    shares = {"bulk_density": 0.05, "late_early_ratio": -0.4, "ledge_curvature": 0.6}
    return {n: v * (1 + shares.get(n, 0.15) * softer) for n, v in found.items()}


def damped_lab():
    """The toy laboratory's measurements with grains of lower restitution."""
    rows = lab().splitlines()
    p = {**TRUTH, "restitution": TRUE}
    for i, row in enumerate(rows[1:], 1):
        setup, condition, name, value, *rest = row.split(",")
        there = bouncing(setup, p)[name] / fake_yade.responses_of(setup, p)[name]
        rows[i] = ",".join([setup, condition, name, repr(float(value) * there), *rest])
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize("row", [ROW, "restitution,fixed:restitution,11,%\n"])
def test_a_stated_error_of_a_fixed_value_is_no_gap(write_case, tmp_path, monkeypatch, row):
    put_in_place(monkeypatch, World(bouncing))
    (tmp_path / "nuisances.csv").write_text(NUISANCES + row)
    case = read_case(write_case(SMALL, lab=damped_lab()))
    found = diagnose(Workspace(case, tmp_path / "results"))
    assert found.verdict == "no gap"


def test_without_it_there_is_a_gap_and_too_small_an_error_is_said_to_be_too_small(
    write_case, tmp_path, monkeypatch
):
    put_in_place(monkeypatch, World(bouncing))
    (tmp_path / "nuisances.csv").write_text(NUISANCES + ROW.replace("0.1", "0.02"))
    case = read_case(write_case(SMALL, lab=damped_lab()))
    found = diagnose(Workspace(case, tmp_path / "results"))
    assert found.verdict in ("unknown", "ambiguous", "out of bounds")
    (error,) = (e for e in found.errors if e.name.startswith("restitution"))
    assert error.needed == pytest.approx(TRUE - FIXED, abs=0.05)


def test_an_uncertain_value_is_no_candidate_and_adds_its_own_runs_only(write_case, tmp_path):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    before = asked(case := read_case(write_case(SMALL, lab=lab())), case.observables)
    (tmp_path / "nuisances.csv").write_text(NUISANCES + ROW)
    after = asked(case := read_case(write_case(SMALL, lab=lab())), case.observables)
    assert after.effects == before.effects
    old = {r.run_id for r in before.requests}
    new = [r for r in after.requests if r.run_id not in old]
    assert len(after.requests) == len(old) + 3 * case.diagnosis.effect_sets == len(old) + len(new)
    values = {r.parameters["restitution"] for r in new}
    assert min(values) < FIXED - 0.3 and max(values) == 0.95  # no further than a run may go


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("grains,fixed:restitutoin,0.1,1\n", "restitution"),
        ("grains,fixed:restitution,0.1,kg\n", "has to be in 1"),
        ("grains,fixed:bond_number,0.1,1\n", "write effect:bond_number"),
        ("spring,fixed:rolling_spring,0.1,1\n", "nothing that a laboratory could be wrong about"),
        ("width,fixed:silo.cylinder_diameter,1e-4,m\n", "set-up"),
    ],
)
def test_a_row_that_names_no_fixed_number_is_refused(write_case, tmp_path, row, said):
    (tmp_path / "nuisances.csv").write_text(NUISANCES + row)
    with pytest.raises(CalibratorError, match=said):
        read_case(write_case(SMALL, lab=lab()))


def test_the_width_of_one_vessel_concerns_that_set_up_alone(write_case, tmp_path):
    row = "width,fixed:hourglass.cylinder_diameter,1,%\n"
    (tmp_path / "nuisances.csv").write_text(NUISANCES + row)
    case = read_case(write_case(SMALL, lab=lab()))
    (one,) = uncertain(case)
    assert one.setups == ("hourglass",) and one.scale == pytest.approx(0.03 * one.base)
    (tmp_path / "nuisances.csv").write_text(NUISANCES + row.replace("hourglass", "ledge"))
    with pytest.raises(CalibratorError, match="fixes no number"):
        uncertain(read_case(write_case(SMALL, lab=lab())))


def test_what_is_calibrated_is_not_uncertain(write_case, tmp_path):
    (tmp_path / "nuisances.csv").write_text(NUISANCES + "E,fixed:young_modulus,10,%\n")
    case = read_case(write_case(SMALL, lab=lab()))
    assert "young_modulus" in case.problem.names and uncertain(case) == []
