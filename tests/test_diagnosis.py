"""`preflight` and `diagnose` from end to end, on the fake YADE, whose formulas know adhesion and
drag.
"""

import dataclasses
import json
import random
from pathlib import Path
from types import SimpleNamespace

import fake_yade as fake
import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.case.vocabulary import EFFECTS, RESPONSES
from calibrator.cli import main
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.basis import diagnosis_now, preflight_now
from calibrator.diagnosis.diagnose import _confirmed, diagnose
from calibrator.diagnosis.explanations import Effect
from calibrator.diagnosis.gap import Detection
from calibrator.diagnosis.new_case import write_new_case
from calibrator.diagnosis.outcome import Diagnosis, Preflight
from calibrator.diagnosis.preflight import preflight
from calibrator.diagnosis.sentence import sentence
from calibrator.errors import CalibratorError
from calibrator.plan import seeds
from calibrator.plan.seeds import CONFIRM_SEED
from calibrator.report.diagnosis import write_diagnosis
from calibrator.runs.database import Database
from calibrator.runs.workspace import Workspace

REPO = Path(__file__).resolve().parents[1]
TRUTH = {"rolling_friction": 0.25, "sliding_friction": 0.5, "young_modulus": 3e6}
HELD_OUT = ("ledge_curvature", "pile_apex_rounding")
SMALL = (
    "[run]",
    """[conditions.wide_neck]
setup = "hourglass"
neck_diameter = 0.016
[diagnosis]
effects = ["bond_number", "bed_viscosity"]
nuisances = "nuisances.csv"
sets = 12
replicates = 2
effect_sets = 8
verify_replicates = 3
[run]""",
)
NUISANCES = """nuisance,observables,error,unit
reading of angles,*_angle_deg,0.05,deg
balance,*mass_flow_rate,0.1,%
neck,effect:bed_viscosity,1e-6,Pa s
"""


def lab(conditions=False, **hidden):
    """Five replicates of everything the fake YADE measures, with an effect hidden in them."""
    rng, rows = random.Random(5), ["setup,condition,response,value,scatter,replicates,unit,role"]
    for setup in ("hourglass", "ledge", "conical_pile"):
        for name, value in fake.responses_of(setup, {**TRUTH, **hidden}).items():
            seen = value * (1 + fake.NOISE * rng.gauss(0, 1) / 5**0.5)
            first = (
                name in ("bulk_density", "mass_flow_rate", "drained_equivalent_angle_deg")
                and setup == "hourglass"
            )
            role = "calibrate" if first else "held_out" if name in HELD_OUT else "diagnose"
            rows.append(
                f"{setup},,{name},{seen!r},{abs(value) * fake.NOISE!r},5,{RESPONSES[name].unit},{role}"
            )
            if conditions and setup == "hourglass":
                rows.append(
                    f"{setup},wide_neck,{name},{seen!r},{abs(value) * fake.NOISE!r},5,{RESPONSES[name].unit},diagnose"
                )
    return "\n".join(rows) + "\n"


@pytest.fixture
def space(write_case, fake_yade, tmp_path):
    def make(**hidden):
        (tmp_path / "nuisances.csv").write_text(NUISANCES)
        return Workspace(
            read_case(write_case(SMALL, lab=lab(**hidden))), tmp_path / "results" / "toy"
        )

    return make


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


def fresh(*effects, gap=1.0, p=0.5):
    return SimpleNamespace(effects=effects, gap_used=gap, fresh_probability=p)


@pytest.mark.parametrize(
    ("runs", "kind"),
    [
        ([fresh(gap=3.0), fresh("bond_number")], "named"),
        # the gap shrinks, and stays
        ([fresh(gap=3.0), fresh("bond_number", gap=2.0, p=1e-9)], "ambiguous"),
        ([fresh(gap=1.2), fresh("bond_number", gap=1.3)], "ambiguous"),
        ([fresh(gap=3.0), fresh("tilt_deg")], "ambiguous"),  # all runs of the named one failed
    ],
)
def test_a_name_needs_fresh_runs_that_meet_the_measurements(runs, kind):
    verdict = SimpleNamespace(kind="named", effects=("bond_number",))
    names = ("bond_number",) if kind == "named" else ("bond_number", "unknown")
    assert _confirmed(verdict, runs) == (kind, names)


