"""Experiments on the effects that are off by default."""

import effects
import grains
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
)
from yade import O


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
    p, grain, _ = scene(bond_number=bond_number)
    r = p["particle_radius"]
    add_grain(p, 2 * r, grain, fixed=True)
    body = add_grain(p, 1e-4 * r, grain)
    run(duration)
    return dict(fallen=-body.state.pos[2], contacts=len(contacts(body)))


def falling(bed_viscosity, duration=0.4):
    """A grain falls freely in a viscous gas, like one of a set-up: its final velocity [m/s]."""
    p, grain, _ = scene(bed_viscosity=bed_viscosity)
    (i,) = grains.add(p, np.array([[0.0, 0.0, 0.0]]), grain, np.random.default_rng(1))
    body = O.bodies[i]
    body.state.vel = (0, 0, 0)
    run(duration)
    return dict(
        weight=grain_weight(p),
        radius=p["particle_radius"],
        speed=-body.state.vel[2],
        kept=len(O.engines),
    )


def falling_askew(tilt_deg, duration=0.01):
    """A grain falls freely in a tilted set-up: its mean acceleration [m/s2]."""
    p, grain, _ = scene(tilt_deg=tilt_deg)
    body = add_grain(p, 0, grain)
    run(duration)
    return dict(acceleration=[v / O.time for v in body.state.vel])


def falling_from_a_shaken_hand(shaking, frequency, periods, shaking_time):
    """A grain falls in a set-up that vibrates: velocity [m/s] after so many periods.

    Also whether it still vibrates.
    """
    p, grain, _ = scene(shaking=shaking, shaking_frequency=frequency, shaking_time=shaking_time)
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
    """Rolling cap [m] of every pair of sizes under a unit force, as computed and as wanted."""
    p, grain, _ = scene(size_spread=size_spread, rolling_friction=rolling_friction)
    radii, eta = material.size_classes(p), functor_of(grain, grain).eta
    pairs = [(a, b) for a in radii for b in radii]
    return dict(
        given=[eta * (a + b) / 2 for a, b in pairs],
        wanted=[rolling_friction * a * b / (a + b) for a, b in pairs],
    )


def sizes(size_spread, count=7000):
    """Moments of the radii as created: mean [m], coefficient of variation, mean mass [kg]."""
    p, grain, _ = scene(size_spread=size_spread)
    centres = 0.01 * np.array([(i % 20, i // 20 % 20, i // 400) for i in range(count)], float)
    ids = grains.add(p, centres, grain, np.random.default_rng(1))
    radii = np.array([O.bodies[i].shape.radius for i in ids])
    return dict(
        nominal=p["particle_radius"],
        mean=radii.mean(),
        spread=radii.std() / radii.mean(),
        mean_mass=grains.total_mass(p, ids) / count,
        expected_mass=material.mean_grain_mass(p),
        time_step=O.dt,
        smallest=radii.min(),
    )


def given_sizes(text, count=1000):
    """Grains of a size distribution as created: radii over the nominal one, and how many of each.

    Their mean mass [kg], as it is and as the forecast has it.
    """
    p, grain, _ = scene(size_distribution=text)
    centres = 0.01 * np.array([(i % 10, i // 10 % 10, i // 100) for i in range(count)], float)
    ids = grains.add(p, centres, grain, np.random.default_rng(1))
    radii = [O.bodies[i].shape.radius / p["particle_radius"] for i in ids]
    sizes, numbers = np.unique(np.round(radii, 9), return_counts=True)
    return dict(
        radii=sizes.tolist(),
        numbers=numbers.tolist(),
        mean_mass=grains.total_mass(p, ids) / count,
        expected_mass=material.mean_grain_mass(p),
        order=[float(r) for r in radii[:20]],
    )


def clump(aspect):
    """Mass [kg], inertia [kg m2] and extent [m] of a clump as it is created."""
    p, grain, _ = scene(clump_aspect=aspect)
    (i,) = grains.add(p, np.array([[0.0, 0.0, 0.0]]), grain, np.random.default_rng(1))
    centres, state = grains.positions([i]), O.bodies[i].state
    return dict(
        grain_mass=material.grain_mass(p),
        mass=state.mass,
        inertia=sorted(state.inertia),
        sphere_radius=float(grains.radii(p, [i])),
        distance=float(np.linalg.norm(centres[0] - centres[1])),
    )


class Upright:
    """A source of random numbers that turns every clump upright and launches it at rest."""

    def normal(self, mean=0, scatter=1, size=None):
        return np.zeros(size) if scatter != 1 else np.tile([0.0, 0.0, 1.0], (size[0], 1))


def clump_rebound(aspect=1.3, speed=0.1):
    """A clump that stands on its end hits a floor: ratio of velocities, and its spin.

    There is no gravity.
    """
    p, grain, wall = scene(gravity=False, clump_aspect=aspect)
    add_floor("wall", wall)
    reach = material.largest_reach(p)
    (i,) = grains.add(p, np.array([[0.0, 0.0, 1.001 * reach]]), grain, Upright())
    state = O.bodies[i].state
    state.vel = (0, 0, -speed)
    run(5e-3)
    return dict(
        restitution=state.vel[2] / speed,
        wanted=p["restitution"],
        spin=state.angVel.norm() * p["particle_radius"] / speed,
    )


def clump_fall(bed_viscosity, duration=0.4):
    """A clump falls in a viscous gas: final speed, as `falling`."""
    p, grain, _ = scene(clump_aspect=1.5, bed_viscosity=bed_viscosity)
    (i,) = grains.add(p, np.array([[0.0, 0.0, 0.0]]), grain, np.random.default_rng(1))
    O.bodies[i].state.vel = (0, 0, 0)
    run(duration)
    return dict(
        weight=grain_weight(p), radius=p["particle_radius"], speed=-O.bodies[i].state.vel[2]
    )
