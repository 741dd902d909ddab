"""What the eye sees of a vessel, against shapes whose outline can be written down."""

import itertools

import numpy as np
import pytest

from calibrator.view.camera import Camera, outlines


def tube(corners=32, radius=1.0, height=3.0):
    """Facets of an open tube about the z axis, two for each side."""
    turn = 2 * np.pi * np.arange(corners + 1) / corners
    low = radius * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    up = np.array([0, 0, height])
    sides = itertools.pairwise(low)
    return np.array([f for a, b in sides for f in ((a, b, b + up), (a, b + up, a + up))])


def box_corner():
    """A floor and a wall, each cut into four strips of two facets."""
    facets = []
    for i in range(4):
        for far in (np.array([1.0, 0, 0]), np.array([0, 0, 1.0])):
            a, b = np.array([0.0, i, 0]), np.array([0.0, i + 1, 0])
            facets += [(a, b, b + far), (a, b + far, a + far)]
    return np.array(facets)


def lengths(edges):
    return np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)


def test_the_axes_of_the_page_are_at_right_angles_and_of_length_one():
    axes = Camera(-24, 17, 8).axes
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)


def test_of_a_tube_two_lines_and_two_rims_are_drawn_whatever_side_it_is_seen_from():
    for azimuth in (1, 40, 200):
        edges = outlines(tube(), Camera(azimuth, 22))
        upright = np.abs(edges[:, 0, 2] - edges[:, 1, 2]) > 1
        assert upright.sum() == 2 and (~upright).sum() == 64
        right = Camera(azimuth, 22).seen(edges[upright])[..., 0]
        assert sorted(np.sign(right.mean(axis=1))) == [-1, 1]
        assert np.abs(right).min() > 0.97


def test_strips_of_a_plane_leave_no_line_and_its_corner_does():
    edges = outlines(box_corner(), Camera(-24, 17))
    corner = (np.abs(edges[..., [0, 2]]) < 1e-6).all(axis=(1, 2))
    assert lengths(edges[corner]).sum() == pytest.approx(4)
    within = (edges[:, 0, 1] == edges[:, 1, 1]) & (edges[:, 0, 1] % 4 != 0)
    assert not within.any()  # between two strips


def test_single_precision_parts_no_facets():
    moved = tube().astype("f4").astype(float) * (1 + 1e-7)
    assert len(outlines(moved, Camera(5, 22))) == 66


def test_on_the_page_gravity_points_down_however_the_set_up_leans():
    """Gravity of a tilt: (g sin a, 0, -g cos a), yade_scripts/effects.py."""
    lean = np.radians(12)
    gravity = np.array([np.sin(lean), 0, -np.cos(lean)])
    right, up, _ = Camera(-24, 17, 12).seen(gravity)
    assert right == pytest.approx(0, abs=1e-12) and up == pytest.approx(-np.cos(np.radians(17)))
    assert Camera(0, 0, 12).seen(np.array([1.0, 0, 0]))[1] < 0  # its right side hangs


def test_a_vessel_without_walls_has_no_outline():
    assert outlines(np.empty((0, 3, 3)), Camera(0, 22)).shape == (0, 2, 3)
