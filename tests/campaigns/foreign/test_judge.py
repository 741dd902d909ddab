"""The judge, on a laboratory drawn from the surfaces themselves, and its counts."""

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.diagnosis import experiments as ex
from calibrator.runs.database import Database
from calibrator.runs.record import Record
from tests.campaigns.foreign import allowance, fresh, judge, truths
from tests.campaigns.hidden.laboratory import SHIPPED
from tests.campaigns.hidden.trials import library

CASE = read_case(truths.CASE)
FOUND = ex.experiments(CASE, CASE.observables)


def test_a_laboratory_that_is_the_model_has_no_gap_and_its_frictions(monkeypatch):
    monkeypatch.setattr(judge, "TRIALS", 1)
    whole = library(CASE, Database.read(SHIPPED))
    unit, rng = np.array([0.6, 0.4]), np.random.default_rng(3)
    mean = whole.surfaces.mean(unit, np.zeros(len(whole.effects)))[0]
    runs = rng.multivariate_normal(mean, whole.surfaces.noise, truths.REPLICATES)
    ends = np.cumsum([len(e.responses) for e in FOUND])[:-1]
    at = dict(zip(CASE.problem.names, map(float, ex.point(CASE, unit)), strict=True))
    one = truths.Laboratory(1, "nothing", at, {}, 0.0, 0.0)
    result = {**vars(one), **judge.judged(CASE, one, np.split(runs, ends, axis=1), whole)}
    for name in judge.SETTINGS:
        assert result[name]["first"] == "no gap"
        figures = judge.counts([result], name)
        assert figures["false_alarms"]["first_trial"]["count"] == 0
        assert all(f["of"] == 1 for f in figures["frictions_in_interval"].values())
    widths = [result[n]["frictions"]["sliding_friction"] for n in judge.SETTINGS]
    assert widths[0][3] - widths[0][2] < widths[1][3] - widths[1][2]
    sizes = judge.nameable(CASE, whole)
    assert all(v[judge.SETTINGS[0]] <= v[judge.SETTINGS[1]] for v in sizes.values())


def told(number, kind, said):
    verdicts = {"first": said[0], "all": dict.fromkeys(said, 1)}
    verdicts["frictions"] = {"rolling_friction": [0.2, 0.21, 0.19, 0.23]}
    parameters = {"rolling_friction": 0.2}
    return {"number": number, "kind": kind, "parameters": parameters, "as it is": verdicts}


def test_laboratories_are_counted_by_their_first_trial_and_by_any():
    found = [
        told(1, "nothing", ["no gap", "ambiguous: tilt_deg, unknown"]),
        told(2, "tilt_deg", ["named: tilt_deg", "no gap"]),
        told(3, "tilt_deg", ["named: bond_number"]),
        told(4, "vibration", ["unknown", "two effects: tilt_deg, bond_number"]),
    ]
    counts = judge.counts(found, "as it is")
    both = {n: [counts[n][k]["count"] for k in ("first_trial", "any_trial")] for n in counts
            if n not in ("by_kind", "frictions_in_interval")}  # fmt: skip
    assert both == {
        "false_alarms": [0, 1], "false_names": [0, 0], "names_true": [1, 1],
        "names_wrong": [1, 1], "gap_seen": [2, 2], "outside_named": [0, 1],
        "outside_gap_seen": [1, 1],
    }  # fmt: skip
    assert counts["frictions_in_interval"]["rolling_friction"]["of"] == 2


def test_the_interval_of_a_share_is_that_of_clopper_and_pearson():
    """None of 12: the upper end is 1 - 0.025^(1/12)."""
    low, high = judge.share([False] * 12)["interval"]
    assert low == 0 and high == pytest.approx(1 - 0.025 ** (1 / 12), abs=5e-4)


def test_the_allowance_is_of_what_was_compared_only():
    ordered = ex.in_order(CASE.observables, FOUND)
    more = allowance.variances(ordered, np.full(len(ordered), 2.0))
    names = {o.response for o, v in zip(ordered, more, strict=True) if v > 0}
    errors = allowance.standard_errors()
    assert names == {
        "bulk_density", "drained_equivalent_angle_deg", "mass_flow_rate", "emptying_time",
        "ledge_equivalent_angle_deg", "pile_equivalent_angle_deg", "pile_angle_of_repose_deg",
    }  # fmt: skip
    rate = more[[o.key for o in ordered].index("hourglass.mass_flow_rate")]
    assert rate == pytest.approx((2.0 * errors["hourglass.mass_flow_rate"]) ** 2)


ENDS = np.cumsum([len(e.responses) for e in FOUND])[:-1]


@pytest.fixture(scope="module")
def tilted():
    """A library, and what is reported, measured and said of a laboratory that stands askew."""
    whole = library(CASE, Database.read(SHIPPED))
    size = 1.5 * np.eye(len(whole.effects))[[e.name for e in whole.effects].index("tilt_deg")]
    mean = whole.surfaces.mean(np.array([0.5, 0.5]), size)[0]
    runs = np.random.default_rng(3).multivariate_normal(mean, whole.surfaces.noise, 8)
    one = truths.Laboratory(1, "tilt_deg", {}, {}, 0.0, 1.5)
    reported, measured = judge.trial(CASE, one, np.split(runs, ENDS, axis=1), whole, 0)
    verdict = judge.verdict_on(one, whole, measured, 0)
    assert (verdict.kind, verdict.effects) == ("named", ("tilt_deg",))
    return whole, reported, measured, verdict


@pytest.mark.parametrize("off", [0.0, 5.0])
def test_a_name_outlives_fresh_runs_that_agree_and_no_others(tilted, monkeypatch, tmp_path, off):
    """off : scatters of a run by which fresh runs of the name differ from what its surfaces say."""
    whole, *_, verdict = tilted
    rng, scatter = np.random.default_rng(4), np.sqrt(np.diag(whole.surfaces.noise))
    each = CASE.diagnosis.verify_replicates

    def made(space, requests, yes, report):
        found = {}
        for i, request in enumerate(requests):  # by explanation, experiment and seed
            named = len(found) >= each * len(FOUND) or len(requests) == each * len(FOUND)
            at = verdict.best if named else verdict.picture.none
            mean = whole.surfaces.mean(at.unit, at.amplitude)[0] + named * off * scatter
            values = np.split(rng.multivariate_normal(mean, whole.surfaces.noise), ENDS)
            own = i // each % len(FOUND)
            responses = dict(zip(FOUND[own].responses, values[own].tolist(), strict=True))
            found[request.run_id] = Record(request, "ok", responses)
        return found

    monkeypatch.setattr("calibrator.diagnosis.confirm.carried_out", made)
    monkeypatch.setattr(fresh, "FOLDER", tmp_path)
    kind, effects, records = fresh.outlived(CASE, *tilted, dry=False)
    if off:
        assert (kind, effects) == ("ambiguous", ("tilt_deg", "unknown"))
    else:
        assert (kind, effects) == ("named", ("tilt_deg",))
    assert len(records) >= 2 * len(FOUND) * each


def test_where_fresh_runs_are_missing_nothing_is_said_and_none_is_made(
    tilted, monkeypatch, tmp_path
):
    monkeypatch.setattr(fresh, "FOLDER", tmp_path / "none")
    assert fresh.outlived(CASE, *tilted, dry=True) is None
    assert not (tmp_path / "none" / "batches").exists()
