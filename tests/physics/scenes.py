"""Small experiments on the contact law, run inside YADE; the numbers they measure go into one JSON file.

By hand:  CONTACT_LAW_RECORD=numbers.json yade -n -x -j1 scenes.py

One start of YADE costs two seconds, so all experiments share one process. Their scenes are built with the project's own
modules (materials, contact functors, engines, time step); the formulas they must obey are in test_contact_law.py.
Everything is in SI units.
"""

import json
import math
import os
import sys
import time

import numpy as np
from yade import InteractionLoop, NewtonIntegrator, O, PyRunner, utils

# The script's path is in argv: inside YADE __file__ is YADE's own.
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(sys.argv[0])), "..", "..", "yade_scripts"))

import contract
import effects
import material
import packing
import session
import stop
import walls

SETUP = "conical_pile"  # any set-up would do: the parameters of the contact law are common to all
FAR = 0.2  # half width [m] of a floor: no grain reaches its rim


def scene(gravity=True, **given):
    """An empty scene with the project's engines; returns its parameters and the grain and wall materials."""
    O.reset()
    p = contract.checked(SETUP, given)
    grain, wall = session.start(p)
    if not gravity:
        engine(NewtonIntegrator).gravity = (0, 0, 0)
    return p, grain, wall


def engine(kind):
    """The engine of that class in the current scene."""
    return next(e for e in O.engines if isinstance(e, kind))


def run(seconds, look=lambda: None):
    """Step for a simulated time [s], with look() called after every step."""
    end = O.time + seconds

    def at_end():
        look()
        return O.time >= end

    stop.run_until(at_end, O.dt, 2 * seconds, "experiment")


def add_grain(p, z, grain, radius=None, velocity=(0, 0, 0), spin=(0, 0, 0), fixed=False):
    """A grain on the z axis; returns its body. A fixed grain moves with the given velocities whatever acts on it."""
    body = utils.sphere((0, 0, z), radius or p["particle_radius"], material=grain, fixed=fixed)
    body.state.vel, body.state.angVel = velocity, spin
    return O.bodies[O.bodies.append(body)]


def add_floor(kind, wall, edge=0.0):
    """A floor at z = 0: one wall, one large facet, or two coplanar facets whose shared edge meets the x axis at `edge` [m].

    That edge is square to the x axis ("edge") or at 45 degrees to it ("oblique edge").
    """
    if kind == "wall":
        return O.bodies.append(utils.wall(0.0, axis=2, sense=1, material=wall))
    lean = FAR if kind == "oblique edge" else 0.0
    a, b = (edge - lean, -FAR, 0), (edge + lean, FAR, 0)
    corners = [[a, b, (-2 * FAR, 0, 0)], [a, b, (2 * FAR, 0, 0)]]
    if kind == "facet":
        corners = [[(-FAR, -FAR, 0), (FAR, -FAR, 0), (0, FAR, 0)]]
    return O.bodies.append([utils.facet(c, material=wall) for c in corners])


def contacts(body):
    """The contacts of a body that carry a force."""
    return [i for i in body.intrs() if i.isReal]


def grain_weight(p):
    """Weight of a grain [N]."""
    return material.grain_mass(p) * material.GRAVITY


def static_overlap(p, load, effective_radius):
    """Overlap [m] at which the Hertz force 4/3 E* sqrt(R_eff) delta^1.5 is the load [N]."""
    e_star = p["young_modulus"] / (2 * (1 - p["poisson_ratio"] ** 2))
    return (load / (4 / 3 * e_star * math.sqrt(effective_radius))) ** (2 / 3)


def effective_radius(p, partner):
    """R_eff [m] of a grain with an equal grain or with a floor."""
    return p["particle_radius"] / (2 if partner == "grain" else 1)


def rebound(partner, restitution, speed=0.1):
    """Head-on impact without gravity: ratio of the relative normal velocities after and before."""
    p, grain, wall = scene(gravity=False, restitution=restitution)
    r = p["particle_radius"]
    if partner == "grain":
        upper = add_grain(p, 2.001 * r, grain, velocity=(0, 0, -speed / 2))
        lower = add_grain(p, 0, grain, velocity=(0, 0, speed / 2))
    else:
        upper = add_grain(p, 1.001 * r, grain, velocity=(0, 0, -speed))
        lower = O.bodies[np.ravel(add_floor(partner, wall))[0].item()]
    run(5e-3)
    return dict(restitution=(upper.state.vel[2] - lower.state.vel[2]) / speed, contacts_left=len(contacts(upper)))


