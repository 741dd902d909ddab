"""The falling cloud of grains that a filling starts from, and the polygons that stand for circles.

Pure numpy.
"""

import math

import numpy as np

SEGMENTS = 32


def corner_radius(radius):
    """Radius [m] of the corners of the regular polygon that has a circle's area."""
    step = 2 * math.pi / SEGMENTS
    return radius * math.sqrt(step / math.sin(step))


def ring(radius, z):
    """Corners of that polygon at a height [m]."""
    step, corner = 2 * math.pi / SEGMENTS, corner_radius(radius)
    return [(corner * math.cos(i * step), corner * math.sin(i * step), z) for i in range(SEGMENTS)]


def inscribed_radius(radius):
    """Radius [m] of the largest circle in that polygon."""
    return corner_radius(radius) * math.cos(math.pi / SEGMENTS)


def cloud(count, radius, fraction, inside, half_x, half_y, clearance, rng):
    """Centres (count, 3) [m] of a loose random cloud, sorted from bottom to top.

    A cubic lattice of packing fraction `fraction` is shifted at random and every site is jittered
    within its cell, so grains never overlap and no two seeds agree. inside(x, y, margin) says where
    a grain is that far from the walls. A round wall cuts the corners of some cells, so jittered
    grains are tested as well: one that overlapped a wall by a tenth of its radius would be shot off
    at a metre a second, over the rim even. Creating grains in this spatial order makes YADE about a
    third faster than a random order. Raises ValueError where the vessel is too narrow for a single
    grain.
    """
    spacing = 2 * radius * (np.pi / (6 * fraction)) ** (1 / 3)
    play = 0.5 * (spacing - 2 * radius)
    layers, found, height = [], 0, clearance + radius
    while found < count:
        offset = rng.uniform(0, spacing, 2)
        gx = np.arange(-half_x - offset[0], half_x + spacing, spacing)
        gy = np.arange(-half_y - offset[1], half_y + spacing, spacing)
        sites = np.array(np.meshgrid(gx, gy, [height + play], indexing="ij")).reshape(3, -1).T
        sites = sites[inside(sites[:, 0], sites[:, 1], radius + play)]
        layer = sites + rng.uniform(-play, play, sites.shape)
        layer = layer[inside(layer[:, 0], layer[:, 1], radius)]
        if found == 0 and height > clearance + radius + 50 * spacing:
            raise ValueError("no grain fits into the vessel: widen it or choose smaller grains")
        layers.append(layer)
        found += len(layer)
        height += spacing
    return np.concatenate(layers)[:count]


def cloud_in_cylinder(p, count, radius, rng):
    """The cloud (count, 3) [m] of grains up to a radius [m] over a cylinder about the z axis."""
    half = inscribed_radius(p["cylinder_diameter"] / 2)

    def inside(x, y, margin):
        return np.hypot(x, y) < half - margin

    return cloud(count, radius, p["cloud_fraction"], inside, half, half, p["pouring_height"], rng)
