"""A plan is given up where enough of its runs have failed, and all in the same way."""

import pytest

from calibrator.errors import CalibratorError
from calibrator.runs.futile import FEWEST, End, refuse_futile


def fast(speed):
    return End("unstable", f"filling: a grain moves at {speed:.3g} m/s, the step of 1e-05 s")


ALIKE = [fast(speed) for speed in (46.9, 1.2e9, 3.0, 17.0, 5.0, 8.0, 1e-3, 7.7)]


def test_failures_are_alike_whatever_their_numbers():
    assert len(ALIKE) == FEWEST
    with pytest.raises(CalibratorError, match=r"the first 8 of 56 runs .*46\.9 m/s.*--go-on"):
        refuse_futile(ALIKE, 56)


@pytest.mark.parametrize(
    ("ends", "total"),
    [
        (ALIKE[1:], 56),  # too few
        (ALIKE, FEWEST),  # nothing is left to be saved
        (ALIKE, None),  # it is to go on
        ([*ALIKE, End("ok", "")], 56),
        ([*ALIKE, End("not_settled", "filling: not at rest")], 56),
        ([End("clogged", "")] * 9, 56),  # they say something
        ([End("ok", "")] * 9, 56),
    ],
)
def test_all_other_plans_go_on(ends, total):
    refuse_futile(ends, total)


def test_the_remedy_is_that_of_the_status():
    with pytest.raises(CalibratorError, match="allow more time, or add --go-on"):
        refuse_futile([End("not_settled", "filling: not at rest")] * 9, 20)
    with pytest.raises(CalibratorError, match="correct the case, or add --go-on"):
        refuse_futile([End("crash", "exit code 1: boom")] * 9, 20)
