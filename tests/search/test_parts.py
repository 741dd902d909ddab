"""Words on targets out of reach: a unit is asked about where a power of ten would explain it."""

import pytest

from calibrator.search.parts import TargetReach


def reach(key, value, low, high, gap=9.0):
    return TargetReach(f"hourglass.{key}", value, low, high, low, gap)


@pytest.mark.parametrize(
    ("key", "value", "low", "high", "said"),
    [
        ("mass_flow_rate", 26.0, 0.024, 0.028, "is it in g/s instead of kg/s?"),
        ("mass_flow_rate", 0.26, 0.024, 0.028, "about 10 times what the box gives"),
        ("bulk_density", 1.606, 1557, 1685, "is it in g/cm3 instead of kg/m3?"),
        ("residual_fraction", 35.0, 0.3, 0.4, "is it in % instead of 1?"),
        ("drained_asymmetry_deg", -300.0, -4.0, -2.0, "about 100 times what the box gives"),
    ],
)
def test_a_target_off_by_a_power_of_ten_asks_about_its_unit(key, value, low, high, said):
    found = reach(key, value, low, high)
    assert said in found.sentence and "widen the bounds" not in found.sentence


@pytest.mark.parametrize(
    ("value", "low", "high"), [(60, 30, 40), (0, 1, 2), (-5, 40, 50), (90, 0, 9)]
)
def test_another_target_out_of_reach_asks_for_wider_bounds(value, low, high):
    found = reach("drained_equivalent_angle_deg", value, low, high)
    assert not found.hint and "widen the bounds" in found.sentence


def test_a_target_within_its_own_error_has_no_hint():
    assert not reach("bulk_density", 145.0, 1400, 1500, gap=0.5).hint
