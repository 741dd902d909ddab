"""Where runs succeed, learnt from how they ended."""

import numpy as np
import pytest

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.errors import CalibratorError
from calibrator.plan.design import sobol
from calibrator.responses.success import LIKELY, Success, _some, require_good
from calibrator.runs.record import Record
from calibrator.runs.request import Request

OWN = Problem(
    (
        Parameter("rolling_friction", 0.05, 0.45),
        Parameter("sliding_friction", 0.2, 0.7),
        Parameter("neck_diameter", 16e-3, 20e-3),
    ),
    (Target("hourglass", "mass_flow_rate", 0.03), Target("ledge", "bulk_density", 1600.0)),
)


def run(setup, point, status="ok", **responses):
    values = dict(zip(OWN.names, map(float, point), strict=True))
    request = Request.of(setup, **{n: values[n] for n in OWN.seen_by(setup)})
    good = {"mass_flow_rate": 0.03} if setup == "hourglass" else {"bulk_density": 1600.0}
    return Record(request, status, responses or (good if status == "ok" else {}))


def records(bad, setup="hourglass", count=24):
    points = sobol(OWN, count)
    found = [run(s, p) for s in ("hourglass", "ledge") if s != setup for p in points]
    return found + [run(setup, p, "clogged" if bad(p) else "ok") for p in points]


def beyond(point):
    return point[0] > 0.3


def test_the_friction_beyond_which_all_runs_clog_is_found_from_few_runs():
    success, asked = Success.of(OWN, records(beyond)), sobol(OWN, 500)
    right = (success.probability(asked) > LIKELY) == (asked[:, 0] <= 0.3)
    assert right.mean() > 0.95
    assert (success.shortfall(np.array([[0.1, 0.4, 18e-3], [0.42, 0.4, 18e-3]])) > 0).tolist() == [
        False,
        True,
    ]
    assert success.nearest(np.array([0.44, 0.45, 18e-3])) == [
        "hourglass runs clogged at 4 of the 4 nearest sets"
    ]
    assert success.nearest(np.array([0.06, 0.45, 18e-3])) == []
    assert (success.among(asked)[:, 0] < 0.33).all()


def test_the_set_up_that_fails_says_nothing_of_parameters_that_it_does_not_have():
    success = Success.of(OWN, records(beyond, setup="ledge"))
    necks = np.array([[0.35, 0.4, 16e-3], [0.35, 0.4, 20e-3]])
    assert np.ptp(success.probability(necks)) == 0 and (success.shortfall(necks) > 0).all()
    assert "ledge runs clogged" in success.sentences[0] and np.isnan(success.failed[:, 2]).all()


def test_without_failures_everything_is_as_it_was():
    success = Success.of(OWN, records(lambda p: False))
    assert success.certain and not success.sentences
    assert (success.probability(sobol(OWN, 5)) == 1).all()


def test_failures_that_come_by_chance_leave_candidates():
    draw = np.random.default_rng(1)
    success = Success.of(OWN, records(lambda p: draw.random() < 0.7, count=40))
    asked = sobol(OWN, 200)
    assert len(success.among(asked)) >= 1 and (success.shortfall(asked) == 0).any()


def test_a_run_without_a_targets_response_has_not_succeeded():
    found = [*records(lambda p: False), run("hourglass", [0.4, 0.6, 17e-3], bulk_density=1600.0)]
    assert Success.of(OWN, found).failed[0, 0] == 0.4


def test_every_run_of_a_set_up_failed_is_one_sentence_with_what_to_do():
    with pytest.raises(CalibratorError, match="all 24 hourglass runs clogged: widen the neck"):
        require_good(OWN, records(lambda p: True))
    with pytest.raises(CalibratorError, match="the only ledge run did not settle: raise longest"):
        require_good(OWN, [run("ledge", [0.1, 0.4, 18e-3], "not_settled")])
    require_good(OWN, records(beyond))


def test_the_classifier_sees_some_of_many_runs_and_enough_of_the_failed():
    good = np.ones(5000, bool)
    good[:20] = False
    rows = _some(good)
    assert len(rows) == 500 and (~good[rows]).sum() == 20
    good[:2500] = False
    assert (~good[_some(good)]).sum() == 250
