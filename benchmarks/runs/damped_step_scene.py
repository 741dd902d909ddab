"""Small beds that are poured, at given steps; run inside YADE.

By hand:  DAMPED_STEP=cases.json:found.jsonl yade -n -x -j1 damped_step_scene.py

Cases come from benchmarks/runs/damped_step.py: a JSON list of [key, numbers]. One line of
JSON is written for each as it ends, so that a run that is killed goes on from there.
"""

import json
import math
import os
import sys

# The script's path is in argv: inside YADE __file__ is YADE's own.
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])) + "/../../yade_scripts")

import contract
import grains
import material
import numpy as np
import packing
import session
import stop
import walls
from yade import O

GRAINS, DIAMETERS = 300, 6  # of a bed, and the width of its vessel in grain diameters
SETUP = "conical_pile"  # any set-up would do: the parameters of the contact law are common to all


def scene(given):
    """An empty scene with the project's engines; returns parameters, grain and wall material."""
    O.reset()
    share, restitution = given.pop("share"), given.pop("restitution")
    p = contract.checked(SETUP, given)
    p["restitution"] = restitution  # also below what requests may ask for
    p["time_step"] = share * material.rayleigh_time(p)
    return (p, *session.start(p))


def bed(given):
    """What a poured bed does: its largest speed over that of free fall, and whether it settles."""
    p, grain, wall = scene(given)
    r = p["particle_radius"]
    p["cylinder_diameter"] = DIAMETERS * 2 * r
    rng = np.random.default_rng(p["seed"])
    centres = packing.cloud_in_cylinder(p, GRAINS, r, rng)
    top = centres[:, 2].max()
    O.bodies.append(walls.cylinder(DIAMETERS * r, -2 * r, top + 10 * r, wall))
    O.bodies.append(walls.disk(DIAMETERS * r, wall))
    ids = grains.add(p, centres, grain, rng)
    states, free_fall = grains.states_of(ids), material.possible_speed(p, top)
    energy, unit = material.filling_energy(p), math.sqrt(2 * r / material.GRAVITY)
    seen = dict(fastest=0.0, overlap=0.0)

    def look():
        speed = float(max(s.vel.squaredNorm() for s in states) ** 0.5 / free_fall)
        seen["fastest"] = max(seen["fastest"], speed)
        deep = max((i.geom.penetrationDepth for i in O.interactions if i.isReal), default=0.0)
        seen["overlap"] = max(seen["overlap"], deep / r)
        return speed > 3 or (O.time > 6 * unit and grains.kinetic_energy(p, states) < energy)

    try:
        stop.run_until(look, 0.1 * unit, 30 * unit, "bed")
        seen["settled"] = bool(seen["fastest"] <= 3)
    except stop.NotSettled:
        seen["settled"] = False
    kinetic = grains.kinetic_energy(p, states) / energy
    return dict(seen, time=O.time / unit, steps=O.iter, kinetic=min(kinetic, 1e99))


def main():
    """Run every case that has no line yet."""
    cases, found = os.environ["DAMPED_STEP"].split(":")
    done = set()
    if os.path.exists(found):
        with open(found) as stream:
            done = {json.loads(line)["key"] for line in stream}
    with open(cases) as stream:
        todo = [c for c in json.load(stream) if c[0] not in done]
    for key, numbers in todo:
        measured = bed(dict(numbers))
        with open(found, "a") as stream:
            stream.write(json.dumps(dict(key=key, **numbers, **measured)) + "\n")


main()
