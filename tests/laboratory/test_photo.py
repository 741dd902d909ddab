"""Photographs rendered from real runs and from surfaces of known angle."""

import sys

import numpy as np
import pytest

from calibrator.errors import CalibratorError
from calibrator.laboratory.camera import Camera, carved, cone_angle, known_length, seen_angle
from calibrator.laboratory.picture import read_picture
from tests.laboratory.photographer import GRAINS, KNOWN, PIXEL, POOR, angles, photograph, read
from tests.laboratory.piles import RADIUS, RECORDED, pile
from tests.laboratory.rendered import lit, spheres


@pytest.mark.slow
@pytest.mark.parametrize("light", [{}, POOR], ids=["good", "poor"])
@pytest.mark.parametrize("tilt", [0, 4, 8, 12, 16])
def test_three_views_of_a_real_pile_give_its_angle_within_a_degree(tmp_path, tilt, light):
    true = RECORDED["steepest"]["pile_angle_of_repose_deg"]
    found, errors = angles(tmp_path, "steepest", tilt, **light)
    assert found.mean() == pytest.approx(true, abs=1.0)
    assert np.all(np.abs(found - true) < 2 * errors)


@pytest.mark.parametrize("tilt", [0, 5])
def test_perspective_from_ten_widths_away_changes_an_angle_by_less_than_a_degree(tmp_path, tilt):
    found = []
    for distance in (np.inf, 0.7):
        picture, _ = spheres(pile("steepest"), RADIUS, tilt, PIXEL, (400, 640), distance=distance)
        path = photograph(tmp_path / "pile.png", picture)
        reading = read(path, camera=Camera(tilt=tilt), known=KNOWN, ground=GRAINS)
        found.append(reading.values["pile_angle_of_repose_deg"].value)
    assert found[0] != found[1] and found[0] == pytest.approx(found[1], abs=0.8)


@pytest.mark.slow
def test_a_camera_almost_as_steep_as_the_pile_reads_too_low_and_says_so(tmp_path):
    true = RECORDED["steepest"]["pile_angle_of_repose_deg"]
    found, errors = angles(tmp_path, "steepest", 20)
    assert -2 < found.mean() - true < 0.5 and np.all(np.abs(found - true) < 2 * errors)
    path = tmp_path / "0.png"
    warnings = read(path, camera=Camera(tilt=20), known=KNOWN, ground=GRAINS).warnings
    assert "take the picture from lower down" in " ".join(warnings)


@pytest.mark.parametrize("tilt", [0, 5, 10, 15, 20])
def test_the_outline_of_a_cone_from_above_is_turned_back_into_its_angle(tilt):
    """The ellipses of the cone's rings themselves, against the formula and the carving."""
    t, slope = np.radians(tilt), np.tan(np.radians(32))
    rho = np.linspace(0, 1, 2001)
    u = np.linspace(0, 0.999, 1000)
    ring = (1 - rho) * slope * np.cos(t)
    inside = rho[None, :] >= u[:, None]
    back = np.sin(t) * np.sqrt(np.maximum(rho[None, :] ** 2 - u[:, None] ** 2, 0))
    v = np.where(inside, ring + back, -np.inf).max(axis=1)
    seen = np.degrees(np.arctan((v[0] - v[300]) / (u[300] - u[0])))
    assert seen_angle(32, tilt) == pytest.approx(seen, abs=0.1)
    assert cone_angle(seen, tilt) == pytest.approx(32, abs=0.1)
    assert carved(u, v, tilt) == pytest.approx((1 - u) * slope, abs=5e-3)


def cone(degrees, size=(300, 500), sand=0.8, ground=0.1, roll_deg=0.0):
    """A sharp cone of 160 rows' height before a plain background, and its mask."""
    y, x = np.indices(size) - np.array([240, 250])[:, None, None]
    roll = np.radians(roll_deg)
    u, v = x * np.cos(roll) - y * np.sin(roll), -y * np.cos(roll) - x * np.sin(roll)
    height = 100 - np.abs(u) * np.tan(np.radians(degrees))
    return np.where((v < height) & (v > 0), sand, ground)


@pytest.mark.parametrize("light", [{}, dict(light=0.4, noise=0.05)], ids=["good", "poor"])
@pytest.mark.parametrize("colours", [(0.8, 0.1), (0.2, 0.7)], ids=["bright", "dark"])
def test_a_plain_cone_has_its_angle_bright_or_dark(tmp_path, light, colours):
    path = photograph(tmp_path / "cone.png", lit(cone(33, (300, 500), *colours), **light))
    angle = read(path).values["pile_angle_of_repose_deg"]
    assert angle.value == pytest.approx(33, abs=0.5) and angle.error < 2


def test_a_roll_leaves_the_mean_of_both_sides_and_is_taken_out_of_the_asymmetry(tmp_path):
    path = photograph(tmp_path / "cone.png", lit(cone(33, roll_deg=4)))
    as_seen = read(path).values
    turned_back = read(path, camera=Camera(roll=4)).values
    assert as_seen["pile_angle_of_repose_deg"].value == pytest.approx(33, abs=1)
    assert abs(as_seen["pile_asymmetry_deg"].value) == pytest.approx(4, abs=0.7)
    assert turned_back["pile_angle_of_repose_deg"].value == pytest.approx(33, abs=0.5)
    assert abs(turned_back["pile_asymmetry_deg"].value) < 0.7


def test_lengths_are_measured_only_where_one_is_known(tmp_path):
    path = photograph(tmp_path / "cone.png", lit(cone(33)))
    assert "pile_apex_rounding" not in read(path).values
    known = read(path, known="0,240 500,240 = 100 mm")
    assert known.values["pile_apex_rounding"].unit == "m"
    assert max(known.profile[1]) == pytest.approx(0.020, rel=0.05)
    assert known.values["pile_angle_of_repose_deg"].value == pytest.approx(33, abs=0.5)


