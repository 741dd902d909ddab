"""Hourglass: fill a flat-bottomed cylinder, pull the plug, wait until the rest is at rest.

By hand:          yade -n -x hourglass.py
One table line:   YADE_BATCH=runs.table:2 yade -n -x hourglass.py
All lines:        yade-batch runs.table hourglass.py
"""

import os
import sys

# YADE does not put the script's folder there
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

import numpy as np
from yade import O

import checkpoint
import contract
import effects
import grains
import material
import measure
import packing
import session
import stop
import walls


def simulate(p, diagnostics):
    """One hourglass run; returns (status, responses, curves)."""
    radius, cylinder, neck = (
        p["particle_radius"],
        p["cylinder_diameter"] / 2,
        effects.true_neck(p) / 2,
    )
    check(p)
    grain, wall = session.start(p)
    rng = np.random.default_rng(p["seed"])
    count = max(1, int(round(p["fill_mass"] / material.mean_grain_mass(p))))
    centres = packing.cloud_in_cylinder(p, count, material.largest_reach(p), rng)
    O.bodies.append(walls.cylinder(cylinder, -2 * radius, centres[:, 2].max() + 10 * radius, wall))
    O.bodies.append(walls.annulus(neck, cylinder, wall))
    plug = O.bodies.append(walls.disk(neck, wall))
    ids = grains.add(p, centres, grain, rng)
    diagnostics["pouring_rate"] = grains.pouring_rate(p, centres)

    session.fill(p, ids, diagnostics)
    filled = grains.positions(ids)
    for i in plug:
        O.bodies.erase(i)
    inside, times, passed = discharge(p, ids, diagnostics)
    final = grains.positions(inside)
    status = "clogged" if np.any(np.hypot(final[:, 0], final[:, 1]) < 0.5 * neck) else "ok"
    responses, curves = respond(
        p, (ids, filled), (inside, final), times, passed, status, diagnostics
    )
    return status, responses, curves


def check(p):
    """Geometry that cannot work is an input error, not a crash."""
    neck = effects.true_neck(p)
    if neck >= p["cylinder_diameter"] - 2 * p["particle_radius"]:
        raise contract.BadInput(
            "neck_diameter must be smaller than cylinder_diameter by more than a grain diameter"
        )
    if neck <= 2 * p["particle_radius"]:
        raise contract.BadInput(
            "neck_diameter is below a grain diameter: nothing can pass; widen the neck"
        )


def discharge(p, ids, diagnostics):
    """Release; grains are erased once they are clear of the neck.

    Returns ids left, times [s] and masses passed [kg].
    """
    radius, released, clock = p["particle_radius"], O.time, checkpoint.cpu_time()
    not_before = released + stop.fall_time(p["neck_diameter"], material.GRAVITY)
    memory = dict(inside=list(ids), below=[], gone=[], times=[0.0], passed=[0.0], passage=clock)

    def at_rest():
        inside, below = memory["inside"], memory["below"]
        there = inside + below
        height = {i: s.pos[2] for i, s in zip(there, grains.states_of(there), strict=True)}
        memory["gone"] += [i for i in inside if height[i] < 0]
        below = [i for i in there if height[i] < 0]
        inside = [i for i in inside if height[i] >= 0]
        for i in [i for i in below if height[i] < -4 * radius]:
            grains.erase(i)
            below.remove(i)
        memory.update(inside=inside, below=below)
        memory["times"].append(O.time - released)
        memory["passed"].append(grains.total_mass(p, memory["gone"]))
        if memory["passed"][-1] > memory["passed"][-2]:
            memory["passage"] = checkpoint.cpu_time()
        return O.time > not_before and session.at_rest(p, inside, grains.states_of(inside))

    stop.run_until(at_rest, p["sampling_interval"], p["longest_time"], "discharge", memory)
    diagnostics["settling_cpu"] = checkpoint.cpu_time() - memory["passage"]
    session.finish(p, memory["inside"], diagnostics, released, clock, "at rest")
    return memory["inside"], np.array(memory["times"]), np.array(memory["passed"])


def respond(p, filled, final, times, passed, status, diagnostics):
    """Bulk responses and curves of a run; filled and final are ids and centres (n, 3) [m]."""
    cylinder = p["cylinder_diameter"] / 2
    (ids, filled), (left, final) = filled, final
    mass, residual = grains.total_mass(p, ids), grains.total_mass(p, left)
    x, y, height = measure.height_map(filled, grains.radii(p, ids), cylinder, cylinder)
    section = np.hypot(x[:, None], y[None, :]) < cylinder
    volume = (
        measure.filled_volume(x, y, height, section)
        * np.pi
        * cylinder**2
        / (section.sum() * (x[1] - x[0]) * (y[1] - y[0]))
    )
    diagnostics["filled_height"] = volume / (np.pi * cylinder**2)
    responses = dict(bulk_density=mass / volume)
    curves = dict(
        time=times, passed_mass=passed, filled=filled.astype("f4"), final=final.astype("f4")
    )
    if status == "ok":
        responses.update(
            residual_mass=residual,
            residual_fraction=grains.share(p, left, ids),
            discharge_time=times[-1],
        )
        responses.update(measure.discharge_features(times, passed))
        responses.update(crater(p, left, final, responses["bulk_density"], curves))
    return {name: float(value) for name, value in responses.items()}, curves


def crater(p, left, final, bulk_density, curves):
    """Angle, curvature and asymmetry of the drained slope."""
    radius, cylinder, neck = (
        p["particle_radius"],
        p["cylinder_diameter"] / 2,
        p["neck_diameter"] / 2,
    )
    x, y, height = measure.height_map(final, grains.radii(p, left), cylinder, cylinder)
    curves["profile_radius"], curves["profile_height"] = measure.radial_profile(
        x, y, height, radius
    )
    volume = grains.total_mass(p, left) / bulk_density
    responses = dict(
        drained_equivalent_angle_deg=measure.crater_angle_from_volume(volume, cylinder, neck)
    )
    responses.update(measure.crater_responses(x, y, height, neck, cylinder, radius))
    return responses


session.main("hourglass", simulate)
