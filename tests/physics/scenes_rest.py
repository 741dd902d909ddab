"""Experiments on coming to rest, and on waiting for it."""

import time

import grains
import material
import numpy as np
import packing
import session
import stop
import walls
from apparatus import add_floor, add_grain, run, scene
from yade import O, PyRunner


def settled_layer(count=200, diameter=0.03):
    """Grains poured into a wide cylinder until at rest: mean energies [J] then and 0.1 s later.

    The layer is one to two grains deep, so that some of the grains touch nothing but the floor.
    """
    p, grain, wall = scene(cylinder_diameter=diameter, filling_kinetic_energy=1e-15)
    r, cylinder, mass, rng = (
        p["particle_radius"],
        diameter / 2,
        material.grain_mass(p),
        np.random.default_rng(p["seed"]),
    )
    centres = packing.cloud(
        count,
        r,
        p["cloud_fraction"],
        lambda x, y, margin: np.hypot(x, y) < cylinder - margin,
        cylinder,
        cylinder,
        p["pouring_height"],
        rng,
    )
    add_floor("wall", wall)
    O.bodies.append(walls.cylinder(cylinder, 0.05 * r, centres[:, 2].max() + 10 * r, wall))
    ids = grains.add(p, centres, grain, rng)
    session.fill(p, ids, {})
    states = grains.states_of(ids)

    def energies():
        return dict(
            translational=stop.mean_kinetic_energy(states, mass),
            rotational=stop.mean_rotational_energy(states, mass, r),
        )

    at_rest = energies()
    run(0.1)
    return dict(threshold=p["filling_kinetic_energy"], at_rest=at_rest, later=energies())


def lost_grain(pouring_velocity):
    """A filling without a floor: why it ends, and after what simulated time [s]."""
    p, grain, _ = scene(pouring_velocity=pouring_velocity)
    ids = grains.add(p, np.array([[0.0, 0.0, 0.01]]), grain, np.random.default_rng(1))
    try:
        session.fill(p, ids, {})
    except stop.NotSettled as error:
        return dict(error=str(error), time=O.time, longest_time=p["longest_time"])
    return dict(error=None, time=O.time, longest_time=p["longest_time"])


def shot_grain():
    """A filling, and a wait for rest, in which a grain is far too fast: how each ends."""
    ends, speed = [], 20.0
    for part in ("filling", "release"):
        p, grain, _ = scene(gravity=False)
        ids = grains.add(p, np.array([[0.0, 0.0, 0.01]]), grain, np.random.default_rng(1))
        states = grains.states_of(ids)
        possible = material.possible_speed(p, 0.01)
        try:
            if part == "release":
                states[0].vel = (0, 0, 0)
                session.fill(dict(p, filling_kinetic_energy=1.0), ids, {})
            states[0].vel = (0, 0, speed)
            if part == "filling":
                session.fill(p, ids, {})
            else:
                session.at_rest(p, ids, states)
        except stop.Unstable as error:
            ends.append(str(error))
    return dict(ends=ends, speed=speed, possible=possible, time_step=O.dt)


def lingering_step():
    """Two waits of ten steps whose last step lingers: after how many steps the second ends."""
    p, grain, _ = scene()
    add_grain(p, 0, grain)
    # else a lost look hangs
    O.engines = [*O.engines, PyRunner(command="O.iter > 1000 and O.pause()", iterPeriod=1)]
    look = stop._look

    def slow():
        look()
        if not O.running:
            time.sleep(0.2)  # YADE asks every 40 ms whether the loop is paused

    stop._look = slow
    try:
        run(10 * O.dt)
        time.sleep(0.4)  # the step ends, and the next wait begins
        run(10 * O.dt)
    finally:
        stop._look = look
    return dict(steps=O.iter)
