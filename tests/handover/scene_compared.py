"""Exported materials inside YADE, beside the project's own scripts; numbers go into one JSON file.

By hand:  EXPORTED=folder yade -n -x -j1 scene_compared.py

The folder holds the exported modules and compared.json, which names each and the parameters that
its calibration had; found.json is written there.
"""

import json
import math
import os
import sys

# The script's path is in argv: inside YADE __file__ is YADE's own.
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))
sys.path.insert(0, os.path.join(sys.path[0], "..", "..", "yade_scripts"))
sys.path.insert(0, os.environ["EXPORTED"])

import contract
import session
from yade import InteractionLoop, NewtonIntegrator, O, utils

FOLDER = os.environ["EXPORTED"]
NUMBERS = ("betan", "betas", "en", "es", "eta", "krot", "ktwist", "gamma")


def laws(grain, wall):
    """Everything that makes contacts in the current scene."""
    (loop,) = (e for e in O.engines if isinstance(e, InteractionLoop))
    (integrator,) = (e for e in O.engines if isinstance(e, NewtonIntegrator))
    (law,) = loop.lawDispatcher.functors
    found = dict(dt=O.dt, damping=integrator.damping, gravity=list(integrator.gravity))
    found.update(moment=law.includeMoment, adhesion=law.includeAdhesion)
    for name, pair in (("grains", (grain, grain)), ("walls", (grain, wall))):
        functor = loop.physDispatcher.dispFunctor(*pair)
        found[name] = {n: shown(getattr(functor, n)) for n in (*NUMBERS, "frictAngle")}
    for name, one in (("grain", grain), ("wall", wall)):
        found[name] = [one.young, one.poisson, one.frictionAngle, one.density]
    found["geometry"] = [
        [type(f).__name__, f.dict().get("hertzian")] for f in loop.geomDispatcher.functors
    ]
    return found


def shown(value):
    """A number, or what a MatchMaker holds."""
    return value if value is None or isinstance(value, float) else value.dict()


def compared(module, given):
    """The contact law of an exported module, and that of the scripts at the same parameters."""
    sand = __import__(module)
    O.reset()
    exported = sand.add_materials()
    O.engines, O.dt = sand.engines(), sand.time_step(sand.P)
    theirs = laws(*exported)
    O.reset()
    ours = laws(*session.start(contract.checked("conical_pile", given)))
    return [theirs, ours]


def scene(sand, gravity=(0, 0, 0)):
    """An empty scene with an exported material, made as its docstring says."""
    O.reset()
    grain, wall = sand.add_materials()
    O.engines = sand.engines(gravity=gravity)
    O.dt = sand.time_step(sand.P) / 10
    return grain, wall


def ball(sand, grain, z, velocity=(0, 0, 0), spin=0.0, held=False):
    """A grain on the z axis; held: it turns, but stays where it is."""
    body = utils.sphere((0, 0, z), sand.P["particle_radius"], material=grain)
    body.state.vel, body.state.angVel = velocity, (0, spin, 0)
    if held:
        body.state.blockedDOFs = "xyz"
    return O.bodies[O.bodies.append(body)]


def slope(values, begin, end):
    """Slope of the straight line through the middle of a curve: rows of time and value."""
    rows = values[int(begin * len(values)) : int(end * len(values))]
    (t0, v0), (t1, v1) = rows[0], rows[-1]
    return (v1 - v0) / (t1 - t0)


def two_grains(sand):
    """Cap of the rolling moment of two held grains [N m], and restitution of an impact."""
    p = sand.P
    r, mass = p["particle_radius"], sand.grain_mass(p)
    load = 5 * mass * sand.GRAVITY
    overlap = (load / (4 / 3 * sand.effective_modulus(p) * math.sqrt(r / 2))) ** (2 / 3)
    grain, _ = scene(sand)
    below = ball(sand, grain, 0.0, spin=-400.0, held=True)
    above = ball(sand, grain, 2 * r - overlap, spin=400.0, held=True)
    turning = []
    while above.state.angVel[1] > 80.0 and O.iter < 200000:
        turning.append((O.time, above.state.angVel[1]))
        O.run(50, True)
    cap = -slope(turning, 0.2, 1.0) * 0.4 * mass * r**2
    grain, _ = scene(sand)
    above = ball(sand, grain, 2.001 * r, velocity=(0, 0, -0.05))
    below = ball(sand, grain, 0.0, velocity=(0, 0, 0.05))
    O.run(20000, True)
    return dict(cap=cap, restitution=(above.state.vel[2] - below.state.vel[2]) / 0.1)


def on_floor(sand, kind):
    """Deceleration [m/s2] of a grain that rolls on a wall or a facet."""
    p = sand.P
    r, mass = p["particle_radius"], sand.grain_mass(p)
    grain, wall = scene(sand, gravity=(0, 0, -sand.GRAVITY))
    corners = [(-0.2, -0.2, 0), (0.2, -0.2, 0), (0, 0.3, 0)]
    floor = utils.wall(0.0, axis=2, sense=1, material=wall)
    O.bodies.append(floor if kind == "wall" else utils.facet(corners, material=wall))
    load = mass * sand.GRAVITY / (4 / 3 * sand.effective_modulus(p) * math.sqrt(r))
    body = ball(sand, grain, r - load ** (2 / 3), velocity=(0.2, 0, 0), spin=0.2 / r)
    rolling = []
    while body.state.vel[0] > 0.05 and O.iter < 200000:
        rolling.append((O.time, body.state.vel[0]))
        O.run(50, True)
    return -slope(rolling, 0.2, 1.0)


def main():
    """Compare all modules, and measure the first on one and two grains."""
    with open(os.path.join(FOLDER, "compared.json")) as stream:
        asked = json.load(stream)
    found = dict(laws={module: compared(module, given) for module, given in asked.items()})
    sand = __import__(next(iter(asked)))
    found.update(two_grains(sand))
    found["rolling"] = {kind: on_floor(sand, kind) for kind in ("wall", "facet")}
    with open(os.path.join(FOLDER, "found.json"), "w") as stream:
        json.dump(found, stream, indent=1)


main()
