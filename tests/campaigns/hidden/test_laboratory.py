"""Laboratories with a secret, and the campaign on them, as far as they need no run."""

import hashlib
import json

import numpy as np
import pytest

from calibrator.case.physics import contact_time, time_step
from calibrator.case.toml import read_case
from calibrator.diagnosis import experiments as ex
from calibrator.plan.design import sobol
from tests.campaigns.hidden import campaign as hidden_effect
from tests.campaigns.hidden import laboratory as hidden
from tests.campaigns.hidden import matrix


@pytest.fixture(scope="module")
def case():
    return read_case(hidden.CASE)


def numbers(request):
    return {n: float(v) for n, v in request.parameters.items() if not isinstance(v, str)}


def sealed_folder(tmp_path, hides, verdict, effects):
    """A laboratory as `make` leaves it, and what a diagnosis noted."""
    folder = tmp_path / "secret"
    folder.mkdir()
    text = json.dumps({"truth": {"hidden": hides}, "salt": "00"})
    (folder / "sealed.json").write_text(text + "\n")
    (folder / "commitment.txt").write_text(hashlib.sha256(text.encode()).hexdigest() + "\n")
    results = tmp_path / "results" / "secret"
    results.mkdir(parents=True)
    (results / "summary.json").write_text(
        json.dumps({"diagnose": {"verdict": verdict, "effects": effects, "sentence": ""}})
    )
    return folder, results.parent


@pytest.mark.parametrize(
    ("hides", "verdict", "effects", "right"),
    [
        ({"bond_number": 0.5}, "named", ["bond_number"], True),
        ({"bond_number": 0.5}, "named", ["tilt_deg"], False),
        ({"bond_number": 0.5}, "ambiguous", ["clump_aspect", "bond_number"], True),
        ({"bond_number": 0.5}, "no gap", [], False),
        ({}, "no gap", [], True),
        ({}, "named", ["tilt_deg"], False),
        ({"soft_grains": 1.0}, "unknown", [], True),
        ({"soft_grains": 1.0}, "named", ["bond_number"], False),
        ({"soft_grains": 1.0}, "ambiguous", ["clump_aspect", "unknown"], True),
        ({"soft_grains": 1.0}, "ambiguous", ["clump_aspect", "bond_number"], False),
        ({}, "ambiguous", ["clump_aspect", "none"], False),
        ({"bond_number": 0.5}, "cannot tell", [], False),
    ],
)
def test_the_score_compares_the_verdict_with_the_sealed_truth(
    tmp_path, hides, verdict, effects, right
):
    folder, results = sealed_folder(tmp_path, hides, verdict, effects)
    assert hidden.score(folder, results)["right"] is right


def test_a_truth_that_was_changed_after_its_hash_was_published_is_refused(tmp_path):
    folder, results = sealed_folder(tmp_path, {}, "no gap", [])
    (folder / "sealed.json").write_text(
        (folder / "sealed.json").read_text().replace("{}", '{"tilt_deg": 4.0}')
    )
    with pytest.raises(SystemExit, match="the seal is broken"):
        hidden.score(folder, results)


def test_the_laboratory_steps_finer_than_the_model_and_has_stiffer_grains(case):
    found = ex.experiments(case, case.observables)
    truth = hidden.truth_of(case, {"bond_number": 0.5}, np.random.default_rng(1))
    at = np.array([truth["parameters"][n] for n in case.problem.names])
    for e, own in zip(found, hidden.laboratory_requests(case, truth, found, 1, 2), strict=True):
        model, laboratory = numbers(ex.request(case, e, at, 1)), numbers(own[0])
        assert laboratory["young_modulus"] == hidden.STIFFER * model["young_modulus"]
        assert time_step(laboratory) == pytest.approx(hidden.FINER * time_step(model))
        # or it would not come to rest
        assert time_step(laboratory) < 0.28 * contact_time(laboratory)
        moist = 0.0 if e.name in ("conical_pile@dried", "hourglass@dried_flow") else 0.5
        assert (
            laboratory.get("bond_number", 0.0) == moist
            and laboratory["size_spread"] == hidden.JITTER
        )


def test_no_seed_serves_two_runs_of_pools_laboratories_and_surfaces(case):
    found, effects = ex.experiments(case, case.observables), ex.library(case)
    points = sobol(case.problem, case.diagnosis.sets)
    surfaces = [
        *ex.plain_requests(case, found, points),
        *ex.change_requests(case, found, effects, points),
    ]
    seeds = [r.parameters["seed"] for own in surfaces for r in own]
    pools = [
        r.parameters["seed"]
        for one in hidden_effect.classes(case)
        for own in one.requests
        for r in own
    ]
    for n in (0, hidden.SEEDS - 1):
        own = hidden.laboratory_requests(
            case,
            hidden.truth_of(case, {}, np.random.default_rng(n)),
            found,
            hidden.LAB_SEED + hidden.SEED_STRIDE * n,
            5,
        )
        seeds += [r.parameters["seed"] for runs in own for r in runs]
    assert len(set(seeds + pools)) == len(seeds) + len(pools)
    assert min(pools) >= hidden.LAB_SEED + hidden.SEED_STRIDE * hidden.SEEDS


def test_every_class_hides_what_its_label_says(case):
    made = hidden_effect.classes(case)
    assert len({one.index for one in made}) == len(made)
    assert len({tuple(one.truth["parameters"].values()) for one in made}) == len(made)
    for one in made:
        names = set() if one.strength == "none" else set(one.label.split(" and "))
        assert set(one.truth["hidden"]) == names


def test_the_last_test_is_of_the_whole_box_and_the_same_in_all_its_parts(case):
    last = [one for one in hidden_effect.classes(case) if one.index >= matrix.FIRST]
    low, high = (ex.point(case, np.full(2, u)) for u in (0.0, 1.0))
    nothing = np.array(
        [list(one.truth["parameters"].values()) for one in last if one.strength == "none"]
    )
    assert len(nothing) == matrix.NOTHING == 60
    for own in ((nothing - low) / (high - low)).T:
        assert sorted((own * matrix.NOTHING).astype(int)) == list(range(matrix.NOTHING))
    tenth = [one.strength for one in last[: len(last) // 4]]
    assert tenth.count("none") == 15 and tenth.count("strong") == 9
    assert tenth.count("outside") == 3


def test_a_balance_that_is_off_moves_weights_and_nothing_else(case):
    found = ex.experiments(case, case.observables)
    ordered = ex.in_order(case.observables, found)
    values = np.full((5, len(ordered)), 2.0)
    (balance,) = (n for n in case.nuisances if n.name == "balance")
    reported = hidden.read_off(ordered, values, [balance], {"balance": 1.0})
    moved = {o.response for o in reported if o.value != 2.0}
    assert moved == {"mass_flow_rate"}
    assert {o.value for o in reported if o.response in moved} == {2.0 + 0.003 * 2.0}


def test_an_outside_effect_reaches_the_runs_that_it_concerns(case):
    found = ex.experiments(case, case.observables)
    for name, column, value in (
        (n, *item) for n, own in hidden.OUTSIDE.items() for item in own.items()
    ):
        truth = hidden.truth_of(case, {name: 1.0}, np.random.default_rng(1))
        runs = [
            r
            for own in hidden.laboratory_requests(case, truth, found, hidden.LAB_SEED, 1)
            for r in own
        ]
        assert {r.parameters[column] for r in runs if column in r.parameters} == {value}
