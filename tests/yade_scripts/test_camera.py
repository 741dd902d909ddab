"""What a camera sees of a drum, and responses of its surface, on shapes of known answers."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "yade_scripts"))
import camera
import contract
import measure
import packing

DRUM, GRAIN = 20e-3, 1e-3
AT = camera.pixels(DRUM, GRAIN)


def share_of(height):
    """The picture of a drum that is filled up to height(x)."""
    x, z = np.meshgrid(AT, AT, indexing="ij")
    step = AT[1] - AT[0]
    inside = np.hypot(x, z) < DRUM
    return np.where(inside, np.clip((height(x) - z) / step + 0.5, 0, 1), 0)


def test_a_shadow_has_the_area_of_its_grain():
    places = np.random.default_rng(1).uniform(-DRUM / 2, DRUM / 2, (200, 2))
    pixel = (AT[1] - AT[0]) ** 2
    areas = [camera.shadow(x, z, GRAIN, AT).sum() * pixel for x, z in places[:, :, None]]
    assert np.mean(areas) == pytest.approx(np.pi * GRAIN**2, rel=0.02)
    both = camera.shadow(np.array([0.0, 1e-4]), np.zeros(2), np.array([GRAIN, GRAIN / 2]), AT)
    assert both.sum() * pixel == pytest.approx(np.pi * GRAIN**2, rel=0.15)


def test_a_grain_at_the_rim_casts_its_shadow_on_one_side_only():
    seen = camera.shadow(np.array([DRUM]), np.zeros(1), GRAIN, AT)
    assert seen[len(AT) // 2 :].any() and not seen[: len(AT) // 2].any()


@pytest.mark.parametrize("degrees", [10.0, 35.0, 50.0])
def test_a_flat_surface_has_its_angle_its_share_and_no_curvature(degrees):
    slope = np.tan(np.radians(degrees))
    x, z = camera.surface(share_of(lambda x: -slope * x), AT, DRUM)
    found, errors = measure.drum_responses(x, z, DRUM)
    for name in ("drum_angle_deg", "drum_central_angle_deg", "drum_lower_angle_deg"):
        assert found[name] == pytest.approx(degrees, abs=0.3)
    assert found["drum_filled_share"] == pytest.approx(0.5, abs=0.005)
    assert found["drum_cubic_3"] == pytest.approx(0, abs=0.02)
    assert found["drum_cubic_1"] == pytest.approx(-slope, abs=0.02)
    assert found["drum_height_centre"] == pytest.approx(0, abs=0.01)
    assert found["drum_height_upper_03"] == pytest.approx(0.3 * slope, abs=0.01)
    assert errors["drum_angle_deg"] < 0.5


def test_an_s_shaped_surface_has_its_cubic_whichever_way_it_falls():
    x = np.linspace(-0.9, 0.9, 300)
    z = 0.3 * x**3 + 0.2 * x**2 - 0.9 * x + 0.05
    for across, up in ((x, z), measure.falling_right(-x[::-1], z[::-1])):
        found, _ = measure.drum_responses(across, up, 1.0)
        terms = [found[f"drum_cubic_{k}"] for k in (3, 2, 1, 0)]
        assert terms == pytest.approx([0.3, 0.2, -0.9, 0.05])


def test_a_surface_that_does_not_cross_the_drum_has_no_responses():
    x = np.linspace(-0.9, 0.2, 300)
    assert measure.drum_responses(x, -x, 1.0) == ({}, {})


@pytest.mark.parametrize("level", [-0.5, 0.0, 0.3])
def test_the_filled_share_is_that_of_the_circles_segment(level):
    x = np.linspace(-0.8, 0.8, 200)
    exact = 0.5 + (np.arcsin(level) + level * np.sqrt(1 - level**2)) / np.pi
    assert measure.filled_share(x, np.full(200, level), 1.0) == pytest.approx(exact, abs=1e-3)


def test_a_blur_is_measured_square_to_the_surface():
    x, slope = np.linspace(-0.9, 0.9, 100), np.tan(np.radians(40))
    apart = 0.1 / np.cos(np.radians(40))
    blur = measure.drum_blur((x, apart - slope * x), (x, -slope * x), 1.0, 40.0)
    assert blur == pytest.approx(0.1)
    assert measure.drum_blur((x[50:], x[50:]), (x, x), 1.0, 40.0) is None


def test_a_grain_in_flight_is_not_the_surface():
    grey = share_of(lambda x: -0.5 * x)
    thrown = np.maximum(grey, 0.1 * camera.shadow(np.array([5e-3]), np.array([9e-3]), GRAIN, AT))
    assert np.array_equal(camera.edge(grey, AT, 0.5), camera.edge(thrown, AT, 0.5), equal_nan=True)


def test_the_flowing_layer_ends_where_the_velocity_turns_round():
    """A layer of 5 mm whose speed falls off straight, on a bed that turns with the drum."""
    slope, thick, rate = np.radians(35), 5e-3, 6.0
    x, z = (a.ravel() for a in np.meshgrid(AT[::3], AT[::3], indexing="ij"))
    depth = -x * np.sin(slope) - z * np.cos(slope)
    keep = (depth > 0) & (np.hypot(x, z) < DRUM)
    x, z, depth = x[keep], z[keep], depth[keep]
    speed = rate * (thick - depth)
    velocities = np.column_stack([speed * np.cos(slope), -speed * np.sin(slope)])
    film = camera.frame(np.column_stack([x, z]), velocities, GRAIN, AT)
    assert film[1].sum() == len(x)
    found = camera.layer_thickness(film, AT, 35.0, 0.0, GRAIN)
    assert found == pytest.approx(thick, abs=0.2 * GRAIN)
    still = camera.frame(np.column_stack([x, z]), -np.abs(velocities), GRAIN, AT)
    assert camera.layer_thickness(still, AT, 35.0, 0.0, GRAIN) is None


def test_a_film_survives_as_text():
    film = np.random.default_rng(1).normal(size=(4, 30, 30)).astype(np.float32)
    assert np.array_equal(camera.unpacked(camera.packed(film), 30), film)


def test_a_drift_is_told_from_scatter():
    rng = np.random.default_rng(1)
    told = [measure.steadiness(rng.normal(30, 1, 8)) for _ in range(2000)]
    missed = np.mean([abs(drift) > 2 * error for drift, error, _ in told])
    assert 0.03 < missed < 0.12  # Student's t of six degrees of freedom: 9 %
    drift, error, _ = measure.steadiness(rng.normal(30, 0.1, 8) + np.arange(8))
    assert drift == pytest.approx(8, abs=0.5) and error < 1


@pytest.mark.parametrize(("count", "radius"), [(50, GRAIN), (1200, GRAIN), (300, 1.5 * GRAIN)])
def test_the_cloud_in_a_drum_touches_neither_walls_nor_itself(count, radius):
    rng = np.random.default_rng(2)
    found = packing.cloud_in_drum(count, radius, 0.2, DRUM, 10e-3, rng)
    apart = np.linalg.norm(found[:, None] - found[None], axis=2) + 9 * np.eye(count)
    assert len(found) == count and apart.min() >= 2 * radius * (1 - 1e-9)
    assert np.hypot(found[:, 0], found[:, 2]).max() <= DRUM - radius + 1e-9
    assert np.abs(found[:, 1]).max() <= 5e-3 - radius + 1e-9
    assert np.corrcoef(np.arange(count), found[:, 2])[0, 1] > 0.9


def test_more_grains_than_fit_are_bad_input():
    with pytest.raises(contract.BadInput, match="do not fit into the drum: fill less"):
        packing.cloud_in_drum(3000, GRAIN, 0.2, DRUM, 10e-3, np.random.default_rng(1))
