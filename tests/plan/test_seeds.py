"""Each kind of run has seeds of its own, in every case that is not refused."""

import dataclasses
from itertools import combinations
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as some

from calibrator.case.case import Case
from calibrator.case.experiment import Condition
from calibrator.case.settings import Diagnosis, Plan, Replicates, Validation
from calibrator.case.toml import read_case
from calibrator.check import check_case
from calibrator.diagnosis import experiments as ex
from calibrator.errors import CalibratorError
from calibrator.plan import seeds
from calibrator.plan.design import sobol
from calibrator.plan.requests import (
    plan_requests,
    replicate_requests,
    requests_by_experiment,
    substitutes,
)
from calibrator.runs.record import Record
from calibrator.runs.workspace import Workspace

CASES = Path(__file__).resolve().parents[2] / "cases"
PATHS = sorted(p for p in CASES.glob("*.toml") if "\n[plan]" in p.read_text())
DEMO = read_case(CASES / "coarse_sand.toml")


def meeting(case):
    """Pairs of kinds whose ranges have a seed in common."""
    found = seeds.ranges(case).items()
    return [
        (one, other)
        for (one, a), (other, b) in combinations(found, 2)
        if max(a.start, b.start) < min(a.stop, b.stop)
    ]


NECKS = (
    "[plan]",
    '[conditions.wide]\nsetup = "hourglass"\nneck_diameter = 0.02\n'
    '[conditions.narrow]\nsetup = "hourglass"\nneck_diameter = 0.013\n[plan]',
)
UNDER_CONDITIONS = """setup,condition,response,value,scatter,replicates,unit,role
hourglass,,mass_flow_rate,0.026,0.0001,8,kg/s,calibrate
hourglass,wide,mass_flow_rate,0.05,0.0001,8,kg/s,calibrate
hourglass,narrow,mass_flow_rate,0.02,0.0001,8,kg/s,held_out
"""


def own(requests):
    return {int(r.parameters["seed"]) for r in requests}


@pytest.mark.parametrize("path", PATHS, ids=lambda p: p.stem)
def test_no_case_of_the_project_has_seeds_that_meet(path):
    case = read_case(path)
    assert seeds.overlapping(case) == [] and meeting(case) == []


def test_seeds_are_what_they_have_always_been_or_finished_runs_would_be_lost():
    assert seeds.plan_seed(DEMO, 3, 1) == 1_000 + 301
    assert seeds.proposed_seed(DEMO, 7) == 10_001_007
    assert seeds.substitute_seed(1_301) == 50_001_301
    assert seeds.substitute_seed(50_001_301) is None
    assert seeds.substitute_seed(50_001_301, 2) == 100_001_301
    assert seeds.verification_seed(DEMO.verify, 2, 1) == 500_201
    assert seeds.verification_seed(DEMO.validate, 0) == 600_000
    assert seeds.experiment_seed(DEMO, 2, 3, 1) == 2_700_301
    assert seeds.change_seed(DEMO, 1, 20) == 201_702_000
    assert seeds.confirm_seed(DEMO, 1, 3, 4) == 401_700_304


def test_requests_keep_to_the_ranges_of_their_kinds():
    case = read_case(CASES / "missing_effect.toml")
    found, kinds = seeds.ranges(case), ex.experiments(case, case.observables)
    points = sobol(case.problem, case.diagnosis.sets)
    planned = plan_requests(case)
    clogged = substitutes([Record(r, "clogged") for r in planned])
    assert own(planned) <= set(found["the plan"])
    assert own(clogged) <= set(found["the substitutes of clogged runs"])
    last = seeds.CANDIDATES - 1
    fresh = replicate_requests(case, "hourglass", points[0], case.verify, 0)
    few = dataclasses.replace(case.verify, replicates=case.verify.spread_replicates)
    fresh += replicate_requests(case, "hourglass", points[0], few, last)
    assert own(fresh) <= set(found["the verification"])
    plain = ex.plain_requests(case, kinds, points)
    changes = ex.change_requests(case, kinds, ex.library(case), points)
    for i in range(len(kinds)):
        assert own(plain[i]) <= set(found[f"the diagnosis (experiment {i + 1})"])
        assert own(changes[i]) <= set(found[f"the fingerprints (experiment {i + 1})"])


