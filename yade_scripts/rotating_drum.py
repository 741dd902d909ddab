"""Rotating drum: fill a closed drum, turn it until its surface is steady, average over whole turns.

By hand:          yade -n -x rotating_drum.py
One table line:   YADE_BATCH=runs.table:2 yade -n -x rotating_drum.py
All lines:        yade-batch runs.table rotating_drum.py
"""

import math
import os
import sys

# YADE does not put the script's folder there
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

import numpy as np
from yade import InteractionLoop, MatchMaker, O, utils

import camera
import checkpoint
import contract
import grains
import material
import measure
import packing
import session
import stop
import walls

BLOCKS = 4  # of a turn, whose mean angles tell whether the surface is steady
SMALL_DRIFT = 0.25  # [deg] over the turns that are averaged: no drift that matters
LARGEST_ERROR = 3.0  # [deg] of a drift: a larger one says nothing, and more turns are needed
ROUGHNESS = 0.005  # of the shell's polygon, in grain diameters


def simulate(p, diagnostics):
    """One drum; returns (status, responses, curves).

    Its axis is parallel to y, its lowest line at z = 0. It turns so that the surface falls to +x.
    """
    check(p)
    drum, depth = p["drum_diameter"] / 2, p["drum_depth"]
    grain, shell = session.start(p)
    face = wall_frictions(p, grain, shell)
    rng = np.random.default_rng(p["seed"])
    sides = segments(p)
    centres = cloud(p, packing.inscribed_radius(drum, sides), rng)
    # the shell goes on behind the faces, so that no grain meets its rim
    vessel = walls.drum(drum, depth / 2 + p["particle_radius"], sides, shell)
    for end in (-1, 1):
        place = (0, end * depth / 2, drum)
        vessel.append(utils.wall(place, axis=1, sense=-end, material=face))
    vessel = O.bodies.append(vessel)
    ids = grains.add(p, centres + (0, 0, drum), grain, rng)

    session.fill(p, ids, diagnostics)
    filled = grains.positions(ids) - (0, 0, drum)
    diagnostics["filled_height"] = float(np.quantile(filled[:, 2], 0.98)) + drum
    series, film, frames = turn(p, ids, vessel, diagnostics)
    return respond(p, ids, (filled, series, film / frames), diagnostics)


def check(p):
    """What cannot work is an input error, not a crash."""
    if p["drum_depth"] < 6 * p["particle_radius"]:
        raise contract.BadInput(
            "drum_depth must be at least three grain diameters; deepen the drum or choose smaller"
            " grains"
        )
    turns = p["settling_turns"] + p["measuring_turns"]
    if turns * 60 / p["rotation_rpm"] > p["longest_time"]:
        raise contract.BadInput(
            "longest_time is over before settling_turns and measuring_turns are; raise it"
        )


def segments(p):
    """Sides of the shell's polygon: its middles lie R (1 - cos(pi/n)) further in than its corners.

    So many that this is far below a grain.
    """
    deepest = 2 * p["particle_radius"] * ROUGHNESS / (p["drum_diameter"] / 2)
    return max(packing.SEGMENTS, math.ceil(math.pi / math.acos(1 - min(deepest, 1))))


def cloud(p, inner, rng):
    """Centres (n, 3) [m] of the grains before they fall, about the drum's axis."""
    if p["drum_fill_mass"]:
        count = max(1, round(p["drum_fill_mass"] / material.mean_grain_mass(p)))
    else:
        section = math.pi * p["drum_diameter"] ** 2 / 4
        count = grains.for_volume(p, p["fill_fraction"] * section * p["drum_depth"])
    reach, fraction = material.largest_reach(p), p["cloud_fraction"]
    return packing.cloud_in_drum(count, reach, fraction, inner, p["drum_depth"], rng)


def wall_frictions(p, grain, shell):
    """Give shell and faces a friction each; returns the faces' material."""
    _, face = material.materials(p)
    face.label = "face"
    O.materials.append(face)
    contacts = next(e for e in O.engines if isinstance(e, InteractionLoop))
    at_walls = contacts.physDispatcher.dispFunctor(grain, shell)
    friction = p["wall_friction_ratio"] * p["sliding_friction"]
    at_walls.frictAngle = MatchMaker(
        matches=[
            (grain.id, shell.id, math.atan(friction * p["shell_friction_ratio"])),
            (grain.id, face.id, math.atan(friction * p["face_friction_ratio"])),
        ]
    )
    return face


