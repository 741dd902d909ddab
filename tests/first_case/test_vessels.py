"""What a smaller vessel leaves of a measurement."""

import json
import math

import pytest

from benchmarks.common import RESULTS
from calibrator.first_case.grains import SOFTNESS
from calibrator.first_case.vessels import (
    EMPTY_RING,
    FREE_HEIGHT,
    FREE_WIDTH,
    NARROWEST_NECK,
    SOFTER,
    Kept,
    Lost,
    across,
    carried,
    smaller,
    softened,
)
from calibrator.runs.setups import NOMINAL_FRACTION

GRAINS = {"particle_radius": 1e-3, "particle_density": 2500.0}
HEAP = {
    "cylinder_diameter": 0.1,
    "fill_height": 0.12,
    "lift_speed": 0.08,
    "lift_height": 0.05,
    **GRAINS,
}
FLOW = {"cylinder_diameter": 0.2, "neck_diameter": 0.03, "fill_mass": 8.0, **GRAINS}


def test_a_vessel_that_is_small_enough_is_simulated_as_it_is():
    assert smaller("conical_pile", HEAP, 60.0, []) == HEAP
    assert carried("conical_pile", "pile_angle_of_repose_deg", 30.0, HEAP, HEAP) == Kept(30.0)
    assert carried("hourglass", "emptying_time", 3.0, FLOW, FLOW) == Kept(3.0)


def test_a_heap_shrinks_in_proportion_and_is_lifted_at_the_same_froude_number():
    new = smaller("conical_pile", HEAP, 20.0, [])
    assert across("conical_pile", new) == pytest.approx(20)
    assert new["fill_height"] / new["cylinder_diameter"] == pytest.approx(1.2, rel=1e-3)
    ratio = new["lift_speed"] ** 2 / new["cylinder_diameter"]
    assert ratio == pytest.approx(0.08**2 / 0.1, rel=1e-2)


def test_a_cylinder_is_lifted_no_higher_than_clear_of_the_heap():
    high = {**HEAP, "lift_height": 0.5}
    new = smaller("conical_pile", high, 60.0, [])
    volume = math.pi / 4 * 0.1**2 * 0.12
    steepest = (3 * volume / math.pi) ** (1 / 3)  # of 45 degrees: as high as its radius
    assert new["lift_height"] == pytest.approx(steepest - 0.05 + 3 * 2e-3, rel=1e-3)
    assert {**new, "lift_height": 0.5} == high


def test_a_neck_whose_rate_was_measured_keeps_its_width_and_its_free_surroundings():
    new = smaller("hourglass", FLOW, 30.0, ["mass_flow_rate"])
    assert new["neck_diameter"] == FLOW["neck_diameter"]
    assert new["cylinder_diameter"] >= FREE_WIDTH * 0.03 * (1 - 1e-3)
    base = math.pi / 4 * new["cylinder_diameter"] ** 2
    assert new["fill_mass"] / (NOMINAL_FRACTION * 2500 * base) >= FREE_HEIGHT * 0.03 * (1 - 1e-3)


def test_grains_become_coarser_only_as_far_as_the_neck_lets_them():
    new = smaller("hourglass", FLOW, 15.0, ["mass_flow_rate"])
    assert 1e-3 < new["particle_radius"] <= 0.03 / NARROWEST_NECK / 2 * (1 + 1e-3)


def test_the_rate_of_coarser_grains_is_beverloos():
    new = {**FLOW, "particle_radius": 1.5e-3}
    kept = carried("hourglass", "mass_flow_rate", 0.1, FLOW, new)
    law = [(30 - EMPTY_RING * d) ** 2.5 for d in (2, 3)]
    assert kept.value == pytest.approx(0.1 * law[1] / law[0])
    assert 0.02 < kept.error / kept.value < 0.1 and "3 mm stand in for 2 mm" in kept.words


def test_a_small_heap_is_flatter_by_its_fit_and_its_error_grows_as_it_shrinks():
    found = [
        carried(
            "conical_pile",
            "pile_angle_of_repose_deg",
            30.0,
            HEAP,
            smaller("conical_pile", HEAP, a, []),
        )
        for a in (40, 30, 20, 15)
    ]
    values, errors = [k.value for k in found], [k.error for k in found]
    assert values == sorted(values, reverse=True) and errors == sorted(errors)
    assert found[-1].value == pytest.approx(30 - 50 * (1 / 15 - 1 / 50))


@pytest.mark.parametrize(
    "response",
    ["discharge_time", "residual_mass", "drained_angle_of_repose_deg", "late_early_ratio"],
)
def test_what_belongs_to_the_size_is_lost_with_a_reason(response):
    new = smaller("hourglass", FLOW, 20.0, ["mass_flow_rate"])
    assert carried("hourglass", response, 1.0, FLOW, new).words
    assert isinstance(carried("hourglass", response, 1.0, FLOW, new), Lost)


def test_a_drum_keeps_its_size_and_speed_and_gets_coarser_grains():
    drum = {"drum_diameter": 0.084, "drum_depth": 0.02, "rotation_rpm": 15.0, **GRAINS}
    drum["particle_radius"] = 0.6e-3
    new = smaller("rotating_drum", drum, 35.0, [])
    assert across("rotating_drum", new) == pytest.approx(35, rel=1e-3)
    assert {**new, "particle_radius": 0.6e-3} == drum
    shallow = smaller("rotating_drum", {**drum, "drum_depth": 0.008}, 20.0, [])
    assert shallow["drum_depth"] / (2 * shallow["particle_radius"]) == pytest.approx(5, rel=1e-3)
    assert carried("rotating_drum", "drum_angle_deg", 40.0, drum, new).error > 0
    assert isinstance(carried("rotating_drum", "drum_blur", 1e-3, drum, new), Lost)


def test_softer_grains_fill_denser_and_what_they_do_is_added_to_what_the_vessel_does():
    assert softened("bulk_density", Kept(1500.0), SOFTNESS[0]) == Kept(1500.0)
    step = Kept(1480.0, 8.0, "walls loosen it")
    soft = [softened("bulk_density", step, s) for s in SOFTNESS[1:]]
    assert 1480 < soft[0].value < soft[1].value < 1.05 * 1480
    assert all(s.error > step.error and s.words.startswith("walls loosen it; ") for s in soft)


def test_every_angle_is_less_sure_with_softer_grains_and_a_number_that_nobody_measured_is_kept():
    for response in ("pile_angle_of_repose_deg", "drum_angle_deg"):
        assert softened(response, Kept(30.0), SOFTNESS[1]).error > 0.2
    assert "taken from" in softened("drum_angle_deg", Kept(30.0), SOFTNESS[2]).words
    assert softened("residual_fraction", Kept(0.4), SOFTNESS[2]) == Kept(0.4)


def test_what_softer_grains_do_is_what_the_benchmark_measured():
    measured = json.loads((RESULTS / "softness.json").read_text())["less_stiff"]
    for key, by_softness in measured.items():
        response = key.partition(".")[2]
        for softness, found in by_softness.items():
            change, error = SOFTER[response][float(softness)]
            assert abs(found["mean"] - change) < max(2 * found["standard_error"], error), key
