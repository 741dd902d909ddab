"""The slopes are those of the shipped runs, and what is forecast follows from them."""

import pytest

from benchmarks.numerics.scaled_vessels import empty_ring, larger_heaps, shifts
from benchmarks.numerics.sensitivities import sensitivities
from calibrator.case.lab import Observable
from calibrator.first_case.grains import SHAPES, open_parameters, stiffness
from calibrator.first_case.knowledge import CHEAP, SLOPES, factors, most_telling
from calibrator.first_case.vessels import EMPTY_RING, RING_ERROR

BOUNDS = {"rolling_friction": (0.1, 0.4), "sliding_friction": (0.2, 0.7)}


def row(key, value, scatter, role="calibrate"):
    setup, response = key.split(".")
    return Observable(setup, response, value, scatter, 3, role)


HEAP = row("conical_pile.pile_equivalent_angle_deg", 25.0, 0.5)
DENSITY = row("hourglass.bulk_density", 1550.0, 5.0)
CRATER = row("hourglass.drained_equivalent_angle_deg", 50.0, 0.5)


def test_the_slopes_are_those_that_the_benchmark_finds():
    found = sensitivities()
    for key, slope in SLOPES.items():
        assert (slope.rolling, slope.sliding, slope.scatter) == (
            found[key]["slope_rolling"],
            found[key]["slope_sliding"],
            found[key]["scatter"],
        )
    assert CHEAP.keys() <= SLOPES.keys()


def test_the_steps_to_smaller_vessels_are_those_that_the_shipped_runs_show():
    fitted, equivalent = shifts().values()
    ring = empty_ring()
    assert abs(fitted["lower"] - 50) < 8 and abs(equivalent["lower"]) < 25
    assert abs(ring["k"] - EMPTY_RING) < RING_ERROR
    larger = larger_heaps()
    assert abs(larger["pile_angle_of_repose_deg"] - 50) < 8
    assert abs(larger["bulk_density"] - 0.3) < 0.15


def test_more_data_never_widen_a_forecast_and_one_heap_does_not_tell_the_frictions_apart():
    one, two, three = (
        factors(r, BOUNDS) for r in ([HEAP], [HEAP, DENSITY], [HEAP, DENSITY, CRATER])
    )
    for name in BOUNDS:
        assert one[name] >= two[name] >= three[name] > 1
    assert one["rolling_friction"] > 1.5 > three["rolling_friction"]
    blurred = row(HEAP.key, 25.0, 1e6)
    assert factors([blurred], BOUNDS)["rolling_friction"] == pytest.approx(4**0.5)
    assert factors([row("rotating_drum.drum_angle_deg", 40.0, 1.0)], BOUNDS) == {}


def test_a_friction_too_small_to_matter_is_not_said_to_be_pinned_down():
    tiny = {"rolling_friction": (0.005, 0.15), "sliding_friction": (0.05, 0.6)}
    assert factors([HEAP, DENSITY, CRATER], tiny)["rolling_friction"] > 2


def test_the_measurement_that_helps_most_is_not_one_that_is_there():
    key, words, error = most_telling([HEAP], BOUNDS)
    assert key not in (HEAP.key,) and words and error > 0
    assert (
        factors([HEAP], BOUNDS, {key: error})["rolling_friction"]
        < factors([HEAP], BOUNDS)["rolling_friction"]
    )
    everything = [HEAP, DENSITY, CRATER, row("hourglass.mass_flow_rate", 0.02, 1e-5)]
    everything.append(row("ledge.ledge_equivalent_angle_deg", 35.0, 0.1))
    assert most_telling(everything, BOUNDS) is None


def test_no_more_parameters_are_open_than_there_are_targets():
    for shape in SHAPES:
        for targets in (["bulk_density"], ["bulk_density", "a"], ["bulk_density", "a", "b"], ["a"]):
            bounds, fixed = open_parameters(shape, targets, 2500.0, 5e5, 5e6)
            assert 1 <= len(bounds) <= len(targets)
            assert not bounds.keys() & fixed.keys()
            assert {
                "rolling_friction",
                "sliding_friction",
                "young_modulus",
                "particle_density",
            } == (bounds.keys() | fixed.keys())
    assert (
        "particle_density"
        in open_parameters("angular", ["bulk_density", "a", "b"], 2500, 5e5, 5e6)[0]
    )
    assert (
        "particle_density"
        not in open_parameters("spheres", ["bulk_density", "a", "b"], 2500, 5e5, 5e6)[0]
    )


def test_grains_that_are_softest_already_have_no_stiffness_to_search():
    targets = ["bulk_density", "a", "b"]
    assert "young_modulus" in open_parameters("spheres", targets, 2500, 5e5, 5e6)[0]
    assert open_parameters("spheres", targets, 2500, 5e5, 5e5)[1]["young_modulus"] == 5e5


def test_the_stiffness_grows_with_the_pressure_at_the_bottom():
    assert stiffness(2650, 0.1) == pytest.approx(2 * stiffness(2650, 0.05), rel=0.2)
    assert stiffness(5300, 0.05) == pytest.approx(2 * stiffness(2650, 0.05), rel=0.2)