def test_the_overlay_shows_the_outline_on_the_surface(tmp_path):
    path = photograph(tmp_path / "cone.png", lit(cone(33)))
    reading = read(path, overlay=tmp_path / "over.png")
    shown, _ = read_picture(tmp_path / "over.png")
    red = (shown[:, :, 0] > 0.9) & (shown[:, :, 1] < 0.2)
    rows, columns = np.nonzero(red)
    surface = 240 - (100 - np.abs(columns - 250) * np.tan(np.radians(33)))
    assert reading.overlay and np.ptp(columns) > 250
    assert np.abs(rows - surface).mean() < 2.5


def hillside(degrees, size=(240, 300)):
    y, x = np.indices(size)
    return np.where(y > 40 + x * np.tan(np.radians(degrees)) * (size[0] - 60) / size[0], 0.8, 0.1)


def test_a_slope_has_its_angle_and_a_tilt_lengthens_its_height(tmp_path):
    degrees = np.degrees(np.arctan(np.tan(np.radians(30)) * 180 / 240))
    path = photograph(tmp_path / "slope.png", lit(hillside(30)))
    level = read(path, "slope").values["ledge_angle_of_repose_deg"]
    assert level.value == pytest.approx(degrees, abs=0.4)
    above = read(path, "slope", Camera(tilt=20)).values["ledge_angle_of_repose_deg"]
    expected = np.degrees(np.arctan(np.tan(np.radians(degrees)) / np.cos(np.radians(20))))
    assert above.value == pytest.approx(expected, abs=0.4)


@pytest.mark.parametrize("light", [{}, dict(light=0.5, noise=0.04)], ids=["good", "poor"])
@pytest.mark.parametrize("falls", [1, -1])
def test_a_drum_has_the_slopes_of_its_surface(tmp_path, light, falls):
    y, x = (np.indices((400, 400)) - 199.5) / 200
    surface = -falls * (0.9 * x - 0.3 * x**3)
    picture = np.where(-y < surface, 0.1, 0.9)
    path = photograph(tmp_path / "drum.png", lit(picture, **light))
    found = read(path, "drum", known="400 = 84 mm").values
    assert found["drum_central_angle_deg"].value == pytest.approx(
        np.degrees(np.arctan(0.9 - 0.3 * 3 / 5 * 0.2**2)), abs=0.5
    )
    for side in ("upper", "lower"):
        expected = np.degrees(np.arctan(0.9 - 0.9 * 0.25))
        assert found[f"drum_{side}_angle_deg"].value == pytest.approx(expected, abs=1.5)
    assert found["drum_cubic_3"].value == pytest.approx(0.3, abs=0.03)
    assert found["drum_cubic_1"].value == pytest.approx(-0.9, abs=0.02)
    assert found["drum_filled_share"].value == pytest.approx(0.5, abs=0.01)
    assert 0 <= found["drum_blur"].value < 1e-3  # of a sharp picture: that of its smoothing
    assert all(one.response for one in found.values())


@pytest.mark.parametrize(
    ("picture", "how", "why"),
    [
        (np.full((200, 300), 0.5), {}, "no sand stands out"),
        (cone(33)[:, 150:], {}, "touches the left of the frame"),
        (cone(33)[150:], {}, "touches the top"),
        (cone(33)[:235], {}, "touches the bottom of the frame"),
        (cone(33), {"known": "5,5 900,5 = 30 mm"}, "outside of the picture"),
        (cone(33), {"known": "900 = 30 mm"}, "longer than the picture"),
        (cone(33), {"known": "100 = 30"}, "has no unit"),
        (cone(33), {"known": "one foot"}, "write"),
        (cone(33), {"crop": (0.0, 0.0, 900.0, 50.0)}, "--crop"),
        (cone(12), {"camera": Camera(tilt=14)}, "touches|from lower down"),
    ],
)
def test_a_picture_that_cannot_be_read_is_refused_with_what_to_do(tmp_path, picture, how, why):
    path = photograph(tmp_path / "picture.png", lit(picture))
    with pytest.raises(CalibratorError, match=why):
        read(path, **how)


def test_a_foot_that_shows_another_tilt_than_was_given_is_said_to(tmp_path):
    picture, _ = spheres(pile("steepest"), RADIUS, 20, PIXEL, (400, 640))
    path = photograph(tmp_path / "pile.png", picture)
    for camera in (Camera(), Camera(tilt=10)):
        with pytest.raises(CalibratorError, match="correct --tilt"):
            read(path, camera=camera, known=KNOWN, ground=GRAINS)


def test_a_file_that_is_no_picture_is_refused(tmp_path):
    (tmp_path / "none.png").write_text("no picture")
    with pytest.raises(CalibratorError, match="save it as PNG"):
        read(tmp_path / "none.png")


def test_without_scikit_image_the_remedy_is_said(tmp_path, monkeypatch):
    path = photograph(tmp_path / "cone.png", cone(33))
    monkeypatch.setitem(sys.modules, "skimage.io", None)
    with pytest.raises(CalibratorError, match=r"pip install 'dem-calibrator\[photo\]'"):
        read(path)


@pytest.mark.parametrize(
    ("text", "metres"),
    [("100 = 30 mm", 3e-4), ("100 px = 3 cm", 3e-4), ("0,0 30,40 = 10 mm", 2e-4)],
)
def test_a_known_length_gives_the_size_of_a_pixel(text, metres):
    assert known_length(text, (200, 200), 1)[0] == pytest.approx(metres)
    assert known_length(text, (100, 100), 2)[0] == pytest.approx(2 * metres)