def test_an_outcome_is_believed_while_the_case_and_the_runs_are_those_it_was_computed_from(
    space, fake_yade, tmp_path
):
    here = space(bond_number=0.6)
    noted, seen = diagnose(here), preflight(here)
    assert here.current("diagnose", Diagnosis, diagnosis_now(here)) == noted
    assert here.current("preflight", Preflight, preflight_now(here)) == seen
    case = here.case

    def stale(**changes):
        return Workspace(dataclasses.replace(case, **changes), here.path)

    corrected = dataclasses.replace(case.observables[0], value=1500.0)
    lab_changed = stale(observables=(corrected, *case.observables[1:]))
    with pytest.raises(CalibratorError, match="^measurements changed since diagnose: run"):
        lab_changed.current("diagnose", Diagnosis, diagnosis_now(lab_changed))
    # the values play no part in a pre-flight
    lab_changed.current("preflight", Preflight, preflight_now(lab_changed))
    surer = stale(nuisances=case.nuisances[1:])
    for verb, kind, now in (
        ("diagnose", Diagnosis, diagnosis_now(surer)),
        ("preflight", Preflight, preflight_now(surer)),
    ):
        with pytest.raises(CalibratorError, match=f"^nuisances changed since {verb}: run"):
            surer.current(verb, kind, now)
    richer = stale(diagnosis=dataclasses.replace(case.diagnosis, budget_core_hours=9.0))
    richer.current("diagnose", Diagnosis, diagnosis_now(richer))
    confirming = Database.read(here.path / "diagnosis_confirmed.csv").records
    here.runs.record(next(iter(confirming.values())).request).unlink()
    with pytest.raises(CalibratorError, match="^records changed since diagnose: run"):
        here.current("diagnose", Diagnosis, diagnosis_now(here))
    here.current("preflight", Preflight, preflight_now(here))  # it has used no such run


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
  bond_number = 0.1 # known from another sand
[setups.hourglass]
bond_number = 0.2
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
    assert (new.problem.targets, new.problem.held_out) == (
        case.problem.targets,
        case.problem.held_out,
    )
    for same in (
        "plan", "interpolation", "search", "verify", "validate", "cluster", "about", "observables",
        "conditions", "nuisances",
    ):  # fmt: skip
        assert getattr(new, same) == getattr(case, same), same
    assert new.run == dataclasses.replace(case.run, shipped="")
    assert dataclasses.replace(new.diagnosis, nuisances="") == dataclasses.replace(
        case.diagnosis, nuisances="", shipped=""
    )
    assert new.truth == {}
    for line in (
        "with adhesion, which `calibrator diagnose` named",
        "# Added: [parameters.bond_number].",
        "# Taken out: fixed.bond_number = 0.1.",
        "# Taken out: setups.hourglass.bond_number = 0.2.",
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


def test_nobody_is_told_to_measure_again_after_nothing():
    said = sentence(
        Diagnosis(
            verdict="ambiguous",
            effects=("twisting_stiffness", "tilt_deg"),
            detection=Detection(chi2=30.0, degrees=9, p_chi2=0.01, p_effect=0.01),
        )
    )
    assert "after nothing" not in said and "after levelling the set-up" in said


def test_amplitudes_end_where_their_columns_do():
    for effect in ex.library(read_case(REPO / "cases" / "missing_effect.toml")):
        quantity = EFFECTS[effect.name]
        for bound in effect.bounds:
            assert quantity.low - 1e-12 <= ex.column_value(effect, bound) <= quantity.high + 1e-12


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
    assert read_case(new).measured.read_text() == moist.read_text()


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


def test_preflight_says_in_physical_units_what_could_be_seen_and_which_experiment_would_help(
    space, tmp_path, capsys
):
    here = space()
    assert main(["preflight", str(here.case.path), "--results", str(tmp_path / "results")]) == 0
    said = capsys.readouterr().out
    assert "bed_viscosity [Pa s], plausible 0.001" in said and "seen from" in said
    assert "hourglass@wide_neck helps most" in said
    found = json.loads((here.path / "summary.json").read_text())["preflight"]
    assert found["self_test"]["none"]["no gap"] >= 10
    right = found["self_test"]["bond_number"]
    assert right["bond_number"] >= 6 and "bed_viscosity" not in right
    power = {p["effect"]: p for p in found["effects"]}["bond_number"]
    rows = [line.split(",") for line in lab().splitlines()]
    others = [rows[0], *([*row[:3], str(3 * float(row[3])), *row[4:]] for row in rows[1:])]
    # the values play no part
    (here.case.path.parent / "lab.csv").write_text("".join(",".join(row) + "\n" for row in others))
    assert main(["preflight", str(here.case.path), "--results", str(tmp_path / "results")]) == 0
    assert json.loads((here.path / "summary.json").read_text())["preflight"] == found
    assert (
        0 < power["smallest_detectable"] <= power["smallest_nameable"] < 1
        and 0 < power["absorbed"] < 1
    )


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        (
            "balance,*mass_flow_rate,0.1,%",
            "balance,*mass_flow_rate,0.1,kg",
            "unit 'kg'; the error has to be in kg/s",
        ),
        ("balance,*mass_flow_rate,0.1,%", "balance,*mass_flow,0.1,%", "is the key of no row"),
        (
            "balance,*mass_flow_rate,0.1,%",
            "balance,*mass_flow_rate,-0.1,%",
            "give a positive standard deviation",
        ),
        ("effect:bed_viscosity", "effect:bed_viscocity", "did you mean bed_viscosity"),
    ],
)
def test_a_mistake_in_the_nuisance_table_is_named_with_its_remedy(
    write_case, tmp_path, old, new, why
):
    (tmp_path / "nuisances.csv").write_text(NUISANCES.replace(old, new))
    with pytest.raises(CalibratorError, match=why):
        read_case(write_case(SMALL, lab=lab()))


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("hourglass,,late", "hourglass,narrow,late", "did you mean|use one of"),
        (
            "ledge,,bulk_density",
            "ledge,wide_neck,bulk_density",
            "the condition belongs to hourglass",
        ),
        (
            "hourglass,,bulk_density",
            "hourglass,wide_neck,bulk_density",
            "a calibration knows no conditions",
        ),
    ],
)
def test_a_mistake_with_conditions_is_named_with_its_remedy(write_case, tmp_path, old, new, why):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    with pytest.raises(CalibratorError, match=why):
        read_case(write_case(SMALL, lab=lab().replace(old, new)))


