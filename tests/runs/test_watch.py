"""How long runs will take, by the pace of those that have ended and of those that have not."""

import pytest

from calibrator.runs import watch
from calibrator.runs.batch import Batch
from calibrator.runs.watch import Watch
from tests.runs.toy_runs import folder_with, requests


@pytest.fixture
def watched(tmp_path, monkeypatch):
    """Progress of four runs of 100 predicted seconds on two cores, after some have ended."""
    clock = [0.0]
    monkeypatch.setattr(watch.time, "monotonic", lambda: clock[0])
    folder, asked = folder_with(tmp_path), requests(4)
    folder.prepare()
    ids = {r.run_id for r in asked}

    def after(seconds, ended, cores=2):
        clock[0] = 0.0
        batch = Batch(asked, {r.run_id: 100.0 for r in asked}, {r.run_id: 0 for r in asked})
        seen = Watch(folder, batch, cores, ids, [], 2)
        for request in asked[:2]:
            folder.log(request).write_text("YADE says something\n")
        seen.look()
        clock[0] = seconds
        for request in asked[:ended]:
            folder.log(request).write_text("YADE says something\nstatus  : 256 (x)\n")
        for request in asked[ended : ended + 2]:
            folder.log(request).write_text("YADE says something\n")
        return seen.look()

    return after


def test_the_time_left_follows_the_pace_of_the_runs_and_not_the_prediction_alone(watched):
    """Four runs on two cores, predicted to take 200 s; the first two took 400."""
    assert watched(0, 0).left == pytest.approx(200)
    assert 250 <= watched(400, 2).left <= 450


def test_the_time_left_is_never_nothing_while_a_run_is_under_way(watched):
    for seconds in (90, 150, 400, 1000, 10_000):  # the first has not ended yet
        assert watched(seconds, 0).left > 0.2 * seconds
    for cores in (2, None):
        assert watched(2000, 3, cores).left > 100
    assert watched(2000, 4).left == 0


def test_runs_that_outlive_their_prediction_say_how_long_those_behind_them_will_take(watched):
    """It said that 200 s were left, with two of four runs at four times what was predicted."""
    assert 400 <= watched(400, 0).left <= 700


def test_a_run_that_ended_without_a_record_is_to_be_tried_again_and_not_done(watched):
    progress = watched(100, 2)
    assert (progress.done, progress.failed, progress.retried, progress.total) == (0, 0, 2, 4)


def test_what_an_earlier_attempt_left_is_no_end_of_the_next_one(tmp_path):
    folder, (request,) = folder_with(tmp_path), requests(1)
    folder.prepare()
    folder.log(request).write_text("status  : 256 (x)\n")
    batch = Batch([request], {request.run_id: 100.0}, {request.run_id: 1})
    seen = Watch(folder, batch, None, {request.run_id}, [], 3)
    assert (seen.look().retried, seen.ended) == (1, [])
    folder.log(request).unlink()
    folder.log(request).write_text("status  : 256 (y)\n")
    assert seen.look().retried == 1 and seen.ended == [request]