def sliding_impact(kind, normal_speed=0.02, tangential_speed=0.2):
    """Grazing impact on a floor without rolling friction and without gravity.

    The surfaces slide throughout, because v_t > 7/2 mu_s (1 + e) v_n. The normal speed is low so that the overlap, which
    shortens the lever arm of friction to r - delta/2, stays below half a per cent.
    """
    p, grain, wall = scene(gravity=False, rolling_friction=0.0)
    r = p["particle_radius"]
    add_floor(kind, wall)
    body = add_grain(p, 1.001 * r, grain, velocity=(tangential_speed, 0, -normal_speed))
    moments = []

    def look():
        moments.extend((i.phys.momentBend + i.phys.momentTwist).norm() for i in contacts(body))

    run(5e-3, look)
    v, spin = body.state.vel, body.state.angVel[1]
    return dict(
        radius=r,
        sliding_friction=p["sliding_friction"],
        normal_change=v[2] + normal_speed,
        spin=spin,
        tangential_change=tangential_speed - v[0],
        final_slip=v[0] - spin * r,
        largest_moment=max(moments),
    )


def spinning_impact(partner, restitution, speed=0.1, spin=300.0, rolling_friction=0.1):
    """Head-on impact of grains that spin about a tangential axis, without sliding friction and without gravity.

    Rolling friction alone changes the spin, and the spin is fast enough to keep the moment at its cap.
    """
    p, grain, wall = scene(gravity=False, restitution=restitution, rolling_friction=rolling_friction, sliding_friction=0.0)
    r = p["particle_radius"]
    if partner == "grain":
        add_grain(p, -1.0005 * r, grain, velocity=(0, 0, speed), spin=(0, -spin, 0))
    else:
        add_floor(partner, wall)
    body = add_grain(p, 1.0005 * r, grain, velocity=(0, 0, -speed), spin=(0, spin, 0))
    run(5e-3)
    return dict(
        radius=r,
        effective_radius=effective_radius(p, partner),
        rolling_friction=rolling_friction,
        normal_change=body.state.vel[2] + speed,
        spin_loss=spin - body.state.angVel[1],
    )


def rolling(kind, rolling_friction, duration=0.1, stiffness_ratio=4.0):
    """A grain rolls on a floor without slip, with the speed 5/7 mu_r g t at which it comes to rest after t = duration.

    It starts from static overlap. The deceleration is fitted between 10 % and 80 % of the duration, when the start-up
    oscillation of the contact springs has died. A shared edge of two facets is crossed half-way to the stop.
    """
    friction = dict(rolling_friction=rolling_friction, sliding_friction=0.8)
    p, grain, wall = scene(**friction, rolling_stiffness_ratio=stiffness_ratio)
    r, speed = p["particle_radius"], 5 / 7 * rolling_friction * material.GRAVITY * duration
    add_floor(kind, wall, edge=0.25 * speed * duration)
    body = add_grain(p, r - static_overlap(p, grain_weight(p), r), grain)
    run(0.02)
    body.state.vel, body.state.angVel, begin = (speed, 0, 0), (0, speed / r, 0), O.time
    samples = []

    def look():
        samples.append((O.time - begin, body.state.vel[0], body.state.angVel[1] * r, len(contacts(body))))

    run(0.8 * duration, look)
    t, v, rim, touching = np.array(samples).T
    late = t > 0.1 * duration
    return dict(
        rolling_friction=7 / 5 * -np.polyfit(t[late], v[late], 1)[0] / material.GRAVITY,
        largest_slip=np.abs(v - rim)[late].max() / speed,
        fewest_contacts=touching.min(),
        most_contacts=touching.max(),
    )


