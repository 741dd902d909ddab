"""Vessels built from facets.

A polygon replaces each circle, sized so that its area is the circle's.
"""

from yade import utils

import packing


def _between(lower, upper, material):
    """Facets of the strip between two closed polygons with the same number of corners."""
    facets = []
    for i in range(len(lower)):
        a, b, c, d = lower[i - 1], lower[i], upper[i], upper[i - 1]
        facets += [
            utils.facet([a, b, c], material=material),
            utils.facet([a, c, d], material=material),
        ]
    return facets


def cylinder(radius, bottom, top, material):
    """Open vertical cylinder around the z axis."""
    return _between(packing.ring(radius, bottom), packing.ring(radius, top), material)


def annulus(inner, outer, material):
    """Flat ring at z = 0 between two circles."""
    return _between(packing.ring(inner, 0.0), packing.ring(outer, 0.0), material)


def disk(radius, material):
    """Flat disk at z = 0."""
    ring = packing.ring(radius, 0.0)
    return [
        utils.facet([(0, 0, 0), ring[i - 1], ring[i]], material=material) for i in range(len(ring))
    ]


def strips(corners, count, period, material):
    """A plane spanning one period in y, cut into strips as short as YADE's cell allows.

    corners : the two (x, z) ends of the plane's trace.
    """
    (xa, za), (xb, zb) = corners
    facets = []
    for i in range(count):
        y0, y1 = period * i / count, period * (i + 1) / count
        a, b, c, d = (xa, y0, za), (xb, y0, zb), (xb, y1, zb), (xa, y1, za)
        facets += [
            utils.facet([a, b, c], material=material),
            utils.facet([a, c, d], material=material),
        ]
    return facets
