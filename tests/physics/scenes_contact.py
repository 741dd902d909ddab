"""Experiments on the contact law: impacts, rolling, bending, pressing."""

import material
import numpy as np
from apparatus import (
    add_floor,
    add_grain,
    contacts,
    effective_radius,
    functor_of,
    grain_weight,
    run,
    scene,
    static_overlap,
)
from yade import Ip2_FrictMat_FrictMat_FrictPhys, IPhysDispatcher, O


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
    return dict(
        restitution=(upper.state.vel[2] - lower.state.vel[2]) / speed,
        contacts_left=len(contacts(upper)),
    )


def sliding_impact(kind, normal_speed=0.02, tangential_speed=0.2):
    """Grazing impact on a floor without rolling friction and without gravity.

    The surfaces slide throughout, because v_t > 7/2 mu_s (1 + e) v_n. The normal speed is low so
    that the overlap, which shortens the lever arm of friction to r - delta/2, stays below half a
    per cent.
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
    """Head-on impact of grains that spin about a tangential axis.

    There is no sliding friction and no gravity. Rolling friction alone changes the spin, and the
    spin is fast enough to keep the moment at its cap.
    """
    p, grain, wall = scene(
        gravity=False,
        restitution=restitution,
        rolling_friction=rolling_friction,
        sliding_friction=0.0,
    )
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
    """A grain rolls on a floor without slip until shortly before it rests.

    Its speed 5/7 mu_r g t brings it to rest after t = duration. It starts from static overlap. The
    deceleration is fitted between 10 % and 80 % of the duration, when the start-up oscillation of
    the contact springs has died. A shared edge of two facets is crossed half-way to the stop.
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
        samples.append(
            (O.time - begin, body.state.vel[0], body.state.angVel[1] * r, len(contacts(body)))
        )

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
    """A fixed grain under five grain weights turns about a tangential axis until past the cap.

    Without sliding friction the torque on it is the rolling moment alone. ratio : radius of the
    other grain over its own; for unequal grains the functor of the project takes the eta and the
    stiffness of that pair. A softer spring than the default's turns as much faster, so that it is
    as far past the cap in the end.
    """
    rolling = dict(rolling_friction=rolling_friction, rolling_spring=spring)
    p, grain, wall = scene(sliding_friction=0.0, rolling_stiffness_ratio=stiffness_ratio, **rolling)
    r, load, spin = p["particle_radius"], 5 * grain_weight(p), 0.1 * 4.0 / stiffness_ratio
    r_eff = effective_radius(p, partner)
    if partner == "grain":
        other = ratio * r
        r_eff = r * other / (r + other)
        if ratio != 1:
            functor = functor_of(grain, grain)
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


def spinning(kind, spin=10.0):
    """A grain on a floor spins about the vertical: its spin [rad/s] before and after 0.1 s."""
    p, grain, wall = scene()
    r = p["particle_radius"]
    add_floor(kind, wall)
    body = add_grain(p, r - static_overlap(p, grain_weight(p), r), grain, spin=(0, 0, spin))
    run(0.1)
    return dict(before=spin, after=body.state.angVel[2])


def unled_dispatch():
    """What becomes of the two functors where the dispatcher takes a list to its end."""
    p, _, _ = scene()
    stopper, material.IPhysFunctor = material.IPhysFunctor, Ip2_FrictMat_FrictMat_FrictPhys
    try:
        material.dispatch(IPhysDispatcher(), *material.contact_functors(p))
    except RuntimeError as error:
        return dict(error=str(error))
    finally:
        material.IPhysFunctor = stopper
    return dict(error=None)


def rocking(kind, stiffness_ratio, kick=1e-3):
    """Period [s] of a grain on a floor that is turned by less than the cap, its centre held.

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
    after = np.flatnonzero((spin[:-1] > 0) & (spin[1:] <= 0))[
        :2
    ]  # the first two times that it stops to turn back
    stops = t[after] + (t[after + 1] - t[after]) * spin[after] / (spin[after] - spin[after + 1])
    inertia = 0.4 * material.grain_mass(p) * r**2
    return dict(
        parameters=p,
        load=load,
        effective_radius=r,
        inertia=inertia,
        step=O.dt,
        period=np.diff(stops)[0],
    )


def time_steps(stiffness_ratio):
    """The step [s] of soft grains, and what the calibrator has to know to foresee it."""
    p, _, _ = scene(young_modulus=1e6, rolling_stiffness_ratio=stiffness_ratio)
    return dict(parameters=p, time_step=O.dt, rayleigh=material.rayleigh_time(p))
