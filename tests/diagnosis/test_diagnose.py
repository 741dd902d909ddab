"""`diagnose` from end to end, on the fake YADE, whose formulas know adhesion and drag."""

import json
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest

from calibrator.case.lab import read_lab
from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.basis import diagnosis_now
from calibrator.diagnosis.diagnose import _refutation, confirmed, diagnose
from calibrator.diagnosis.explanations import Effect
from calibrator.diagnosis.outcome import Diagnosis
from calibrator.diagnosis.verdict import FIXED
from calibrator.errors import CalibratorError
from calibrator.plan import seeds
from calibrator.plan.seeds import CONFIRM_SEED
from calibrator.report.diagnosis import write_diagnosis
from calibrator.runs.workspace import Workspace
from calibrator.summary import schema
from tests.toy_laboratory import NUISANCES, SMALL, lab

REPO = Path(__file__).resolve().parents[2]


def test_a_hidden_effect_is_named_and_the_gap_closes_also_on_data_that_were_held_out(
    space, tmp_path, capsys
):
    here = space(bond_number=0.6)
    found = diagnose(here)
    assert (found.verdict, found.effects) == ("named", ("bond_number",))
    before, after = found.explanations[:2]
    size = after.amplitudes["bond_number"]
    assert abs(size.value - 0.6) < 4 * size.error
    assert before.gap_used > 2 * after.gap_used and before.gap_held_out > 2 * after.gap_held_out
    for part in (
        "adhesion (bond_number = ",
        "held-out data",
        "a random effect would remove",
        "refuted if",
    ):
        assert part in found.sentence
    calls = (here.path / "calls.txt").read_text().count("\n")
    assert here.outcome("diagnose", Diagnosis) == found
    jsonschema.validate(json.loads((here.path / "summary.json").read_text()), schema())
    assert diagnose(here) == found
    assert (here.path / "calls.txt").read_text().count("\n") == calls  # nothing is run twice
    case = read_case(found.new_case)
    assert case.problem.names[-1] == "bond_number"
    assert case.problem.low[-1] < 0.6 < case.problem.high[-1]
    assert main(["check", found.new_case, "--results", str(tmp_path / "again")]) == 0


def test_a_name_that_does_not_predict_the_held_out_rows_is_taken_back_and_said_so(
    write_case, fake_yade, tmp_path
):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    rows = [row.split(",") for row in lab(bond_number=0.6).splitlines()]
    for row in rows[1:]:
        if row[-1] == "held_out":
            row[3] = repr(1.5 * float(row[3]))
    case = read_case(write_case(SMALL, lab="\n".join(map(",".join, rows)) + "\n"))
    found = diagnose(Workspace(case, tmp_path / "results" / "toy"))
    assert (found.verdict, found.effects) == ("ambiguous", ("bond_number", "unknown"))
    assert found.new_case == ""
    assert any("does not predict those held out" in note for note in found.notes)


@pytest.mark.parametrize(("index", "name"), [(0, ""), (1, "bond_number"), (2, "bed_viscosity")])
def test_an_effect_that_clogs_in_the_confirming_runs_is_left_out_and_no_name(space, index, name):
    here, clogs = space(bond_number=0.6), {}
    first = here.case.diagnosis.seed + CONFIRM_SEED + seeds.SET_STRIDE * index
    for j in range(here.case.diagnosis.verify_replicates):
        clogs[str(first + j)] = "clog"  # the hourglass comes first
    here.path.mkdir(parents=True, exist_ok=True)
    (here.path / "misbehave.json").write_text(json.dumps(clogs))
    if not name:  # the model as it is
        with pytest.raises(CalibratorError, match="no fresh run of hourglass"):
            diagnose(here)
        return
    found = diagnose(here)
    named = ("named", ("bond_number",)) if index == 2 else ("ambiguous", ("bond_number", "unknown"))
    assert (found.verdict, found.effects) == named
    assert any(f"{name} could not be run" in note for note in found.notes)
    assert all(one.effects != (name,) for one in found.explanations)
    assert bool(found.new_case) is (index == 2)


def fresh(*effects, gap=1.0, p=0.5, held=1.0, scatter=0.5):
    return SimpleNamespace(
        effects=effects,
        gap_used=gap,
        fresh_probability=p,
        gap_held_out=held,
        floor_held_out=1.0,
        most_scattered="conical_pile.pile_equivalent_angle_deg",
        scatter_probability=scatter,
    )


