"""What the comparison with other tools claims, as far as it needs none of them."""

import numpy as np
import pytest

from benchmarks.peers.methods import Outcome, how, own_error, spoken
from benchmarks.peers.rows import needed, ratio, reachable_row, unreachable_row
from benchmarks.peers.runs_needed import CASE
from benchmarks.peers.trial import TASKS, problem_of, reachable_trial
from benchmarks.peers.truth import Surface
from calibrator.case.toml import read_case


@pytest.fixture(scope="module")
def surface():
    case = read_case(CASE)
    assert case.shipped is not None
    return Surface.of(case, case.shipped)


def test_failures_are_counted_beside_the_median_and_not_in_it():
    found = needed([10, 20, 30, 600], [True, True, True, False])
    assert found["median_runs"] == 25 and found["failures"] == 1
    assert found["failure_interval"] == pytest.approx([0.00631, 0.806])


def test_a_ratio_whose_interval_holds_one_is_no_claim():
    rng = np.random.default_rng(1)
    ours = rng.integers(9, 25, 20).tolist()
    assert ratio(rng.permutation(ours).tolist(), ours)["fewer"] == "no claim"
    assert ratio([3 * r for r in ours], ours) == {
        "times_ours": 3.0,
        "interval": [3.0, 3.0],
        "fewer": "ours",
    }


def test_what_a_peer_says_is_searched_and_not_taken_for_granted():
    text = "a/b/mod.py: RuntimeWarning: target cannot be reached\nall well"
    assert spoken(text) == ("mod.py: RuntimeWarning: target cannot be reached",)
    assert own_error("Smallest mean absolute percentage error =  2.5e-02,\nx") == 0.025
    assert own_error("   value   0.3  2797.2  0.005\n  sigma 0.1") == 0.005
    assert how({"error": "", "stopped": True}) == "cut off"
    peer = Outcome(30, False, 0.1, "done", by_itself=(33, False), ended="own rule")
    row = unreachable_row([peer, peer])
    assert row["flagged"] is None and row["ended"] == {"own rule": 2}
    assert row["could_speak_of_reach"] == 0
    assert "ended" not in reachable_row([Outcome(9, True, 0.01, "confirmed", False)])


def test_the_truth_departs_from_similarity_as_real_pairs_do(surface):
    problem = problem_of(surface.case, TASKS["5"])
    light = np.array([[0.3, 0.45, 0.35e-3, 2600.0, 10e6]])
    heavy = light * [1, 1, 1, 2800 / 2600, 2800 / 2600]
    rise = surface.mean(problem, heavy)[0] / surface.mean(problem, light)[0]
    by_mass = np.array([2800 / 2600, 1.0, 2800 / 2600])
    expected = by_mass * (1 + surface.shifts / 2) / (1 - surface.shifts / 2)
    assert rise == pytest.approx(expected, rel=1e-6)


def test_few_sets_meet_the_hard_targets_and_many_the_easy_ones(surface):
    shares = {
        name: np.median([reachable_trial(surface, task, seed).share() for seed in range(1, 9)])
        for name, task in TASKS.items()
    }
    assert shares["2 hard"] < 0.05 < shares["2"]