def bent_contact(partner, rolling_friction=0.2, ratio=1.0, spring="epsd2", stiffness_ratio=4.0):
    """A fixed grain under a force of five grain weights turns about a tangential axis until long past the cap.

    Without sliding friction the torque on it is the rolling moment alone. ratio : radius of the other grain over its own;
    for unequal grains the functor of the project takes the eta and the stiffness of that pair. A softer spring than
    the default's turns as much faster, so that it is as far past the cap in the end.
    """
    rolling = dict(rolling_friction=rolling_friction, rolling_spring=spring, rolling_stiffness_ratio=stiffness_ratio)
    p, grain, wall = scene(sliding_friction=0.0, **rolling)
    r, load, spin = p["particle_radius"], 5 * grain_weight(p), 0.1 * 4.0 / stiffness_ratio
    r_eff = effective_radius(p, partner)
    if partner == "grain":
        other = ratio * r
        r_eff = r * other / (r + other)
        if ratio != 1:
            functor = engine(InteractionLoop).physDispatcher.functors[0]
            functor.eta = material.grain_eta(rolling_friction, r, other)
            functor.krot = material.rolling_stiffness(p, r_eff)
        add_grain(p, -other, grain, radius=other, fixed=True)
    else:
        add_floor(partner, wall)
    body = add_grain(p, r - static_overlap(p, load, r_eff), grain, spin=(0, spin, 0), fixed=True)
    curve = []

    def look():
        (contact,) = contacts(body)
        curve.append((O.time, O.forces.t(body.id, True).norm(), contact.phys.momentBend.norm()))

    run(400 * O.dt, look)
    t, torque, moment = np.array(curve).T
    elastic = slice(2, 12)  # ends at a tenth of the way to the cap
    return dict(
        parameters=p,
        effective_radius=r_eff,
        load=load,
        stiffness=material.rolling_stiffness(p, r_eff),
        stiffness_factor=p["rolling_stiffness_ratio"],
        slope=np.polyfit(spin * t[elastic], torque[elastic], 1)[0],
        limit=torque[-1],
        largest_moment=moment.max(),
    )


def pressed(partner):
    """Two bodies at rest with a known overlap: what the contact between them holds."""
    p, grain, wall = scene(sliding_friction=0.45)
    r, overlap = p["particle_radius"], 1e-3 * p["particle_radius"]
    if partner == "grain":
        add_grain(p, -r, grain, fixed=True)
    else:
        add_floor(partner, wall)
    body = add_grain(p, r - overlap, grain, fixed=True)
    run(2 * O.dt)
    (contact,) = contacts(body)
    return dict(
        parameters=p,
        effective_radius=effective_radius(p, partner),
        overlap=overlap,
        normal_force=contact.phys.normalForce.norm(),
        shear_stiffness=contact.phys.ks,
        friction=contact.phys.tangensOfFrictionAngle,
    )


def rocking(kind, stiffness_ratio, kick=1e-3):
    """A grain on a floor is turned about a tangential axis, centre held, by less than the cap: its period [s].

    Without sliding friction nothing but the rolling spring turns it back.
    """
    rolling = dict(rolling_friction=0.5, rolling_stiffness_ratio=stiffness_ratio)
    p, grain, wall = scene(sliding_friction=0.0, **rolling)
    r, load = p["particle_radius"], 5 * grain_weight(p)
    add_floor(kind, wall)
    body = add_grain(p, r - static_overlap(p, load, r), grain, spin=(0, kick, 0))
    body.state.blockedDOFs = "xyz"
    turns = []

    def look():
        turns.append((O.time, body.state.angVel[1]))

    run(200 * O.dt, look)
    t, spin = np.array(turns).T
    after = np.flatnonzero((spin[:-1] > 0) & (spin[1:] <= 0))[:2]  # the first two times that it stops to turn back
    stops = t[after] + (t[after + 1] - t[after]) * spin[after] / (spin[after] - spin[after + 1])
    inertia = 0.4 * material.grain_mass(p) * r**2
    return dict(parameters=p, load=load, effective_radius=r, inertia=inertia, step=O.dt, period=np.diff(stops)[0])


