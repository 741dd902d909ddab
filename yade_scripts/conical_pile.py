"""Conical pile: fill a cylinder that stands on a plane, lift it, wait until the heap is at rest.

By hand:          yade -n -x conical_pile.py
One table line:   YADE_BATCH=runs.table:2 yade -n -x conical_pile.py
All lines:        yade-batch runs.table conical_pile.py
"""

import os
import sys

# YADE does not put the script's folder there
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

import numpy as np
from yade import O, utils

import checkpoint
import grains
import material
import measure
import packing
import session
import stop
import walls


def simulate(p, diagnostics):
    """One conical pile; returns (status, responses, curves)."""
    radius, cylinder = p["particle_radius"], p["cylinder_diameter"] / 2
    grain, wall = session.start(p)
    rng = np.random.default_rng(p["seed"])
    count = grains.for_volume(p, np.pi * cylinder**2 * p["fill_height"])
    centres = packing.cloud_in_cylinder(p, count, material.largest_reach(p), rng)
    O.bodies.append(utils.wall(0.0, axis=2, sense=1, material=wall))
    # The wall of the cylinder starts a hair above the base plane, so that the two never share a
    # contact.
    tube = O.bodies.append(
        walls.cylinder(cylinder, 0.05 * radius, centres[:, 2].max() + 10 * radius, wall)
    )
    ids = grains.add(p, centres, grain, rng)
    diagnostics["pouring_rate"] = grains.pouring_rate(p, centres)

    session.fill(p, ids, diagnostics)
    filled = grains.positions(ids)
    lift(p, ids, tube, diagnostics)
    return respond(p, ids, filled, grains.positions(ids), diagnostics)


def lift(p, ids, tube, diagnostics):
    """Lift the cylinder at constant speed, keep it at its height, wait for rest."""
    released, clock = O.time, checkpoint.cpu_time()
    lifted = released + p["lift_height"] / p["lift_speed"]
    for i in tube:
        O.bodies[i].state.vel = (0, 0, p["lift_speed"])
    stop.run_until(
        lambda: O.time >= lifted, O.dt, 2 * p["lift_height"] / p["lift_speed"], "lifting"
    )
    for i in tube:
        O.bodies[i].state.vel = (0, 0, 0)

    def at_rest():
        return session.at_rest(p, ids, grains.states_of(ids))

    stop.run_until(at_rest, p["sampling_interval"], p["longest_time"], "conical pile")
    session.finish(p, ids, diagnostics, released, clock, "at rest")


def respond(p, ids, filled, final, diagnostics):
    """Pile angle, equivalent angle, curvature, asymmetry and apex rounding."""
    radius, cylinder, sizes = (
        p["particle_radius"],
        p["cylinder_diameter"] / 2,
        grains.radii(p, ids),
    )
    x, y, height = measure.height_map(filled, sizes, cylinder, cylinder)
    section = np.hypot(x[:, None], y[None, :]) < cylinder
    diagnostics["filled_height"] = float(height[section].mean())
    responses = dict(
        bulk_density=grains.total_mass(p, ids) / (np.pi * cylinder**2 * height[section].mean())
    )

    # Grains that rolled far away are left out of the scan, or a single one would set its size.
    half = 1.2 * float(np.quantile(np.hypot(final[:, 0], final[:, 1]), 0.98)) + 2 * radius
    x, y, height = measure.height_map(final, sizes, half, half)
    scanned, position, profile = measure.pile_responses(x, y, height, radius)
    responses.update(scanned)
    curves = dict(
        profile_radius=position,
        profile_height=profile,
        filled=filled.astype("f4"),
        final=final.astype("f4"),
    )
    return "ok", {name: float(value) for name, value in responses.items()}, curves


session.main("conical_pile", simulate)
