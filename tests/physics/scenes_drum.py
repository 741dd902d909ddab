"""Experiments on one grain and a wall that turns."""

import math

import material
import walls
from apparatus import add_grain, engine, grain_weight, run, scene, static_overlap
from yade import NewtonIntegrator, O, utils

DRUM, RPM, SPEED = 15e-3, 20.0, 2 * math.pi * 20.0 / 60  # radius [m]; turns a minute; [rad/s]


def on_a_turning_shell(sliding_friction, rolling_friction):
    """A grain laid on the bottom of a drum: where it stays, in degrees, and its spins [rad/s]."""
    p, grain, wall = scene(
        young_modulus=1e6, sliding_friction=sliding_friction, rolling_friction=rolling_friction
    )
    r = p["particle_radius"]
    shell = O.bodies.append(walls.drum(DRUM, 3 * r, 150, wall))
    body = add_grain(p, r - static_overlap(p, grain_weight(p), r), grain)
    walls.turn(shell, RPM, DRUM)
    # from where it stays at last, up to a small swing
    angle = math.atan(min(sliding_friction, rolling_friction))
    way = DRUM - body.state.pos[2]
    body.state.pos = (-way * math.sin(angle), 0, DRUM - way * math.cos(angle))
    seen = []

    def look():
        x, _, z = body.state.pos
        seen.append((math.degrees(math.atan2(-x, DRUM - z)), body.state.angVel[1]))

    run(0.3)
    run(0.5, look)
    angles, spins = zip(*seen, strict=True)
    return dict(
        angle=sum(angles) / len(angles),
        spin=sum(spins) / len(spins),
        drum=SPEED,
        radius=r,
        shell=DRUM,
    )


def on_a_turning_face(how):
    """A grain that is pressed against a turning face: how it moves about the axis."""
    friction = {"stuck": (0.5, 0.5), "rolling": (0.5, 0.0), "slipping": (0.02, 0.0)}[how]
    p, grain, wall = scene(
        young_modulus=1e6, sliding_friction=friction[0], rolling_friction=friction[1]
    )
    r, distance = p["particle_radius"], 10e-3
    engine(NewtonIntegrator).gravity = (0, -material.GRAVITY, 0)
    face = O.bodies.append(utils.wall((0, 0, DRUM), axis=1, sense=1, material=wall))
    walls.turn([face], RPM, DRUM)
    body = add_grain(p, 0.0, grain)
    # above the axis, where the face moves towards +x
    body.state.pos = (0, r - static_overlap(p, grain_weight(p), r), DRUM + distance)
    if how == "stuck":
        body.state.vel, body.state.angVel = (SPEED * distance, 0, 0), (0, SPEED, 0)
    if how == "rolling":
        body.state.vel = (2 / 7 * SPEED * distance, 0, 0)
        # its lowest point moves with the face: v + omega x (0, -r, 0)
        body.state.angVel = (0, 0, 5 / 7 * SPEED * distance / r)
    seconds = 0.02 if how == "slipping" else 0.5
    run(seconds)
    x, _, z = body.state.pos
    return dict(
        turned=math.atan2(x, z - DRUM),
        face_turned=SPEED * O.time,
        distance=math.hypot(x, z - DRUM) / distance,
        speed=body.state.vel[0],
        slip_speed=friction[0] * material.GRAVITY * O.time,
    )
