"""Damaged input of every kind is accepted and means what it says, or is refused with one line.

See kinds.py.
"""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.campaigns.bad_input.kinds import KINDS, use
from tests.campaigns.bad_input.yard import Yard

FEW = 250


@pytest.fixture(scope="module")
def yard(tmp_path_factory):
    return Yard(tmp_path_factory.mktemp("yard") / "fuzz")


@pytest.mark.parametrize("name", KINDS)
def test_damaged_input_is_never_a_traceback_a_hang_or_a_silent_default(yard, name):
    @settings(
        max_examples=FEW,
        deadline=None,
        database=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.deferred(lambda: KINDS[name].draw(yard)))
    def one(drawn):
        use(yard, name, drawn)

    one()
    assert yard.executed() == 0


def test_an_effect_that_is_given_as_off_is_taken_as_it_stands(yard):
    """It is left out of the request, which the oracle once took for a lost value."""
    use(yard, "request", ("ledge", {"bond_number": 0, "tilt_deg": 0.0}))