def test_a_case_has_its_own_plausible_size_of_an_effect(write_case, tmp_path):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    case = read_case(
        write_case(
            ("[run]", f"{SMALL[1][:-5]}[diagnosis.scales]\nbed_viscosity = 4e-3\n[run]"), lab=lab()
        )
    )
    drag = next(e for e in ex.library(case) if e.name == "bed_viscosity")
    assert ex.column_value(drag, 1.5) == pytest.approx(6e-3)


def test_every_amplitude_of_an_effect_is_run_on_both_sides_of_every_parameter():
    case = read_case(REPO / "cases" / "missing_effect.toml")
    found, effects = ex.experiments(case, case.observables), ex.library(case)
    points = np.tile(
        ex.point(case, np.full(len(case.problem.names), 0.5)), (case.diagnosis.sets, 1)
    )
    asked = ex.change_requests(case, found, effects, points)[0]
    for k, effect in enumerate(effects):
        own = [r for r in asked if abs(observed.amplitudes(effects, [r])[0, k]) > 0]
        assert len(own) == case.diagnosis.effect_sets
        sides = observed.units(case, own) > 0.5
        sizes = observed.amplitudes(effects, own)[:, k].round(9)
        for size in set(abs(sizes)):
            assert (
                {True, False}
                == set(sides[abs(sizes) == size, 0])
                == set(sides[abs(sizes) == size, 1])
            ), (effect.name, size)


def test_a_negative_size_looks_below_the_default_only(write_case, tmp_path):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    own = (
        SMALL[1][:-5]
        .replace("bed_viscosity", "wall_friction_ratio", 1)
        .replace('nuisances = "nuisances.csv"\n', "")
    )
    smooth = f"{own}[diagnosis.scales]\nwall_friction_ratio = -0.4\n[run]"
    wall = ex.library(read_case(write_case(("[run]", smooth), lab=lab())))[1]
    assert [ex.column_value(wall, a) for a in (1.0, *wall.bounds)] == pytest.approx([0.6, 1.0, 0.0])
    assert min(
        ex.column_value(wall, ex.amplitude(wall, share)) for share in (0.1, 0.4, 0.6, 0.9)
    ) == pytest.approx(0.4)


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
    with pytest.raises(CalibratorError, match="ledge@dried 20 runs, below 23"):
        diagnose(space)
    assert not (space.path / "calls.txt").exists()


@pytest.mark.parametrize(
    ("scales", "message"),
    [
        ("bed_viscosity = 0.0", "above 0"),
        ("bed_viscosity = -1e-3", "above 0"),
        ("tilt_deg = 3.0", "diagnosis.scales"),
    ],
)
def test_a_size_that_cannot_be_is_refused(write_case, scales, message):
    with pytest.raises(CalibratorError, match=message):
        read_case(
            write_case(("[run]", f"{SMALL[1][:-5]}[diagnosis.scales]\n{scales}\n[run]"), lab=lab())
        )
