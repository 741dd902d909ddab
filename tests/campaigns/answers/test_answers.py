"""A few made-up laboratories from case file to page; the campaign goes through hundreds."""

import pytest

from tests.campaigns.answers.campaign import counted, one, share

SEEDS = range(1, 9)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_said_of_a_made_up_laboratory_agrees_with_its_truth(seed):
    found = one(seed)
    assert not found["traceback"], found["traceback"]
    for what in ("stale", "status_against_words", "contradictions", "over_ceiling"):
        assert not found[what], found[what]
    assert not found.get("wrong_passed")


def test_a_share_comes_with_an_interval_that_counts_laboratories():
    assert share(0, 400)["interval_95"] == [0.0, 0.0092]
    assert share(1, 0) == {"count": 1, "of": 0}


def test_intervals_are_counted_where_they_do_not_end_at_a_bound():
    inside, outside = ({"name": "x", "inside_box": b, "holds": h, "share": 0.1}
                       for b, h in ((True, True), (False, False)))  # fmt: skip
    one_case = {
        "ended": "report", "traceback": "", "stale": "", "status_against_words": [],
        "contradictions": [], "over_ceiling": False, "intervals": [inside, outside],
    }  # fmt: skip
    found = counted([one_case, one_case])
    assert found["intervals_that_hold_the_truth"]["of"] == 2
    assert found["intervals_that_hold_the_truth"]["share"] == 1.0
    assert found["intervals_at_a_bound"] == 2
