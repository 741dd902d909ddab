"""Rows under a condition calibrate: two necks tell what one cannot, dry sand what moisture does."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from calibrator.case.fingerprint import digest
from calibrator.case.problem import Target
from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.diagnosis.runs import asked
from calibrator.errors import CalibratorError
from calibrator.plan.forecast import forecast
from calibrator.plan.requests import belongs, make_request, plan_requests, requests_by_experiment
from calibrator.plan.run import _parameter_sets, run_plan
from calibrator.responses.table import by_experiment, experiment_of, points_of
from calibrator.runs.database import Database
from calibrator.runs.record import Record
from calibrator.search.calibrate import calibrate
from calibrator.verification.verify import validate, verify
from tests import fake_yade
from tests.conftest import LAB, space_for
from tests.stand_in import World, put_in_place

REPO = Path(__file__).resolve().parent.parent
FRICTION, RADIUS = 0.25, 1.4e-3
NECKS = {"": 18e-3, "wide_neck": 24e-3, "narrow_neck": 16e-3}
CASE = """name = "necks"
measured = "lab.csv"
[parameters.rolling_friction]
low = 0.05
high = 0.45
[parameters.particle_radius]
low = 1e-3
high = 2e-3
[setups.hourglass]
neck_diameter = 18e-3
[conditions.wide_neck]
setup = "hourglass"
neck_diameter = 24e-3
[conditions.narrow_neck]
setup = "hourglass"
neck_diameter = 16e-3
[plan]
sets = 20
replicates = 2
[search]
population = 60
generations = 20
objectives = ["error"]
[verify]
replicates = 6
[validate]
replicates = 6
"""


def rate(neck, friction, radius):
    """A rate as Beverloo's law has it: small smooth grains flow faster, the more so in a neck."""
    return 50 * (1 - 0.8 * friction) * (neck - 2.8 * radius) ** 2.5 * math.sqrt(9.81) * 16


def flowing(setup, p, seed):
    flow = rate(p["neck_diameter"], p["rolling_friction"], p["particle_radius"])
    return {"mass_flow_rate": flow, "bulk_density": 1600.0}