def time_steps(stiffness_ratio):
    """The step [s] of soft grains, and what the calibrator has to know to foresee it."""
    p, _, _ = scene(young_modulus=1e6, rolling_stiffness_ratio=stiffness_ratio)
    return dict(parameters=p, time_step=O.dt, rayleigh=material.rayleigh_time(p))


def spinning(kind, spin=10.0):
    """A grain at rest on a floor spins about the vertical: its spin [rad/s] before and after 0.1 s."""
    p, grain, wall = scene()
    r = p["particle_radius"]
    add_floor(kind, wall)
    body = add_grain(p, r - static_overlap(p, grain_weight(p), r), grain, spin=(0, 0, spin))
    run(0.1)
    return dict(before=spin, after=body.state.angVel[2])


def pull_off(partner, bond_number=0.7):
    """Force [N] of a contact at a small overlap without and with adhesion."""
    forces = []
    for bond in (0.0, bond_number):
        p, grain, wall = scene(bond_number=bond)
        r = p["particle_radius"]
        if partner == "grain":
            add_grain(p, -r, grain, fixed=True)
        else:
            add_floor(partner, wall)
        body = add_grain(p, r * (1 - 1e-4), grain, fixed=True)
        run(2 * O.dt)
        forces.append(O.forces.f(body.id, True)[2])
    return dict(weight=grain_weight(p), bond_number=bond_number, pull=forces[0] - forces[1])


def hanging(bond_number, duration=0.1):
    """A grain hangs below a fixed one that it touches: how far it fell [m] after a while."""
    p, grain, wall = scene(bond_number=bond_number)
    r = p["particle_radius"]
    add_grain(p, 2 * r, grain, fixed=True)
    body = add_grain(p, 1e-4 * r, grain)
    run(duration)
    return dict(fallen=-body.state.pos[2], contacts=len(contacts(body)))


def falling(bed_viscosity, duration=0.4):
    """A grain falls freely in a viscous gas, like one of a set-up: its final velocity [m/s]."""
    p, grain, wall = scene(bed_viscosity=bed_viscosity)
    (i,) = session.add_grains(p, np.array([[0.0, 0.0, 0.0]]), grain, np.random.default_rng(1))
    body = O.bodies[i]
    body.state.vel = (0, 0, 0)
    run(duration)
    return dict(weight=grain_weight(p), radius=p["particle_radius"], speed=-body.state.vel[2], kept=len(O.engines))


def falling_askew(tilt_deg, duration=0.01):
    """A grain falls freely in a tilted set-up: its mean acceleration [m/s2]."""
    p, grain, wall = scene(tilt_deg=tilt_deg)
    body = add_grain(p, 0, grain)
    run(duration)
    return dict(acceleration=[v / O.time for v in body.state.vel])


def falling_from_a_shaken_hand(shaking, frequency, periods, shaking_time):
    """A grain falls freely in a set-up that vibrates: its velocity [m/s] after so many periods, and whether it still does."""
    p, grain, wall = scene(shaking=shaking, shaking_frequency=frequency, shaking_time=shaking_time)
    body = add_grain(p, 0, grain)
    effects.shake(p)
    run(periods / frequency)
    return dict(velocity=list(body.state.vel), time=O.time, shakes=effects.shakes())


def friction_at(partner, wall_friction_ratio):
    """The friction coefficient that a contact holds."""
    p, grain, wall = scene(sliding_friction=0.45, wall_friction_ratio=wall_friction_ratio)
    r = p["particle_radius"]
    if partner == "grain":
        add_grain(p, -r, grain, fixed=True)
    else:
        add_floor(partner, wall)
    body = add_grain(p, r * (1 - 1e-3), grain, fixed=True)
    run(2 * O.dt)
    (contact,) = contacts(body)
    return dict(friction=contact.phys.tangensOfFrictionAngle)


