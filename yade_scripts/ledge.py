"""Ledge: fill a box, periodic front and back, open its flap, wait until the slope rests.

By hand:          yade -n -x ledge.py
One table line:   YADE_BATCH=runs.table:2 yade -n -x ledge.py
All lines:        yade-batch runs.table ledge.py
"""

import os
import sys

# YADE does not put the script's folder there
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

import numpy as np
from yade import O

import checkpoint
import contract
import grains
import material
import measure
import packing
import session
import stop
import walls


def simulate(p, diagnostics):
    """One ledge run; returns (status, responses, curves).

    The back wall is x = 0, the edge x = L.
    """
    radius, length, width = p["particle_radius"], p["box_length"], p["box_width"]
    check(p)
    grain, wall = session.start(p)
    rng = np.random.default_rng(p["seed"])
    count = grains.for_volume(p, length * width * p["fill_height"])
    centres = packing.cloud(
        count,
        material.largest_reach(p),
        p["cloud_fraction"],
        lambda x, y, margin: (np.abs(x) < length / 2 - margin) & (np.abs(y) < width / 2 - margin),
        length / 2,
        width / 2,
        p["pouring_height"],
        rng,
    ) + (length / 2, width / 2, 0)
    top = centres[:, 2].max() + 10 * radius
    # YADE's cell is periodic in all three directions: in x and z it is so long that nothing meets
    # its image and no wall exceeds half of it. The cell starts at the origin, so walls and grains
    # stand clear of x = 0 and z = 0 by an offset.
    offset = np.array([4 * radius, 0, 8 * radius])
    O.periodic = True
    O.cell.setBox(3 * length + 40 * radius, width, 2 * top + 40 * radius)
    ox, oz = offset[0], offset[2]
    O.bodies.append(walls.strips([(ox, oz), (ox + length, oz)], 4, width, wall))
    O.bodies.append(walls.strips([(ox, oz), (ox, oz + top)], 4, width, wall))
    flap = O.bodies.append(
        walls.strips([(ox + length, oz), (ox + length, oz + top)], 4, width, wall)
    )
    ids = grains.add(p, centres + offset, grain, rng)
    diagnostics["pouring_rate"] = grains.pouring_rate(p, centres)

    session.fill(p, ids, diagnostics)
    filled = wrapped(ids, offset, width)
    left = release(p, ids, flap, diagnostics, offset)
    return respond(p, (ids, filled), (left, wrapped(left, offset, width)), diagnostics)


def check(p):
    """Geometry that cannot work is an input error, not a crash."""
    if p["box_width"] < 6 * p["particle_radius"]:
        raise contract.BadInput(
            "box_width must be at least three grain diameters; widen the box or choose smaller"
            " grains"
        )


def wrapped(ids, offset, width):
    """Centres (n, 3) [m]: back wall at x = 0, floor at z = 0, y folded into [-W/2, W/2]."""
    centres = grains.positions(ids) - offset
    centres[:, 1] = np.mod(centres[:, 1], width) - width / 2
    return centres


def release(p, ids, flap, diagnostics, offset):
    """Open the flap; grains are retired once they are clear of the edge. Returns the ids left.

    The flap moves away horizontally, four times as fast as a grain that fell the filled height, and
    stops at twice the length of the ledge: erasing it would be simpler, but see grains.retire.
    """
    radius, released, clock = p["particle_radius"], O.time, checkpoint.cpu_time()
    not_before = released + stop.fall_time(p["fill_height"], material.GRAVITY)
    opening_speed = 4 * (2 * material.GRAVITY * p["fill_height"]) ** 0.5
    memory = {"left": list(ids)}
    for i in flap:
        O.bodies[i].state.vel = (opening_speed, 0, 0)

    def at_rest():
        left = memory["left"]
        if opening_speed * (O.time - released) > p["box_length"]:
            for i in flap:
                O.bodies[i].state.vel = (0, 0, 0)
        states = zip(left, grains.states_of(left), strict=True)
        gone = {i for i, state in states if state.pos[2] - offset[2] < -2 * radius}
        grains.retire(gone, (1.5 * p["box_length"], 0, 0))
        memory["left"] = left = [i for i in left if i not in gone]
        return O.time > not_before and session.at_rest(p, left, grains.states_of(left))

    stop.run_until(at_rest, p["sampling_interval"], p["longest_time"], "ledge", memory)
    left = memory["left"]
    session.finish(p, left, diagnostics, released, clock, "at rest")
    return left


def respond(p, filled, final, diagnostics):
    """Angles, curvature, residual mass; filled and final are ids and centres (n, 3) [m]."""
    (ids, filled), (left, final) = filled, final
    radius, length, width, residual = (
        p["particle_radius"],
        p["box_length"],
        p["box_width"],
        grains.total_mass(p, left),
    )
    centre = np.array([length / 2, 0, 0])
    x, y, height = measure.height_map(
        filled - centre, grains.radii(p, ids), length / 2, width / 2, period_y=width
    )
    diagnostics["filled_height"] = float(height.mean())
    bulk_density = grains.total_mass(p, ids) / (height.mean() * length * width)
    x, y, height = measure.height_map(
        final - centre, grains.radii(p, left), length / 2, width / 2, period_y=width
    )
    position, profile = measure.x_profile(x + length / 2, height, radius)
    responses = dict(
        bulk_density=bulk_density,
        residual_mass=residual,
        residual_fraction=grains.share(p, left, ids),
        ledge_equivalent_angle_deg=measure.wedge_angle_from_volume(
            residual / bulk_density, length, width
        ),
    )
    responses.update(measure.ledge_responses(position, profile))
    curves = dict(
        profile_x=position,
        profile_height=profile,
        filled=filled.astype("f4"),
        final=final.astype("f4"),
    )
    return "ok", {name: float(value) for name, value in responses.items()}, curves


session.main("ledge", simulate)
