"""One grain on walls that turn, against formulas: both carry it as rigid bodies would."""

import math

import pytest

pytestmark = pytest.mark.yade


def test_a_grain_without_rolling_friction_spins_at_the_bottom_as_fast_as_the_shell_moves(measured):
    m = measured("on_a_turning_shell", 0.6, 0.0)
    assert m["angle"] == pytest.approx(0, abs=0.2)
    # the corners of the shell's polygon are as deep as the grain's overlap: it hops a little
    assert m["spin"] == pytest.approx(m["drum"] * m["shell"] / m["radius"], rel=0.05)


def test_rolling_friction_carries_a_rolling_grain_up_to_its_own_angle(measured):
    """The moment mu_r r N about the contact holds the weight at tan(angle) = mu_r."""
    m = measured("on_a_turning_shell", 0.6, 0.2)
    assert math.tan(math.radians(m["angle"])) == pytest.approx(0.2, rel=0.03)
    assert m["spin"] == pytest.approx(m["drum"] * m["shell"] / m["radius"], rel=0.05)


def test_a_grain_that_cannot_roll_slips_at_the_angle_of_friction_and_turns_with_the_drum(measured):
    m = measured("on_a_turning_shell", 0.2, 0.6)
    assert math.tan(math.radians(m["angle"])) == pytest.approx(0.2, rel=0.03)
    assert m["spin"] == pytest.approx(0, abs=1.5 * m["drum"])


def test_a_grain_stuck_to_a_face_goes_round_with_it(measured):
    m = measured("on_a_turning_face", "stuck")
    assert m["turned"] == pytest.approx(m["face_turned"], rel=0.01)
    assert m["distance"] == pytest.approx(1, abs=0.01)


def test_a_grain_that_rolls_on_a_face_goes_round_at_two_sevenths_of_its_speed(measured):
    """The ball on a turntable: S. Earnshaw, Dynamics (1844); K. Weltner, Am. J. Phys. 47 (1979)."""
    m = measured("on_a_turning_face", "rolling")
    assert m["turned"] == pytest.approx(2 / 7 * m["face_turned"], rel=0.02)
    assert m["distance"] == pytest.approx(1, abs=0.01)


def test_a_grain_that_slips_on_a_face_is_dragged_by_friction_alone(measured):
    m = measured("on_a_turning_face", "slipping")
    assert m["speed"] == pytest.approx(m["slip_speed"], rel=0.03)
    assert m["speed"] < 0.3 * m["face_turned"]