@pytest.mark.parametrize(
    ("runs", "kind"),
    [
        ([fresh(gap=3.0), fresh("bond_number")], "named"),
        # the gap shrinks, and stays
        ([fresh(gap=3.0), fresh("bond_number", gap=2.0, p=1e-9)], "ambiguous"),
        ([fresh(gap=1.2), fresh("bond_number", gap=1.3)], "ambiguous"),
        ([fresh(gap=3.0), fresh("tilt_deg")], "ambiguous"),  # all runs of the named one failed
        # held out it grows: by chance, or from 1.1 to 8.3 as heaps do that stand as columns
        ([fresh(gap=3.0, held=1.1), fresh("bond_number", held=1.6)], "named"),
        ([fresh(gap=3.0, held=None), fresh("bond_number", held=None)], "named"),
        ([fresh(gap=3.0, held=1.1), fresh("bond_number", held=8.3)], "ambiguous"),
        # one heap stands and the next falls
        ([fresh(gap=3.0), fresh("bond_number", scatter=1e-6)], "ambiguous"),
    ],
)
def test_a_name_needs_fresh_runs_that_meet_the_measurements(runs, kind):
    verdict = SimpleNamespace(kind="named", effects=("bond_number",))
    names = ("bond_number",) if kind == "named" else ("bond_number", "unknown")
    assert confirmed(verdict, runs) == (kind, names)


def test_a_fixed_value_that_would_do_as_well_is_said_with_its_size():
    library = [Effect("bed_viscosity", "+", 1e-3), Effect("bond_number", "+", 0.3)]
    restitution = Effect("restitution", "+-", 0.3, base=0.9, nuisance="fixed:restitution")
    scene = SimpleNamespace(effects=library, uncertain=[restitution])
    other = SimpleNamespace(effects=("restitution",), amplitude=np.array([0.0, 0.0, -1.0]))
    effects = ("bed_viscosity", FIXED)
    verdict = SimpleNamespace(kind="ambiguous", effects=effects, fixed=other, best=None)
    (note,) = _refutation(scene, verdict, [])
    assert "air drag" in note and "a restitution of 0.6 where the case fixes 0.9" in note


def test_where_nothing_is_hidden_no_gap_is_reported_with_what_would_have_been_seen(space):
    found = diagnose(space())
    assert found.verdict == "no gap"
    assert "would have been seen" in found.sentence and "adhesion of" in found.sentence


def test_five_numbers_against_three_parameters_cannot_tell_and_cost_no_run(
    write_case, fake_yade, tmp_path
):
    space = Workspace(read_case(write_case()), tmp_path / "results" / "toy")
    found = diagnose(space)
    assert found.verdict == "cannot tell" and "measure at least 5 more" in found.sentence
    assert not (space.path / "calls.txt").exists()
    assert space.current("diagnose", Diagnosis, diagnosis_now(space)) == found
    jsonschema.validate(json.loads((space.path / "summary.json").read_text()), schema())
    assert "measure at least 5 more" in Path(write_diagnosis(space, found)).read_text()


def test_check_says_what_the_lab_file_lacks_for_a_diagnosis_and_takes_another_one(
    space, tmp_path, capsys
):
    here, few = space(), tmp_path / "few.csv"
    head, *rows = lab().splitlines()
    once = [
        row.replace(",5,", ",1,")
        for row in rows
        if row.startswith("hourglass") and "held_out" not in row
    ]
    few.write_text("\n".join([head, *once]) + "\n")
    arguments = ["check", str(here.case.path), "--results", str(tmp_path / "results")]
    assert (
        main(arguments) == 0
        and "warning: nothing is measured under wide_neck" in capsys.readouterr().out
    )
    assert main([*arguments, "--lab", str(few)]) == 0
    said = capsys.readouterr().out
    for part in (
        "needs 3 more rows",
        "no row is held out",
        "under wide_neck",
        "5 rows are measured once only",
    ):
        assert part in said
    assert main([*arguments, "--lab", str(tmp_path / "none.csv")]) == 2
    assert "no lab file" in capsys.readouterr().err