def twisted_contact(partner, twisting_stiffness=0.5, spin=10.0):
    """A grain pressed against its partner turns about the normal: moment over angle [N m/rad]."""
    p, grain, wall = scene(twisting_stiffness=twisting_stiffness)
    r = p["particle_radius"]
    if partner == "grain":
        add_grain(p, -r, grain, fixed=True)
    else:
        add_floor(partner, wall)
    body = add_grain(p, r * (1 - 1e-3), grain, spin=(0, 0, spin), fixed=True)
    curve = []

    def look():
        curve.append((O.time, O.forces.t(body.id, True)[2]))

    run(20 * O.dt, look)
    t, torque = np.array(curve).T
    expected = twisting_stiffness * material.stiff_rolling_spring(p, effective_radius(p, partner))
    return dict(stiffness=-np.polyfit(spin * t, torque, 1)[0], expected=expected)


def sized_caps(size_spread=0.25, rolling_friction=0.2):
    """Rolling cap of every pair of sizes under a unit force, as YADE computes it, and as the law asks for [m]."""
    p, _, _ = scene(size_spread=size_spread, rolling_friction=rolling_friction)
    radii, eta = material.size_classes(p), engine(InteractionLoop).physDispatcher.functors[0].eta
    pairs = [(a, b) for a in radii for b in radii]
    return dict(given=[eta * (a + b) / 2 for a, b in pairs], wanted=[rolling_friction * a * b / (a + b) for a, b in pairs])


