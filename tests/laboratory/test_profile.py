"""Profiles whose angles can be written down, and the scripts' own measurement of the same heap."""

import numpy as np
import pytest

from calibrator.errors import CalibratorError
from calibrator.laboratory.profile import Ground, measure_profile
from calibrator.laboratory.scripts import scripts_measure
from tests.laboratory.piles import RADIUS, RECORDED, pile

X = np.linspace(-0.06, 0.06, 601)


def heap(degrees, middle=0.0, rounded=0.0):
    return np.maximum(0.02 - np.tan(np.radians(degrees)) * np.hypot(X - middle, rounded), 0)


@pytest.mark.parametrize("degrees", [20.0, 35.0])
def test_a_cone_has_its_angles_and_no_asymmetry_wherever_its_axis_is(degrees):
    found = measure_profile(X, heap(degrees, 0.004), "heap", Ground()).values
    assert found["pile_angle_of_repose_deg"].value == pytest.approx(degrees, abs=0.3)
    assert found["pile_equivalent_angle_deg"].value == pytest.approx(degrees, abs=0.7)
    assert found["pile_asymmetry_deg"].value == pytest.approx(0, abs=0.3)


def test_a_rounded_apex_lies_below_the_tip_of_the_fitted_cone():
    sharp, blunt = (
        measure_profile(X, heap(30, rounded=r), "heap", Ground()).values for r in (0.0, 0.004)
    )
    assert blunt["pile_apex_rounding"].value - sharp["pile_apex_rounding"].value > 5e-4


def test_sides_that_differ_are_an_asymmetry_and_an_error_of_half_their_difference():
    z = np.where(X < 0, heap(25), heap(29))
    found = measure_profile(X, z, "heap", Ground()).values
    assert found["pile_angle_of_repose_deg"].value == pytest.approx(27, abs=0.5)
    assert abs(found["pile_asymmetry_deg"].value) == pytest.approx(2, abs=0.3)
    assert found["pile_angle_of_repose_deg"].error == pytest.approx(2, abs=0.3)


@pytest.mark.parametrize("name", sorted(RECORDED))
def test_the_radial_profile_of_a_run_gives_the_angle_of_its_record(name):
    measure, centres = scripts_measure(), pile(name)
    half = 1.2 * np.quantile(np.hypot(*centres[:, :2].T), 0.98) + 2 * RADIUS
    scanned = measure.height_map(centres, RADIUS, half, half)
    ours = measure.pile_responses(*scanned, RADIUS)
    for response, value in RECORDED[name].items():
        assert ours[0][response] == pytest.approx(value, abs=0.02)
    both = np.concatenate([-ours[1][::-1], ours[1]])
    found = measure_profile(
        both,
        np.tile(ours[2], 2)[np.r_[len(ours[2]) - 1 : -1 : -1, 0 : len(ours[2])]],
        "heap",
        Ground(grain_radius=RADIUS, axis=0.0, base=0.0),
    ).values
    angle = RECORDED[name]["pile_angle_of_repose_deg"]
    assert found["pile_angle_of_repose_deg"].value == pytest.approx(angle, abs=0.5)


@pytest.mark.parametrize("turned", [False, True])
def test_a_slope_has_its_angles_whichever_side_its_wall_is(turned):
    x = np.linspace(0, 0.03, 200)
    z = 0.03 * np.tan(np.radians(33)) * (1 - x / 0.03)
    found = measure_profile(-x if turned else x, z, "slope", Ground(base=0.0)).values
    assert found["ledge_angle_of_repose_deg"].value == pytest.approx(33, abs=0.2)
    assert found["ledge_equivalent_angle_deg"].value == pytest.approx(33, abs=0.2)
    assert found["ledge_curvature"].value == pytest.approx(0, abs=0.5)


def test_a_crater_rises_from_the_neck():
    x = np.linspace(-0.015, 0.015, 301)
    z = np.tan(np.radians(38)) * np.maximum(np.abs(x) - 0.004, 0)
    size = Ground(grain_radius=5e-4, cylinder_diameter=0.03, neck_diameter=0.008)
    found = measure_profile(x, z, "crater", size).values
    assert found["drained_angle_of_repose_deg"].value == pytest.approx(38, abs=0.3)
    assert found["drained_asymmetry_deg"].value == pytest.approx(0, abs=0.2)


@pytest.mark.parametrize(
    ("x", "z", "shape", "ground", "why"),
    [
        (X[:10], heap(30)[:10], "heap", Ground(), "only 10 points"),
        (X[250:351], heap(20)[250:351], "heap", Ground(base=0.0), "ends on the flank"),
        (X, heap(30), "heap", Ground(axis=1.0), "correct --axis"),
        (X, 0 * X, "heap", Ground(), "no heap"),
        (X, heap(30), "crater", Ground(), "--neck-diameter"),
        (X, 0.06 - X, "slope", Ground(box_length=0.05), "correct --box-length"),
    ],
)
def test_a_profile_that_cannot_be_one_is_refused_with_what_to_do(x, z, shape, ground, why):
    with pytest.raises(CalibratorError, match=why):
        measure_profile(x, z, shape, ground)


def test_one_side_of_a_heap_is_taken_twice_and_has_no_asymmetry():
    half = X >= 0
    found = measure_profile(X[half], heap(30)[half], "heap", Ground())
    assert found.values["pile_angle_of_repose_deg"].value == pytest.approx(30, abs=0.3)
    assert "pile_asymmetry_deg" not in found.values and "only one side" in found.warnings[0]
