"""Responses measured on shapes whose answer can be written down."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "yade_scripts"))
import measure
import packing

R = 1e-3


def surface(height_of, half, spacing=R / 3):
    """Tiny grains whose tops lie on a given surface."""
    side = np.arange(-half, half + spacing, spacing)
    x, y = (a.ravel() for a in np.meshgrid(side, side))
    return np.column_stack([x, y, height_of(x, y) - R])


def test_the_scan_of_one_grain_has_its_height_and_on_average_its_volume():
    volumes, heights = [], []
    for offset in np.random.default_rng(1).uniform(-R, R, (200, 2)):
        x, y, height = measure.height_map([[*offset, R]], R, 3 * R, 3 * R)
        volumes.append(measure.filled_volume(x, y, height, height >= 0))
        heights.append(height.max())
    under_dome = np.pi * R**2 * R + 2 / 3 * np.pi * R**3
    assert np.mean(heights) == pytest.approx(2 * R, rel=0.03)
    assert np.mean(volumes) == pytest.approx(under_dome, rel=0.02)


def test_a_grain_across_the_period_is_scanned_on_both_sides():
    _, _, height = measure.height_map([[0, 4 * R, R]], R, 2 * R, 4 * R, period_y=8 * R)
    assert (
        height[:, 0].max() == pytest.approx(height[:, -1].max(), rel=1e-6)
        and height[:, -1].max() > R
    )


@pytest.mark.parametrize("degrees", [15.0, 33.0])
def test_a_cone_has_its_angle_by_fit_and_by_moments(degrees):
    slope, half = np.tan(np.radians(degrees)), 20 * R
    centres = surface(
        lambda x, y: np.maximum(15 * R - slope * np.hypot(x, y), 0), 1.3 * 15 * R / slope
    )
    centres = centres[centres[:, 2] > -R]
    half = np.abs(centres).max()
    x, y, height = measure.height_map(centres, R / 3, half, half)
    height = np.maximum(height, 0)
    fit = measure.fit_slope(
        *measure.between_heights(*measure.radial_profile(x, y, height, R), 0.2, 0.8)
    )
    assert fit["angle"] == pytest.approx(degrees, abs=1.0)
    assert fit["error"] < 0.5 and abs(fit["curvature"]) < 5
    rho = np.hypot(x[:, None], y[None, :])
    exact = np.maximum(15 * R - slope * rho, 0)
    assert measure.cone_angle_from_moments(x, y, exact) == pytest.approx(degrees, abs=0.2)


def test_volumes_and_angles_of_crater_and_wedge_are_inverses():
    cylinder, neck, degrees = 15e-3, 7e-3, 40.0
    rho = np.linspace(neck, cylinder, 100_001)
    volume = np.trapezoid(2 * np.pi * rho * (rho - neck) * np.tan(np.radians(degrees)), rho)
    assert measure.crater_angle_from_volume(volume, cylinder, neck) == pytest.approx(
        degrees, abs=1e-4
    )
    wedge = 0.5 * 0.03**2 * np.tan(np.radians(degrees)) * 0.012
    assert measure.wedge_angle_from_volume(wedge, 0.03, 0.012) == pytest.approx(degrees, abs=1e-9)


def test_a_tilted_heap_is_asymmetric_by_its_tilt_and_a_straight_one_is_not():
    side = np.linspace(-10e-3, 10e-3, 121)
    x, y = side, side
    rho = np.hypot(x[:, None], y[None, :])
    heap = 10e-3 - 0.5 * rho
    everywhere = np.ones_like(heap, bool)
    assert measure.asymmetry(x, y, heap, R, everywhere) == pytest.approx(0, abs=1e-9)
    assert measure.asymmetry(x, y, heap - 0.05 * x[:, None], R, everywhere) > 1


@pytest.mark.parametrize("degrees", [25.0, -25.0])
def test_a_surface_that_bends_the_wrong_way_has_the_negative_of_its_angle(degrees):
    position = np.linspace(5e-3, 15e-3, 12)
    crater = 4e-3 + np.tan(np.radians(degrees)) * (position - 10e-3)
    assert measure.fit_slope(position, crater, rising=True)["angle"] == pytest.approx(degrees)
    assert measure.fit_slope(position, crater)["angle"] == pytest.approx(-degrees)


def test_a_tilted_crater_is_asymmetric_by_the_side_that_is_steeper():
    x = y = np.linspace(-10e-3, 10e-3, 121)
    crater = 0.5 * np.hypot(x[:, None], y[None, :]) + 0.05 * x[:, None]
    everywhere = np.ones_like(crater, bool)
    assert measure.asymmetry(x, y, crater, R, everywhere, rising=True) > 1


def test_the_error_of_a_fitted_angle_is_that_of_repeated_noise():
    rng = np.random.default_rng(1)
    position = np.linspace(0, 20e-3, 15)
    fits = [
        measure.fit_slope(position, 0.6 * position + rng.normal(0, 0.3e-3, 15)) for _ in range(400)
    ]
    scatter = np.std([f["angle"] for f in fits])
    assert np.mean([f["error"] for f in fits]) == pytest.approx(scatter, rel=0.15)


def test_a_steady_discharge_has_its_rate_onset_and_no_fluctuation():
    time = np.linspace(0, 2, 401)
    mass = np.clip(0.01 * (time - 0.1), 0, 0.012)
    found = measure.discharge_features(time, mass)
    assert found["mass_flow_rate"] == pytest.approx(0.01)
    assert found["onset_delay"] == pytest.approx(0.1)
    assert found["late_early_ratio"] == pytest.approx(1)
    assert found["rate_fluctuation"] == pytest.approx(0, abs=1e-12)
    assert found["emptying_time"] == pytest.approx(0.1 + 0.95 * 1.2, abs=0.01)


def test_a_discharge_of_nothing_has_no_features():
    assert measure.discharge_features([0, 1], [0, 0]) == {}


def test_a_profile_of_three_points_is_not_fitted():
    assert measure.fit_slope(np.arange(3.0), np.arange(3.0)) is None


def cloud(seed, count=300):
    inside = lambda x, y, margin: np.hypot(x, y) < 10e-3 - margin  # noqa: E731
    return packing.cloud(count, R, 0.2, inside, 10e-3, 10e-3, 5e-3, np.random.default_rng(seed))


def test_the_cloud_has_every_grain_no_overlap_and_keeps_clear_of_wall_and_floor():
    centres = cloud(1)
    gaps = np.linalg.norm(centres[:, None] - centres[None], axis=2)[np.triu_indices(300, 1)]
    assert len(centres) == 300 and gaps.min() > 2 * R
    assert np.hypot(centres[:, 0], centres[:, 1]).max() < 9e-3 and centres[:, 2].min() >= 6e-3


def test_no_grain_of_a_cloud_overlaps_the_flat_sides_of_its_cylinder():
    """Jitter along both axes once carried one grain in a thousand into the wall."""
    p = {"cylinder_diameter": 13e-3, "cloud_fraction": 0.2, "pouring_height": 0.0}
    edge = 2 * np.pi / packing.SEGMENTS
    for seed in range(20):
        centres = packing.cloud_in_cylinder(p, 2000, 0.35e-3, np.random.default_rng(seed))
        rho, turned = (
            np.hypot(centres[:, 0], centres[:, 1]),
            np.mod(np.arctan2(centres[:, 1], centres[:, 0]), edge) - edge / 2,
        )
        flats = packing.corner_radius(6.5e-3) * np.cos(edge / 2)
        assert (rho * np.cos(turned)).max() < flats - 0.35e-3


def test_the_polygon_of_a_circle_has_its_area_and_holds_its_inscribed_circle():
    corner, angle = packing.corner_radius(1.0), np.pi / packing.SEGMENTS
    assert packing.SEGMENTS * corner**2 * np.sin(angle) * np.cos(angle) == pytest.approx(np.pi)
    assert (
        packing.inscribed_radius(1.0) == pytest.approx(corner * np.cos(angle))
        and packing.inscribed_radius(1.0) < 1
    )


def test_the_cloud_depends_on_its_seed_and_on_nothing_else():
    assert np.array_equal(cloud(1), cloud(1)) and not np.array_equal(cloud(1), cloud(2))


def test_a_vessel_narrower_than_a_grain_is_refused():
    with pytest.raises(ValueError, match="widen"):
        packing.cloud(
            5,
            R,
            0.2,
            lambda x, y, m: np.hypot(x, y) < 0.5e-3 - m,
            1e-3,
            1e-3,
            0,
            np.random.default_rng(1),
        )
