"""What runs will cost, before any is finished and after."""

import pytest

from calibrator.runs.cost import core_hours, core_seconds
from calibrator.runs.record import Record
from calibrator.runs.request import Request

HEAP = Request.of("conical_pile", seed=1)
LEDGE = Request.of("ledge", seed=1)
DRUM = Request.of("rotating_drum", seed=1)


def took(request, times, status="ok"):
    """A finished run that took so many times what is predicted without any."""
    (seconds,) = core_seconds([request]) * times
    return Record(
        request, status, diagnostics={"filling_cpu": seconds / 4, "release_cpu": 0.75 * seconds}
    )


def test_finished_runs_correct_what_is_predicted_of_their_set_up():
    before = core_seconds([HEAP, LEDGE])
    done = [took(HEAP, 3.0), took(HEAP, 4.0), took(HEAP, 90.0), took(LEDGE, 0.5)]
    assert core_seconds([HEAP, LEDGE], done) == pytest.approx(before * [4.0, 0.5])


def test_a_set_up_without_a_finished_run_is_corrected_by_the_others():
    """It was forecast as if on another core until its first run, hours later, was there."""
    (before,) = core_seconds([DRUM])
    (after,) = core_seconds([DRUM], [took(HEAP, 4.0), took(LEDGE, 2.0)])
    assert after == pytest.approx(3 * before)


def test_a_slower_core_takes_longer_until_its_runs_say_how_long():
    fast, slow = (core_seconds([DRUM], rate=rate)[0] for rate in (2e6, 1e6))
    assert slow - 2.0 == pytest.approx(2 * (fast - 2.0))  # two of them are the start
    done = [took(DRUM, 3.0)]
    fast, slow = (core_seconds([DRUM], done, rate)[0] for rate in (2e6, 1e6))
    assert fast == pytest.approx(slow)


def test_a_run_that_failed_or_says_no_time_corrects_nothing():
    done = [took(HEAP, 9.0, "timeout"), Record(LEDGE, "ok")]
    assert (core_seconds([HEAP, LEDGE], done) == core_seconds([HEAP, LEDGE])).all()
    assert core_hours(Record(LEDGE, "ok")) == pytest.approx(core_seconds([LEDGE])[0] / 3600)