def test_runs_under_conditions_keep_to_ranges_of_their_own(write_case):
    case = read_case(write_case(NECKS, lab=UNDER_CONDITIONS))
    found = seeds.ranges(case)
    assert seeds.overlapping(case) == [] and meeting(case) == []
    assert "the plan (hourglass@narrow)" not in found
    wide = requests_by_experiment(case)["hourglass@wide"]
    assert own(wide) <= set(found["the plan (hourglass@wide)"])
    again = substitutes([Record(r, "clogged") for r in wide])
    assert own(again) <= set(found["the substitutes of clogged runs (hourglass@wide)"])
    assert len(again) == len(wide) and not substitutes([Record(r, "clogged") for r in again])
    point = sobol(case.problem, 1)[0]
    for fresh, kind, experiment in (
        (case.verify, "the verification", "hourglass@wide"),
        (case.validate, "the validation", "hourglass@narrow"),
    ):
        runs = replicate_requests(case, experiment, point, fresh)
        assert own(runs) <= set(found[f"{kind} ({experiment})"])


def test_seeds_under_a_condition_that_meet_others_are_refused_with_what_to_change(write_case):
    for seed, said in (
        (599_999_999, "reach those of conditions, which begin at 600,000,000: lower verify.seed"),
        (650_000_000, "reach those of conditions, which begin at 600,000,000: lower verify.seed"),
        (10, None),
    ):
        change = ("[verify]", f"[verify]\nseed = {seed}")
        sentences = seeds.overlapping(read_case(write_case(NECKS, change, lab=UNDER_CONDITIONS)))
        assert any(said in one for one in sentences) if said else not sentences
    plan = ("[plan]", "[diagnosis]\nseed = 600_000_500\n[plan]")
    (sentence, *_) = seeds.overlapping(read_case(write_case(NECKS, plan, lab=UNDER_CONDITIONS)))
    assert "the plan (hourglass@wide)" in sentence and "or move diagnosis.seed" in sentence


def test_more_conditions_than_there_are_seeds_for_are_refused(write_case):
    many = "".join(
        f'[conditions.c{i}]\nsetup = "hourglass"\nneck_diameter = {0.015 + i * 1e-4}\n'
        for i in range(16)
    )
    lab = UNDER_CONDITIONS.replace(",wide,", ",c14,").replace(",narrow,", ",c2,")
    assert seeds.overlapping(read_case(write_case(("[plan]", many + "[plan]"), lab=lab))) == []
    lab = lab.replace(",c14,", ",c15,")
    found = seeds.overlapping(read_case(write_case(("[plan]", many + "[plan]"), lab=lab)))
    assert found and all("name that condition before others" in one for one in found)


FIRST = some.one_of(
    some.integers(0, 30_000_000), some.sampled_from([0, 1_000, 500_000, 700_000, 30_000_000])
)
VERIFICATIONS, VALIDATIONS = (
    some.builds(
        table,
        replicates=some.integers(1, 10_000),
        seed=some.one_of(FIRST, some.integers(0, 2 * 10**9)),
        spread_replicates=some.integers(0, 200),
    )
    for table in (Replicates, Validation)
)
PLANS = some.builds(
    Plan,
    design=some.sampled_from(["sobol", "adaptive", "grid"]),
    sets=some.one_of(some.integers(1, 100), some.integers(1, 300_000)),
    replicates=some.one_of(some.integers(1, 3), some.integers(1, 200)),
    most_runs=some.integers(1, 10**6),
    seed=FIRST,
)
DIAGNOSES = some.builds(
    Diagnosis,
    sets=some.integers(4, 1000),
    replicates=some.integers(1, 99),
    effect_sets=some.integers(4, 1000),
    verify_replicates=some.integers(2, 99),
    seed=some.one_of(FIRST, some.integers(0, 1_500_000_000)),
)


