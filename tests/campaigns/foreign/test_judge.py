"""The judge, on a laboratory drawn from the surfaces themselves, and its counts."""

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.diagnosis import experiments as ex
from calibrator.runs.database import Database
from tests.campaigns.foreign import allowance, judge, truths
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
