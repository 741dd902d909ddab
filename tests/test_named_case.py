"""A named case is used like any other: run, calibrated, diagnosed again."""

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.diagnosis.diagnose import diagnose
from calibrator.diagnosis.runs import prepare
from calibrator.diagnosis.verdict import judge
from calibrator.errors import CalibratorError
from calibrator.plan.requests import plan_requests
from calibrator.plan.run import run_plan
from calibrator.runs.record import Record
from calibrator.runs.workspace import Workspace
from calibrator.search.calibrate import calibrate
from tests.stand_in import World, put_in_place
from tests.toy_laboratory import NUISANCES, SMALL, lab

DRIED = """[conditions.dried]
setup = "conical_pile"
bond_number = 0.0
[diagnosis]"""
MOIST = 0.6


def lab_with_dried(**hidden):
    """The laboratory of the toy case, with the heap once more from dried sand."""
    dry = [r for r in lab().splitlines() if r.startswith("conical_pile")]
    again = [r.replace("pile,,", "pile,dried,").replace("held_out", "diagnose") for r in dry]
    return "\n".join([*lab(**hidden).splitlines(), *again]) + "\n"


@pytest.fixture
def stand_in(monkeypatch):
    return put_in_place(monkeypatch, World())


def test_a_named_case_is_calibrated_on_all_rows_and_diagnosed_again_without_a_gap(
    write_case, tmp_path, stand_in
):
    (tmp_path / "nuisances.csv").write_text(
        NUISANCES + "a little moisture,effect:bond_number,1e-3,1\n"
    )
    changes = (SMALL[0], SMALL[1].replace("[diagnosis]", DRIED).replace("= 12", "= 16"))
    case = read_case(write_case(changes, lab=lab_with_dried(bond_number=MOIST)))
    first = diagnose(Workspace(case, tmp_path / "results" / case.name))
    assert (first.verdict, first.effects) == ("named", ("bond_number",))

    new = read_case(first.new_case)
    again = Workspace(new, tmp_path / "results" / new.name)
    assert main(["check", first.new_case, "--results", str(tmp_path / "results")]) == 0
    # all rows of the diagnosis, those of dried sand too; those held out stay what they are
    assert len(case.problem.targets) == 3 and len(new.problem.targets) == 12
    assert {t.key for t in new.problem.targets} == {
        o.key for o in case.observables if o.role != "held_out"
    }
    assert new.problem.held_out == case.problem.held_out
    dry = [r for r in plan_requests(new) if "bond_number" not in r.parameters]
    assert len(dry) == len(plan_requests(new)) // 4  # that of one of four experiments
    run_plan(again)
    found = calibrate(again)
    assert found.compromise.parameters["bond_number"] == pytest.approx(MOIST, abs=0.1)
    second = diagnose(again)
    assert second.verdict == "no gap"
    assert any("adhesion (bond_number) is not looked for" in note for note in second.notes)
    dried = {row.key for row in second.observables if "@dried" in row.key}
    assert len(dried) == 3


def by_hand(parameters="", conditions="", diagnosis="", sets=24):
    """The toy case's diagnosis as a user may edit it; sets are enough for all that is asked."""
    own = SMALL[1].replace("[conditions.wide_neck]", f"{parameters}{conditions}{SMALL_HEAD}")
    own = own.replace("sets = 12", f"sets = {sets}\nbudget_core_hours = 1e6")
    return SMALL[0], own.replace('["bond_number", "bed_viscosity"]', diagnosis or DEFAULT)


SMALL_HEAD = "[conditions.wide_neck]"
DEFAULT = '["bond_number", "bed_viscosity"]'
ADHESION = "[parameters.bond_number]\nlow = 0.3\nhigh = 0.9\n"
SLICK = """[conditions.dried]
setup = "conical_pile"
bond_number = 0.4
sliding_friction = 0.3
young_modulus = 1e6
"""


def in_memory(space, requests, yes, report):
    """Records of runs that nobody wrote to a file."""
    made = {r.run_id: World().record(r) for r in requests}
    return {r.run_id: Record(r, "ok", made[r.run_id]["responses"]) for r in requests}