def changed(plan, verify, validate, diagnosis, conditions):
    """The demo's case with other tables; None where they are refused at once."""
    found = {f"c{i}": Condition("ledge", {}) for i in range(conditions)}
    try:
        return dataclasses.replace(
            DEMO,
            plan=plan,
            verify=verify,
            validate=validate,
            diagnosis=diagnosis,
            problem=dataclasses.replace(DEMO.problem, conditions=found),
        )
    except CalibratorError:
        return None


@given(PLANS, VERIFICATIONS, VALIDATIONS, DIAGNOSES, some.sampled_from([0, 1, 3, 250]))
def test_a_case_that_is_not_refused_has_no_two_kinds_that_meet(
    plan, verify, validate, diagnosis, conditions
):
    case = changed(plan, verify, validate, diagnosis, conditions)
    if case is None:
        return
    found, refused = seeds.ranges(case), seeds.overlapping(case)
    assert refused or not meeting(case)
    assert refused or max(r.stop for r in found.values()) <= 2**31
    if not refused and plan.design != "adaptive":  # every run of the plan may have a substitute
        last = found["the plan"].stop - 1
        assert seeds.substitute_seed(last) in found["the substitutes of clogged runs"]
    for sentence in refused:
        assert any(word in sentence for word in ("raise", "lower", "ask for fewer", "give"))


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        (
            {"verify": Replicates(seed=1_500)},
            r"the plan \(1,000 to 3,301\) meet those of the verification \(1,500 to 1,901\): raise"
            " verify.seed from 1500 to 3302, or move plan.seed",
        ),
        (
            {"validate": Validation(seed=500_100)},
            "verification .* meet those of the validation .*: raise validate.seed from 500100",
        ),
        ({"plan": Plan(sets=6_000)}, "the plan .* meet those of the verification"),
        ({"plan": Plan(replicates=101)}, "plan.replicates = 101: .* give 100 or less"),
        ({"verify": Replicates(101)}, "verify.replicates = 101: .* give 100 or less"),
        (
            {"verify": Replicates(seed=10_500_000), "plan": Plan("adaptive")},
            "the design proposes .* meet those of the verification",
        ),
        ({"diagnosis": Diagnosis(seed=500_000)}, "raise diagnosis.seed from 500000"),
    ],
)
def test_a_case_whose_seeds_could_meet_is_refused_with_what_to_change(
    tables, said, tmp_path, fake_yade
):
    case = dataclasses.replace(DEMO, **tables)
    assert isinstance(case, Case)
    with pytest.raises(CalibratorError, match=said):
        check_case(Workspace(case, tmp_path))


def test_a_plan_that_reaches_the_seeds_of_substitutes_is_told_to_move():
    """Not by `check`, which would make half a million requests first."""
    sentence = seeds.overlapping(dataclasses.replace(DEMO, plan=Plan(sets=499_999)))[0]
    assert "reach those of substitutes" in sentence and "lower plan.seed" in sentence


def test_doing_what_the_sentence_says_mends_the_case():
    case = dataclasses.replace(DEMO, verify=Replicates(seed=1_500))
    (sentence,) = seeds.overlapping(case)
    now, then = (int(word.strip(",")) for word in sentence.split() if word.strip(",").isdigit())
    assert now == 1_500
    assert seeds.overlapping(dataclasses.replace(case, verify=Replicates(seed=then))) == []


def test_an_adaptive_design_that_never_ends_does_not_run_into_other_seeds():
    with pytest.raises(CalibratorError, match="take a plan"):
        seeds.proposed_seed(DEMO, 1_000_000)


def test_a_validation_without_a_seed_of_its_own_keeps_away_from_the_verification(write_case):
    case = read_case(write_case(("[verify]", "[validate]\nreplicates = 2\n[verify]")))
    assert case.validate.seed == 600_000 and seeds.overlapping(case) == []
