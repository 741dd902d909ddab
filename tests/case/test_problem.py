"""Values that a parameter or a bound cannot have."""

import math

import numpy as np
import pytest

from calibrator.case.problem import Parameter
from calibrator.case.values import checked_value
from calibrator.errors import CalibratorError


def test_a_number_too_large_for_a_float_is_refused_with_a_message_that_can_be_shown():
    for value in (10**400, -(10**400), 10**5000):
        with pytest.raises(CalibratorError, match="give a value from") as caught:
            checked_value("young_modulus", value)
        assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("wrong", "words"),
    [({"scale": "cubic"}, "scale"), ({"scale": "log", "low": 0.0}, "above zero")],
)
def test_an_impossible_scale_is_refused(wrong, words):
    with pytest.raises(CalibratorError, match=words):
        Parameter(**{"name": "rolling_friction", "low": 0.1, "high": 0.5, **wrong})


def test_a_log_scale_has_the_same_digits_on_every_processor():
    """A planned run is known by them; numpy's own power differs between processors."""
    modulus = Parameter("young_modulus", 5e6, 5e7, scale="log")
    shares = np.linspace(0, 1, 1001)
    expected = [min(max(5e6 * math.pow(5e7 / 5e6, s), 5e6), 5e7) for s in shares.tolist()]
    assert modulus.values_at(shares).tolist() == expected