def test_a_case_whose_every_effect_is_calibrated_is_still_tested_for_a_gap(
    write_case, tmp_path, monkeypatch
):
    (tmp_path / "nuisances.csv").write_text(NUISANCES.replace("neck,effect:bed_viscosity", "#"))
    for module in ("runs", "confirm"):
        monkeypatch.setattr(f"calibrator.diagnosis.{module}.carried_out", in_memory)
    changes = by_hand(ADHESION, diagnosis='["bond_number"]')
    case = read_case(write_case(changes, lab=lab(bond_number=MOIST)))
    assert diagnose(Workspace(case, tmp_path / "results")).verdict == "no gap"


@pytest.mark.parametrize(
    ("parameters", "conditions", "diagnosis"),
    [
        # a condition fixes what is calibrated, outside its bounds, and an effect off its default
        (ADHESION, SLICK.replace("0.4", "0.0"), ""),
        ("", SLICK, ""),
        # nothing is left to look for
        (ADHESION, SLICK, '["bond_number"]'),
        # the case says of an effect what it is
        ("[setups.ledge]\nbond_number = 0.2\n", SLICK, ""),
    ],
)
def test_a_case_edited_by_hand_is_diagnosed(
    write_case, tmp_path, monkeypatch, parameters, conditions, diagnosis
):
    (tmp_path / "nuisances.csv").write_text(NUISANCES.replace("neck,effect:bed_viscosity", "#"))
    changes = by_hand(parameters, conditions, diagnosis)
    case = read_case(write_case(changes, lab=lab_with_dried()))
    monkeypatch.setattr("calibrator.diagnosis.runs.carried_out", in_memory)
    scene = prepare(Workspace(case, tmp_path / "results"), case.observables, yes=True)
    verdict = judge(
        scene.surfaces, scene.measured, scene.effects, scene.used, np.random.default_rng(1)
    )
    assert verdict.kind
    own = [i for i, o in enumerate(scene.observables) if o.condition == "dried"]
    unit, none = np.full(scene.surfaces.dimensions, 0.5), np.zeros(len(scene.effects))
    slopes = scene.surfaces.jacobian(unit, none)[own]
    names = [*case.problem.names, *(e.name for e in scene.effects)]
    held = [names.index(n) for n in case.conditions["dried"].values if n in names]
    assert (slopes[:, held] == 0).all() and (slopes[:, names.index("rolling_friction")] != 0).any()


@pytest.mark.parametrize(
    ("changes", "nuisance", "said"),
    [
        (by_hand(ADHESION, SLICK, sets=4), "", "raise it to 21"),
        (
            by_hand("[setups.ledge]\nbond_number = 0.2\n", SLICK),
            "moisture,effect:bond_number,0.1,1\n",
            "nuisance moisture: adhesion (bond_number) is not looked for: it is fixed",
        ),
        (
            by_hand(
                "[parameters.clump_aspect]\nlow = 1.1\nhigh = 1.3\n",
                SLICK.replace("bond_number = 0.4", "size_spread = 0.2"),
            ),
            "",
            "conical_pile@dried: clump_aspect and size_spread cannot be combined",
        ),
    ],
)
def test_what_cannot_be_diagnosed_is_one_clear_line_before_any_run(
    write_case, tmp_path, stand_in, capsys, changes, nuisance, said
):
    (tmp_path / "nuisances.csv").write_text(NUISANCES + nuisance)
    path = write_case(changes, lab=lab_with_dried())
    assert main(["check", str(path), "--results", str(tmp_path / "results")]) == 2
    refusal = capsys.readouterr().err
    assert said in refusal and len(refusal.splitlines()) == 1
    case = read_case(path)
    with pytest.raises(CalibratorError, match=r"diagnosis\.sets|nuisance|cannot be combined"):
        prepare(Workspace(case, tmp_path / "results" / "toy"), case.observables, yes=True)
    assert not stand_in.made