def sizes(size_spread, count=7000):
    """Moments of the radii of grains as they are created: mean [m], coefficient of variation, and mean mass [kg]."""
    p, grain, wall = scene(size_spread=size_spread)
    centres = 0.01 * np.array([(i % 20, i // 20 % 20, i // 400) for i in range(count)], float)
    ids = session.add_grains(p, centres, grain, np.random.default_rng(1))
    radii = np.array([O.bodies[i].shape.radius for i in ids])
    return dict(
        nominal=p["particle_radius"],
        mean=radii.mean(),
        spread=radii.std() / radii.mean(),
        mean_mass=session.total_mass(p, ids) / count,
        expected_mass=material.mean_grain_mass(p),
        time_step=O.dt,
        smallest=radii.min(),
    )


def clump(aspect):
    """Mass [kg], inertia [kg m2] and extent [m] of a clump as it is created."""
    p, grain, _ = scene(clump_aspect=aspect)
    (i,) = session.add_grains(p, np.array([[0.0, 0.0, 0.0]]), grain, np.random.default_rng(1))
    centres, state = session.positions([i]), O.bodies[i].state
    return dict(
        grain_mass=material.grain_mass(p),
        mass=state.mass,
        inertia=sorted(state.inertia),
        sphere_radius=float(session.radii(p, [i])),
        distance=float(np.linalg.norm(centres[0] - centres[1])),
    )


class Upright:
    """A source of random numbers that turns every clump upright and launches it at rest."""

    def normal(self, mean=0, scatter=1, size=None):
        return np.zeros(size) if scatter != 1 else np.tile([0.0, 0.0, 1.0], (size[0], 1))


def clump_rebound(aspect=1.3, speed=0.1):
    """A clump that stands on its end hits a floor without gravity: ratio of its velocities, and the spin that it got."""
    p, grain, wall = scene(gravity=False, clump_aspect=aspect)
    add_floor("wall", wall)
    reach = material.largest_reach(p)
    (i,) = session.add_grains(p, np.array([[0.0, 0.0, 1.001 * reach]]), grain, Upright())
    state = O.bodies[i].state
    state.vel = (0, 0, -speed)
    run(5e-3)
    return dict(
        restitution=state.vel[2] / speed, wanted=p["restitution"], spin=state.angVel.norm() * p["particle_radius"] / speed
    )


def clump_fall(bed_viscosity, duration=0.4):
    """A clump falls in a viscous gas: final speed, as `falling`."""
    p, grain, _ = scene(clump_aspect=1.5, bed_viscosity=bed_viscosity)
    (i,) = session.add_grains(p, np.array([[0.0, 0.0, 0.0]]), grain, np.random.default_rng(1))
    O.bodies[i].state.vel = (0, 0, 0)
    run(duration)
    return dict(weight=grain_weight(p), radius=p["particle_radius"], speed=-O.bodies[i].state.vel[2])


def settled_layer(count=200, diameter=0.03):
    """Grains poured into a wide cylinder until they are at rest: mean energies [J] at that moment and 0.1 s later.

    The layer is one to two grains deep, so that some of the grains touch nothing but the floor.
    """
    p, grain, wall = scene(cylinder_diameter=diameter, filling_kinetic_energy=1e-15)
    r, cylinder, mass, rng = p["particle_radius"], diameter / 2, material.grain_mass(p), np.random.default_rng(p["seed"])
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
    ids = session.add_grains(p, centres, grain, rng)
    session.fill(p, ids, {})
    states = session.states_of(ids)

    def energies():
        return dict(translational=stop.mean_kinetic_energy(states, mass), rotational=stop.mean_rotational_energy(states, mass, r))

    at_rest = energies()
    run(0.1)
    return dict(threshold=p["filling_kinetic_energy"], at_rest=at_rest, later=energies())


def lost_grain():
    """A filling without a floor: why it ends, and after what simulated time [s]."""
    p, grain, _ = scene()
    ids = session.add_grains(p, np.array([[0.0, 0.0, 0.01]]), grain, np.random.default_rng(1))
    try:
        session.fill(p, ids, {})
    except stop.NotSettled as error:
        return dict(error=str(error), time=O.time, longest_time=p["longest_time"])
    return dict(error=None, time=O.time, longest_time=p["longest_time"])


def lingering_step():
    """Two waits of ten steps in a row, the last step of each taking its time: after how many steps [1] the second ends."""
    p, grain, _ = scene()
    add_grain(p, 0, grain)
    O.engines = [*O.engines, PyRunner(command="O.iter > 1000 and O.pause()", iterPeriod=1)]  # else a lost look hangs
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


def experiments():
    """(function, arguments) of every experiment."""
    yield lingering_step, ()
    for partner in ("grain", "facet", "wall"):
        yield from ((rebound, (partner, e)) for e in (0.5, 0.9, 0.93))
        yield from ((spinning_impact, (partner, e)) for e in (0.5, 0.9))
        yield from ((bent_contact, (partner, mu_r)) for mu_r in (0.0, 0.2))
        yield bent_contact, (partner, 0.2, 1.0, "epsd")
        yield pressed, (partner,)
    for kind in ("facet", "wall"):
        yield sliding_impact, (kind,)
        yield spinning, (kind,)
    for kind in ("facet", "wall", "edge", "oblique edge"):
        yield from ((rolling, (kind, mu_r)) for mu_r in (0.1, 0.3))
    yield bent_contact, ("grain", 0.2, 1.5)
    for ratio in (0.5, 1.0, 16.0):
        yield from ((bent_contact, (partner, 0.2, 1.0, "epsd2", ratio)) for partner in ("grain", "facet", "wall"))
        yield from ((rocking, (kind, ratio)) for kind in ("facet", "wall"))
    yield from ((rolling, (kind, 0.3, 0.1, ratio)) for kind in ("facet", "wall") for ratio in (1.0, 16.0))
    yield from ((time_steps, (ratio,)) for ratio in (0.5, 1.0, 4.0, 16.0))
    for partner in ("grain", "facet", "wall"):
        yield pull_off, (partner,)
        yield twisted_contact, (partner,)
        yield from ((friction_at, (partner, ratio)) for ratio in (0.5, 2.0))
    yield from ((hanging, (bond,)) for bond in (0.9, 1.1))
    yield falling, (0.01,)
    yield falling_askew, (5.0,)
    for periods, shaking_time in ((0.5, 1.0), (1.25, 1.0), (3.0, 0.5 / 50)):
        yield falling_from_a_shaken_hand, (0.8, 50.0, periods, shaking_time)
    yield sized_caps, ()
    yield from ((clump, (aspect,)) for aspect in (1.3, 2.0))
    yield clump_rebound, ()
    yield clump_fall, (0.01,)
    yield sizes, (0.25,)
    yield settled_layer, ()
    yield lost_grain, ()


def main():
    """Run everything; the record is {"experiment argument argument": {quantity: number}}."""
    record = {}
    for experiment, arguments in experiments():
        record[" ".join([experiment.__name__, *map(str, arguments)])] = experiment(*arguments)
    with open(os.environ["CONTACT_LAW_RECORD"], "w") as stream:
        json.dump(record, stream, indent=1, allow_nan=False)


main()
