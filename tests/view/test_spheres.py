"""Painted spheres: where they are, which is in front, and where there is none."""

import numpy as np

from calibrator.view.spheres import painted

RED, BLUE = (0.9, 0.1, 0.1), (0.1, 0.1, 0.9)
BOX = (-2.0, 2.0, -1.0, 3.0)


def paint(*spheres, pixel=0.02):
    centres, radii, colours = (np.array([s[i] for s in spheres], float) for i in range(3))
    return painted(centres.reshape(-1, 3), radii, colours.reshape(-1, 3), BOX, pixel)


def at(picture, x, y, pixel=0.02):
    return picture[int((y - BOX[2]) / pixel), int((x - BOX[0]) / pixel)]


def test_a_sphere_is_a_disc_of_its_radius_at_its_place():
    picture = paint(((0.5, 1.0, 0), 0.4, RED))
    assert picture.shape == (200, 200, 4)
    area = picture[..., 3].sum() * 0.02**2
    assert abs(area / (np.pi * 0.4**2) - 1) < 0.01
    rows, columns = np.nonzero(picture[..., 3] > 0.5)
    assert abs((columns.mean() + 0.5) * 0.02 + BOX[0] - 0.5) < 0.01
    assert abs((rows.mean() + 0.5) * 0.02 + BOX[2] - 1.0) < 0.01


def test_the_nearer_surface_is_seen_in_whichever_order_they_come():
    near, far = ((0, 0, -1.0), 0.5, RED), ((0.2, 0, 1.0), 0.5, BLUE)
    for order in ((near, far), (far, near)):
        picture = paint(*order)
        assert np.argmax(at(picture, 0.3, 0)[:3]) == 0  # both are there, red is nearer
        assert np.argmax(at(picture, 0.6, 0)[:3]) == 2


def test_it_is_lit_from_the_upper_left():
    picture = paint(((0, 1, 0), 0.8, RED))
    assert at(picture, -0.4, 1.5)[0] > 1.5 * at(picture, 0.4, 0.5)[0]


def test_what_is_outside_is_not_drawn_and_nothing_at_all_is_transparent():
    assert not paint(((9, 9, 0), 0.5, RED))[..., 3].any()
    assert not painted(np.empty((0, 3)), np.empty(0), np.empty((0, 3)), BOX, 0.02).any()
    rim = paint(((2.0, 1, 0), 0.5, RED))
    assert 0.45 < rim[..., 3].sum() * 0.02**2 / (np.pi * 0.25) < 0.55
