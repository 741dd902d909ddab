"""The falling cloud of grains that a filling starts from, and the polygons that stand for circles.

Pure numpy.
"""

import math

import numpy as np

import contract

SEGMENTS = 32


def corner_radius(radius, segments=SEGMENTS):
    """Radius [m] of the corners of the regular polygon that has a circle's area."""
    step = 2 * math.pi / segments
    return radius * math.sqrt(step / math.sin(step))


def ring(radius, z, segments=SEGMENTS):
    """Corners of that polygon at a height [m]."""
    step, corner = 2 * math.pi / segments, corner_radius(radius, segments)
    return [(corner * math.cos(i * step), corner * math.sin(i * step), z) for i in range(segments)]


def inscribed_radius(radius, segments=SEGMENTS):
    """Radius [m] of the largest circle in that polygon."""
    return corner_radius(radius, segments) * math.cos(math.pi / segments)


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


def cloud_in_drum(count, radius, fraction, drum, depth, rng):
    """Centres (count, 3) [m] of a cloud in a closed drum about the y axis, from bottom to top.

    radius : that no part of a grain exceeds; drum : radius of the largest circle in the shell, and
    depth : distance of the faces [m]. Layers of a hexagonal packing lie parallel to the faces, at
    the packing fraction asked for, or the loosest that holds the grains: a drum is closed, so that
    nothing can be poured in from above. Every site is jittered by what its neighbours leave free.
    Raises BadInput where not even touching spheres fit.
    """
    loosest = 2 * radius * (math.pi / (math.sqrt(18) * fraction)) ** (1 / 3)
    # the fit is not monotonic, a lattice being cut by the walls: the first that holds them will do
    for spacing in np.geomspace(max(loosest, 2 * radius), 2 * radius, 200):
        sites = _hexagonal(spacing, drum - radius, depth / 2 - radius)
        if len(sites) >= count:
            break
    else:
        raise contract.BadInput(
            "so many grains do not fit into the drum: fill less, or choose smaller or less"
            " different grains"
        )
    sites = sites[np.argsort(sites[:, 2], kind="stable")][:count]
    play = 0.5 * (spacing - 2 * radius) / math.sqrt(3)
    moved = sites + rng.uniform(-play, play, sites.shape)
    # back from the walls, towards which a site is not free
    reach = np.hypot(moved[:, 0], moved[:, 2])
    moved[:, [0, 2]] *= np.minimum(1, (drum - radius) / np.maximum(reach, 1e-300))[:, None]
    moved[:, 1] = np.clip(moved[:, 1], radius - depth / 2, depth / 2 - radius)
    return moved


def _hexagonal(spacing, drum, half):
    """Sites (n, 3) of a close packing within `drum` of the y axis and `half` of its middle."""
    layers = int(2 * half / (spacing * math.sqrt(2 / 3))) + 1 if half >= 0 else 0
    found = [np.empty((0, 3))]
    steps = np.arange(-int(2.5 * drum / spacing) - 2, int(2.5 * drum / spacing) + 3)
    i, j = (a.ravel() for a in np.meshgrid(steps, steps, indexing="ij"))
    for layer in range(layers):
        y = (layer - (layers - 1) / 2) * (2 * half / max(layers - 1, 1))
        shift = spacing / math.sqrt(3) * (layer % 2)
        x, z = spacing * (i + j / 2), spacing * math.sqrt(3) / 2 * j + shift
        keep = np.hypot(x, z) <= drum
        found.append(np.column_stack([x[keep], np.full(keep.sum(), y), z[keep]]))
    return np.concatenate(found)