def test_a_diagnosis_of_another_lab_file_writes_a_new_case_with_that_file(space, tmp_path, capsys):
    here, moist = space(), tmp_path / "moist.csv"
    moist.write_text(lab(bond_number=0.6))
    assert (
        main(
            [
                "diagnose",
                str(here.case.path),
                "--results",
                str(tmp_path / "results"),
                "--lab",
                str(moist),
            ]
        )
        == 0
    )
    assert "The missing effect is adhesion" in capsys.readouterr().out
    (new,) = (here.path / "with_effect").glob("*.toml")
    measured = [(o.key, o.value) for o in read_case(new).observables]
    assert measured == [(o.key, o.value) for o in read_lab(moist)]


def test_runs_that_could_not_be_used_are_told_with_what_became_of_them(space):
    here = space()
    here.path.mkdir(parents=True)
    (here.path / "misbehave.json").write_text(json.dumps({"700000": "clog", "700001": "clog"}))
    assert "2 of 52 runs of hourglass are left out: 2 clogged" in diagnose(here).notes


def test_runs_beyond_the_budget_are_made_only_when_the_user_agrees(write_case, fake_yade, tmp_path):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    dear = (SMALL[0], SMALL[1].replace("[diagnosis]", "[diagnosis]\nbudget_core_hours = 0.0"))
    space = Workspace(read_case(write_case(dear, lab=lab())), tmp_path / "results" / "toy")
    with pytest.raises(CalibratorError, match="call again with --yes"):
        diagnose(space)
    assert not (space.path / "calls.txt").exists()


def test_a_condition_that_takes_an_effect_away_has_no_runs_with_it_and_does_not_feel_it(
    write_case, fake_yade, tmp_path
):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    dried = SMALL[1].replace(
        "[diagnosis]", '[conditions.dried]\nsetup = "ledge"\nbond_number = 0.0\n[diagnosis]'
    )
    dried = dried.replace("sets = 12", "sets = 16", 1)
    rows = [r for r in lab(bond_number=0.6).splitlines() if not r.startswith("ledge")]
    ledge = [r for r in lab().splitlines() if r.startswith("ledge")]
    dry = [r.replace("ledge,,", "ledge,dried,").replace("held_out", "diagnose") for r in ledge]
    case = read_case(write_case(("[run]", dried), lab="\n".join([*rows, *dry]) + "\n"))
    own = next(e for e in ex.experiments(case, case.observables) if e.name == "ledge@dried")
    points = np.tile(ex.point(case, np.full(len(case.problem.names), 0.5)), (16, 1))
    asked = ex.change_requests(case, [own], ex.library(case), points)[0]
    assert {float(r.value("bond_number")) for r in asked} == {0.0}
    assert sum(float(r.value("bed_viscosity")) > 0 for r in asked) == case.diagnosis.effect_sets
    found = diagnose(Workspace(case, tmp_path / "results" / "toy"))
    assert (found.verdict, found.effects) == ("named", ("bond_number",))
    used = [row.key for row in found.observables if row.used]
    shifts = dict(zip(used, found.fingerprints.shifts, strict=True))
    assert {key: own[0] == 0 for key, own in shifts.items()} == {
        key: "dried" in key for key in shifts
    }


def test_too_few_runs_of_one_experiment_are_refused_before_any_is_made(
    write_case, fake_yade, tmp_path
):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    few = SMALL[1].replace(
        "[diagnosis]", '[conditions.dried]\nsetup = "ledge"\nbond_number = 0.0\n[diagnosis]'
    )
    rows = lab().replace("ledge,,", "ledge,dried,")
    space = Workspace(read_case(write_case(("[run]", few), lab=rows)), tmp_path / "results" / "toy")
    with pytest.raises(CalibratorError, match=r"sets = 12 .* ledge@dried: raise it to 15"):
        diagnose(space)
    assert not (space.path / "calls.txt").exists()


def test_a_laboratory_outside_the_box_is_told_to_widen_it_and_gets_no_name(space):
    here = space(rolling_friction=0.6)
    found = diagnose(here)
    assert (found.verdict, found.effects) == ("out of bounds", ())
    assert found.bounded.p < 0.01
    assert any(text.startswith("rolling_friction at its upper") for text in found.bounded.at_bounds)
    assert "rolling_friction" in found.sentence and "widen the bounds" in found.sentence
    assert "widen the bounds" in Path(write_diagnosis(here, found)).read_text()
