"""Vessels built from facets.

A polygon replaces each circle, sized so that its area is the circle's.
"""

import math

from yade import Ig2_Wall_Sphere_ScGeom, InteractionLoop, O, RotationEngine, utils

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


def drum(radius, half, segments, material):
    """Shell of a horizontal drum from y = -half to y = half [m]; its axis is at z = radius."""
    lower, upper = (
        [(x, y, z + radius) for x, z, y in packing.ring(radius, end, segments)]
        for end in (-half, half)
    )
    return _between(lower, upper, material)


def turn(ids, rpm, height):
    """Let bodies turn as one about the axis that is parallel to y at a height [m].

    They turn such that their lowest point moves towards -x, at that many turns a minute. YADE takes
    the velocity of a spinning Wall at its contacts from a formula for two spheres, by which a wall
    that turns about its own normal stands still, unless noRatch is off; a facet's is always that of
    the rigid body (tests/physics/test_drum.py).
    """
    turning = RotationEngine(
        ids=ids,
        rotationAxis=(0, 1, 0),
        angularVelocity=2 * math.pi * rpm / 60,
        rotateAroundZero=True,
        zeroPoint=(0, 0, height),
    )
    O.engines = [*O.engines[:-1], turning, O.engines[-1]]
    contacts = next(e for e in O.engines if isinstance(e, InteractionLoop))
    for functor in contacts.geomDispatcher.functors:
        if isinstance(functor, Ig2_Wall_Sphere_ScGeom):
            functor.noRatch = False


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