def turn(p, ids, vessel, diagnostics):
    """Turn until the surface is steady over measuring_turns whole turns.

    Returns times [s] and angles [deg] of every look (k, 2), and the film of those turns with its
    number of frames. Raises NotSettled where it never is.
    """
    begun, clock, drum = O.time, checkpoint.cpu_time(), p["drum_diameter"] / 2
    period, at = 60 / p["rotation_rpm"], camera.pixels(drum, p["particle_radius"])
    walls.turn(vessel, p["rotation_rpm"], drum)
    sizes = grains.radii(p, ids)
    # of the turns that may still count: the last measuring_turns and the present one
    memory = {"series": [], "films": [], "frames": [], "turn": -1, "drift": None}

    def steady():
        states = grains.states_of(ids)
        session.check_speed(states, "turning", 2 * math.pi / period * drum)
        since = (O.time - begun) / period - p["settling_turns"]
        if since < 0:
            return False
        if int(since) > memory["turn"]:
            if is_steady(p, memory):
                return True
            next_turn(p, memory, int(since), len(at))
        add_frame(memory, since, seen(ids, states, sizes, drum, at), at, drum)
        return False

    try:
        stop.run_until(steady, p["sampling_interval"], p["longest_time"], "turning", memory)
    except stop.NotSettled:
        raise stop.NotSettled(never(p, memory)) from None
    session.finish(p, ids, diagnostics, begun, clock, "steady")
    diagnostics.update(turns=(O.time - begun) / period, angle_drift_deg=memory["drift"][0])
    films = [camera.unpacked(film, len(at)) for film in memory["films"]]
    return np.array(memory["series"]), sum(films), sum(memory["frames"])


def seen(ids, states, sizes, drum, at):
    """The camera's layers of this moment."""
    centres = grains.positions(ids)[:, [0, 2]] - (0, drum)
    velocities = np.array([(state.vel[0], state.vel[2]) for state in states])
    # a clump has two centres
    each = np.repeat(velocities, len(centres) // len(states), axis=0)
    return camera.frame(centres, each, sizes, at)


def next_turn(p, memory, number, n):
    """Begin a turn, and forget those that are too long ago."""
    kept = p["measuring_turns"] - 1
    for name in ("films", "frames"):
        memory[name] = memory[name][len(memory[name]) - min(kept, len(memory[name])) :]
    memory["films"].append(camera.packed(np.zeros((len(camera.KEPT), n, n))))
    memory["frames"].append(0)
    memory["turn"] = number


def add_frame(memory, since, layers, at, drum):
    """Add what the camera sees to the present turn, and the angle of this moment to the series."""
    memory["films"][-1] = camera.packed(camera.unpacked(memory["films"][-1], len(at)) + layers)
    memory["frames"][-1] += 1
    x, z = camera.surface(layers[0], at, drum)
    middle = np.abs(x) < drum / 2
    fit = measure.fit_slope(x[middle], z[middle])
    if fit:
        memory["series"].append([since, fit["angle"]])


def is_steady(p, memory):
    """Whether the last measuring_turns are there, and their angles neither rise nor fall.

    Steady is a drift, over all of them, below SMALL_DRIFT or below twice its own standard error,
    where that is small enough to tell.
    """
    count = p["measuring_turns"]
    series = np.array(memory["series"]).reshape(-1, 2)
    block = np.floor((series[:, 0] - (memory["turn"] + 1 - count)) * BLOCKS).astype(int)
    found = [series[block == k, 1] for k in range(BLOCKS * count)]
    if memory["turn"] + 1 < count or not all(len(angles) for angles in found):
        return False
    drift, error, _ = measure.steadiness([angles.mean() for angles in found])
    memory["drift"] = [drift, error]
    return error < LARGEST_ERROR and abs(drift) < max(SMALL_DRIFT, 2 * error)


def never(p, memory):
    """Why a run has no result."""
    words = "turning: not steady after %g s of simulated time" % p["longest_time"]
    if memory["drift"] is None:
        return words
    return words + ": in the last turns its angle drifted by %.2g +- %.2g degrees" % tuple(
        memory["drift"]
    )


def respond(p, ids, found, diagnostics):
    """Angles, profile, blur and flowing layer; found : filled centres (n, 3) [m], series, film."""
    filled, series, film = found
    drum, radius = p["drum_diameter"] / 2, p["particle_radius"]
    at, blocks = camera.pixels(drum, radius), BLOCKS * p["measuring_turns"]
    x, z = camera.surface(film[0], at, drum)
    responses, _ = measure.drum_responses(x, z, drum)
    late = series[series[:, 0] >= series[-1, 0] // 1 + 1 - p["measuring_turns"]]
    parts = np.array_split(late[:, 1], blocks)
    if responses:
        angle = responses["drum_angle_deg"]
        more = dict(
            drum_angle_error_deg=measure.steadiness([part.mean() for part in parts])[2],
            drum_blur=measure.drum_blur(
                *(camera.surface(film[0], at, drum, level) for level in (0.16, 0.84)), drum, angle
            ),
            drum_layer_thickness=camera.layer_thickness(
                film, at, angle, responses["drum_height_centre"] * drum, radius
            ),
        )
        responses.update({n: v for n, v in more.items() if v is not None})
    curves = dict(
        profile_x=x,
        profile_height=z,
        time=series[:, 0] * 60 / p["rotation_rpm"],
        angle_deg=series[:, 1],
        seen=film[0].astype("f4"),
        filled=filled.astype("f4"),
        final=(grains.positions(ids) - (0, 0, drum)).astype("f4"),
    )
    return "ok", {name: float(value) for name, value in responses.items()}, curves


session.main("rotating_drum", simulate)
