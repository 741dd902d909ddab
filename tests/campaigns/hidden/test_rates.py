"""Shares by laboratory, and laboratories that come out of the surfaces' own runs."""

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.diagnosis import experiments as ex
from calibrator.plan.design import sobol
from calibrator.runs.database import Database
from tests.campaigns.hidden.campaign import earlier_last_tests
from tests.campaigns.hidden.intervals import (
    effective_size,
    exact,
    interval,
    laboratories_with,
    upper,
)
from tests.campaigns.hidden.laboratory import CASE, SHIPPED
from tests.campaigns.hidden.left_out import LeftOut, left_out, said_of_left_out, without
from tests.campaigns.hidden.trials import disjoint


def test_six_laboratories_judged_ten_times_are_six_and_not_sixty():
    alarms, pools = [False] * 60, [i // 10 for i in range(60)]
    assert effective_size(pools) == 6
    assert interval(alarms, pools) == pytest.approx((0.0, 0.459), abs=1e-3)
    assert upper(0, 6) == pytest.approx(1 - 0.05 ** (1 / 6))
    assert laboratories_with(alarms, pools, whole=False) == (0, 6)


def test_laboratories_of_unequal_size_are_worth_fewer():
    assert effective_size([1, 2, 3]) == 3
    assert effective_size([1] * 10 + [2] * 10) == 2
    assert 1 < effective_size([1] * 10 + [2]) < 2


@pytest.mark.parametrize("correlation", [0.05, 0.5, 0.9])
@pytest.mark.parametrize("share", [0.6, 0.9, 0.97])
def test_intervals_hold_the_truth_as_often_as_they_say(share, correlation):
    rng, pools, held = np.random.default_rng(2), [i // 10 for i in range(150)], 0
    pair = np.array([share, 1 - share]) * (1 / correlation - 1)
    for _ in range(200):
        hits = rng.random(150) < np.repeat(rng.beta(*pair, 15), 10)
        low, high = interval(hits.tolist(), pools)
        held += low <= share <= high
        assert low < high
    assert held >= 188


def test_no_trial_leaves_everything_open():
    assert interval([], []) == exact(0, 0) == (0.0, 1.0)


def test_a_pool_gives_every_trial_runs_of_its_own_while_there_are_any():
    pool = [np.arange(10.0)[:, None], np.arange(12.0)[:, None]]
    first, second = disjoint(pool, np.random.default_rng(1), 5)
    for a, b in zip(first, second, strict=True):
        assert len(a) == len(b) == 5
        assert not set(a.ravel()) & set(b.ravel())
    assert len(disjoint([np.zeros((5, 1)), np.zeros((9, 1))], np.random.default_rng(1), 5)) == 1


def test_a_set_that_is_left_out_is_in_no_surface():
    case, database = read_case(CASE), Database.read(SHIPPED)
    index = 3
    rest, values = without(database, case, index)
    point = dict(
        zip(case.problem.names, sobol(case.problem, case.diagnosis.sets)[index], strict=True)
    )
    left = [
        r
        for r in rest.records.values()
        if all(r.request.parameters[n] == pytest.approx(v) for n, v in point.items())
    ]
    assert not left
    assert len(values) == len(ex.experiments(case, case.observables)) == 7
    assert len(database) - len(rest) == 7 * 3  # two of the residual's runs, one of the others


def test_sets_that_are_left_out_are_counted_as_laboratories():
    case, database = read_case(CASE), Database.read(SHIPPED)
    few = left_out(case, database, trials=1, sets=(0, 3))
    assert [one.index for one in few] == [0, 3] and few[0].inner
    quiet, loud = ("no gap",) * 4, ("no gap", "ambiguous", "no gap", "no gap")
    none, some = ("none",) * 4, ("tilt_deg",) * 4
    sets = [
        LeftOut(0, (0.5, 0.5), 2, quiet, none),
        LeftOut(1, (0.5, 0.4), 2, loud, some),
        LeftOut(2, (0.05, 0.4), 1, quiet, some),
    ]
    said = said_of_left_out(sets, [])
    assert said["false_alarm_laboratories"] == [1, 3]
    assert said["inner_sets"]["false_alarm_laboratories"] == [1, 2]
    assert said["bic"]["false_alarm_laboratories"] == [2, 3]
    assert said["laboratories_with_one_replicate"] == 1
    assert [one["index"] for one in said["alarms"]] == [1]


def test_earlier_last_tests_stand_beside_the_last():
    earlier = earlier_last_tests()
    assert len(earlier) == 2
    for one in earlier:
        assert one["strong_named_interval_by_pool"] == exact(*one["strong_named_laboratories"])