def necks(tmp_path, roles):
    """A case whose lab file has the rate at each neck with the role that stands there."""
    rows = ["setup,condition,response,value,scatter,replicates,unit,role"]
    for name, role in roles.items():
        value = rate(NECKS[name], FRICTION, RADIUS)
        rows.append(f"hourglass,{name},mass_flow_rate,{value!r},{value * 2e-3!r},5,kg/s,{role}")
    (tmp_path / "lab.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "necks.toml").write_text(CASE)
    return tmp_path / "necks.toml"


ONE = {"": "calibrate"}
TWO = {"": "calibrate", "wide_neck": "calibrate", "narrow_neck": "held_out"}


@pytest.mark.parametrize(("roles", "pinned"), [(ONE, False), (TWO, True)])
def test_two_necks_calibrate_what_one_cannot(tmp_path, monkeypatch, roles, pinned):
    put_in_place(monkeypatch, World(flowing, noise=1e-3))
    space = space_for(necks(tmp_path, roles), tmp_path / "results")
    run_plan(space)
    found = calibrate(space)
    assert [p.pinned for p in found.identifiability.parameters] == [pinned, pinned]
    if pinned:
        assert found.compromise.parameters == pytest.approx(
            {"rolling_friction": FRICTION, "particle_radius": RADIUS}, rel=0.1
        )


def test_every_verb_knows_the_experiments_under_conditions(tmp_path, monkeypatch, capsys):
    made = put_in_place(monkeypatch, World(flowing, noise=1e-3))
    path, results = necks(tmp_path, TWO), tmp_path / "results"
    for verb in ("check", "plan", "run", "collect", "calibrate", "verify", "validate", "report"):
        assert main([verb, str(path), "--results", str(results)]) == 0, capsys.readouterr()
    said = capsys.readouterr().out
    assert "hourglass@wide_neck.mass_flow_rate: target" in said
    assert "hourglass@narrow_neck.mass_flow_rate: target" in said and "MISSED" not in said
    assert (results / "necks" / "plan" / "hourglass@wide_neck.table").exists()
    page = (results / "necks" / "report.html").read_text()
    assert "mass flow rate (hourglass, wide neck)" in page
    assert "hourglass@" not in page.split("</style>")[1]
    own = {r.parameters["neck_diameter"] for r in made.made}
    assert own == set(NECKS.values())
    # no two runs start alike
    assert len({r.parameters["seed"] for r in made.made}) == len(made.made)


def test_a_weight_is_given_by_the_key_with_the_condition(tmp_path):
    path = necks(tmp_path, TWO)
    path.write_text(
        path.read_text() + '[targets."hourglass@wide_neck.mass_flow_rate"]\nweight = 2.5\n'
    )
    weights = {t.key: t.weight for t in read_case(path).problem.targets}
    assert weights == {
        "hourglass.mass_flow_rate": 1.0,
        "hourglass@wide_neck.mass_flow_rate": 2.5,
    }


def test_the_forecast_has_a_line_for_each_experiment_and_counts_no_run_twice(tmp_path):
    found = forecast(space_for(necks(tmp_path, TWO), tmp_path / "results"))
    assert {name: one.runs for name, one in found.setups.items()} == {
        "hourglass": 40,
        "hourglass@wide_neck": 40,
    }
    assert found.runs == 80


def test_a_later_condition_and_its_role_change_no_run_of_those_before(tmp_path):
    before = [r.run_id for r in plan_requests(read_case(necks(tmp_path, TWO)))]
    (tmp_path / "necks.toml").write_text(
        CASE.replace("[plan]", '[conditions.last]\nsetup = "ledge"\nbox_width = 0.03\n[plan]')
    )
    assert [r.run_id for r in plan_requests(read_case(tmp_path / "necks.toml"))] == before
    alone = read_case(necks(tmp_path, {"narrow_neck": "calibrate", "wide_neck": "calibrate"}))
    wide = requests_by_experiment(alone)["hourglass@wide_neck"]
    assert [r.run_id for r in wide] == before[40:]


DRIED = (
    "[plan]",
    "[parameters.bond_number]\nlow = 0.0\nhigh = 1.0\nsamples = 3\n[conditions.dried]\nsetup ="
    ' "hourglass"\nbond_number = 0.0\n[plan]',
)
NO_MODULUS = ("[parameters.young_modulus]\nlow = 0.5e6\nhigh = 4e6\nsamples = 2\n", "")
MOIST = {"rolling_friction": 0.25, "sliding_friction": 0.5, "young_modulus": 1e7}


def moist_lab(bond_number=0.5):
    """What the fake YADE gives for moist sand, and once more for the same sand dried."""
    rows = ["setup,condition,response,value,scatter,replicates,unit,role"]
    for condition, bond in (("", bond_number), ("dried", 0.0)):
        values = fake_yade.responses_of("hourglass", {**MOIST, "bond_number": bond})
        for name, unit in (
            ("bulk_density", "kg/m3"),
            ("drained_equivalent_angle_deg", "deg"),
            ("mass_flow_rate", "kg/s"),
        ):
            value = values[name]
            rows.append(
                f"hourglass,{condition},{name},{value!r},{value * 4e-3!r},5,{unit},calibrate"
            )
    return "\n".join(rows) + "\n"


def test_a_run_belongs_to_the_experiment_whose_values_it_has(tmp_path):
    case = read_case(necks(tmp_path, TWO))
    for name, neck in NECKS.items():
        experiment = f"hourglass@{name}" if name else "hourglass"
        request = make_request(case, experiment, case.problem.low, 7)
        assert request.parameters["neck_diameter"] == neck
        assert experiment_of(case.problem, request) == experiment
        assert belongs(case, request) == (name != "narrow_neck")  # which is held out
    other = type(request).of("hourglass", **{**request.parameters, "neck_diameter": 20e-3})
    assert experiment_of(case.problem, other) == "" and not belongs(case, other)
    assert np.isnan(points_of(case.problem, [other])).all()


def test_a_grid_that_reaches_what_the_condition_fixes_keeps_its_runs_apart(write_case):
    grid = ('design = "sobol"\nsets = 14', 'design = "grid"')
    case = read_case(write_case(NO_MODULUS, DRIED, grid, lab=moist_lab()))
    assert case.problem.seen_by("hourglass@dried") == ["rolling_friction", "sliding_friction"]
    planned = requests_by_experiment(case)
    assert {name: len(own) for name, own in planned.items()} == {
        "hourglass": 4 * 4 * 3 * 2,
        "hourglass@dried": 4 * 4 * 2,
    }
    records = [Record(r, "ok", {}) for own in planned.values() for r in own]
    found = by_experiment(case.problem, records)
    assert {name: [r.request for r in own] for name, own in found.items()} == planned
    assert all("bond_number" not in r.parameters for r in planned["hourglass@dried"])
    points = points_of(case.problem, planned["hourglass@dried"])
    assert np.isnan(points[:, 2]).all() and np.isfinite(points[:, :2]).all()


def test_runs_of_one_set_stand_in_one_row_whatever_their_condition(write_case):
    case = read_case(write_case(NO_MODULUS, DRIED, lab=moist_lab()))
    first = {name: own[0] for name, own in requests_by_experiment(case).items()}
    records = [Record(r, "ok", {"mass_flow_rate": 1.0}) for r in first.values()]
    for order in (records, records[::-1]):
        points, values = _parameter_sets(case, order)
        assert len(points) == 1 and np.isfinite(points).all()
        assert np.isfinite(values).sum() == 2


@pytest.mark.parametrize("bond_number", [0.0, 0.5])
def test_an_adaptive_design_confirms_moist_and_dried_sand_together(
    write_case, tmp_path, monkeypatch, bond_number
):
    """At a bond number of 0 the moist runs of a set are like the dried ones but for their seeds."""
    adaptive = (
        'design = "sobol"\nsets = 14\nreplicates = 2',
        'design = "adaptive"\nsets = 9\nreplicates = 3\nmost_runs = 120',
    )
    made = put_in_place(monkeypatch, World())
    path = write_case(NO_MODULUS, DRIED, adaptive, lab=moist_lab(bond_number))
    space = space_for(path, tmp_path)
    outcome = run_plan(space)
    assert outcome.ended == "confirmed" and len(made.made) <= 120
    assert "hourglass@dried fixes bond_number" in " ".join(calibrate(space).lines())


def test_dried_sand_is_verified_and_held_out_like_any_other(write_case, tmp_path, monkeypatch):
    lab = moist_lab().replace("5,kg/s,calibrate", "5,kg/s,held_out")
    put_in_place(monkeypatch, World())
    space = space_for(write_case(NO_MODULUS, DRIED, lab=lab), tmp_path)
    run_plan(space)
    calibrate(space)
    verified, validated = verify(space), validate(space)
    assert verified.passed and validated.passed
    assert [r.key for r in validated.responses] == [
        "hourglass.mass_flow_rate",
        "hourglass@dried.mass_flow_rate",
    ]
    rows = {r.key: r for r in verified.candidates["compromise"].responses}
    dry, moist = rows["hourglass@dried.bulk_density"], rows["hourglass.bulk_density"]
    assert dry.attempted == moist.attempted == 4
    assert dry.simulated - moist.simulated == pytest.approx(60 * 0.5, rel=0.5)


def test_where_all_runs_of_a_condition_fail_that_experiment_is_named(
    write_case, tmp_path, monkeypatch
):
    def dry_clogs(setup, p, seed):
        return "ok" if p.get("bond_number", 0.0) else "clogged"

    put_in_place(monkeypatch, World(status_of=dry_clogs))
    outcome = run_plan(space_for(write_case(NO_MODULUS, DRIED, lab=moist_lab()), tmp_path))
    assert outcome.ended == "failed" and "hourglass@dried runs clogged" in outcome.sentence
    # and each has had its substitute
    assert outcome.statuses == {"ok": 28, "clogged": 56}


@pytest.mark.parametrize(
    ("fixed", "said"),
    [
        (
            "rolling_friction = 0.2\nsliding_friction = 0.4\nyoung_modulus = 1e6",
            "hourglass@all has none, or fixes all, of the calibrated parameters.*held_out",
        ),
        (
            "sliding_friction = 0.4",
            "sliding_friction is fixed by the condition of hourglass@all, and no other.*remove it",
        ),
    ],
)
def test_a_condition_that_leaves_a_target_or_a_parameter_without_use_is_refused(
    write_case, fixed, said
):
    lab = "\n".join(
        line.replace(",", ",all," if line.startswith("hourglass") else ",,", 1)
        for line in LAB.replace("setup,", "setup,condition,").splitlines()
        if not line.startswith(("#", "setup"))
    )
    head = "setup,condition,response,value,scatter,replicates,unit,role\n"
    change = ("[plan]", f'[conditions.all]\nsetup = "hourglass"\n{fixed}\n[plan]')
    with pytest.raises(CalibratorError, match=said):
        read_case(write_case(change, lab=head + lab + "\n"))


def test_runs_without_a_condition_and_those_of_a_diagnosis_are_what_they_have_always_been():
    """Else shipped databases, and whatever users have run, would be lost."""
    for case, database in (
        ("coarse_sand", "coarse_sand"),
        ("quartz_sand_reduced", "quartz_sand_reduced"),
        ("quartz_sand_reduced_grid", "quartz_sand_reduced_grid"),
    ):
        requests = plan_requests(read_case(REPO / "cases" / f"{case}.toml"))
        shipped = Database.read(REPO / "grid" / f"{database}.csv")
        assert len(shipped.find(requests)) == len(requests), case
    diagnosed = read_case(REPO / "cases" / "missing_effect.toml")
    shipped = Database.read(REPO / "grid" / "missing_effect.csv")
    requests = [r for own in asked(diagnosed, diagnosed.observables).plain for r in own]
    assert len(shipped.find(requests)) == len(requests)


def test_a_target_without_a_condition_is_written_as_it_was_before_there_were_any():
    """Else every calibration of before would be called stale."""
    target = Target("hourglass", "mass_flow_rate", 0.03)
    without = {f.name: getattr(target, f.name) for f in dataclasses.fields(target)}
    later = [without.pop(name) for name in ("condition", "size", "curve")]
    assert later == ["", 0.0, None] and digest(target) == digest(without)
    assert digest(dataclasses.replace(target, condition="wide_neck")) != digest(target)
