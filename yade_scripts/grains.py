"""The grains of a scene: what they are made of, and how they are asked, added and taken out.

A grain is a sphere, one of several sizes, or a clump of two spheres (effects.py). Its id is that of
the sphere or the clump.
"""

import math

import numpy as np
from yade import O, utils

import effects
import material
import stop

_members = {}  # {id of a clump: ids of its spheres}; empty where grains are spheres
_sizes = {}  # {id: (radius [m], mass [kg])} of grains of several sizes; empty where all are alike
_states = {}  # {id: state} of grains that were asked for in the present scene

NOMINAL_FRACTION = 0.57


def forget():
    """A new scene begins: it has no grains yet."""
    for known in (_members, _sizes, _states):
        known.clear()


def forget_states():
    """The scene was loaded: its grains are the same, YADE's objects are others."""
    _states.clear()


def states_of(ids):
    """The grains' states: asking for a body by number costs more than reading its state."""
    new = [i for i in ids if i not in _states]
    _states.update((i, O.bodies[i].state) for i in new)
    return [_states[i] for i in ids]


def for_volume(p, volume):
    """Number of grains that fill a volume [m3] at the nominal packing fraction."""
    mass = NOMINAL_FRACTION * volume * p["particle_density"]
    return max(1, int(round(mass / material.mean_grain_mass(p))))


def add(p, centres, grain, rng):
    """Create the grains, moving down at the pouring velocity and at random; returns their ids.

    The random part, half of sqrt(g d) in each direction, makes the falling cloud forget its
    lattice; without it the filled density scatters more from seed to seed.
    """
    if effects.is_on(p, "clump_aspect"):
        return _launched(p, _add_clumps(p, centres, grain, rng), rng)
    radii, sizes = material.size_classes(p), [0] * len(centres)
    if len(radii) > 1:
        sizes = _drawn(rng.permutation(len(centres)), material.size_shares(p))
    ids = O.bodies.append(
        [
            utils.sphere(tuple(c), radii[s], material=grain)
            for c, s in zip(centres, sizes, strict=True)
        ]
    )
    if len(radii) > 1:
        _sizes.update(
            {i: (radii[s], O.bodies[i].state.mass) for i, s in zip(ids, sizes, strict=True)}
        )
    return _launched(p, ids, rng)


def _drawn(order, shares):
    """Which size each of the grains has, whose numbers (n,) stand in a random order."""
    if len(set(shares)) == 1:
        return order % len(shares)
    ends = np.cumsum(shares) / sum(shares) * len(order)
    return np.minimum(np.searchsorted(ends, order + 0.5), len(shares) - 1)


def _add_clumps(p, centres, grain, rng):
    """Clumps of two spheres; returns the ids of the clumps and remembers their spheres."""
    radius, ids = material.clump_radius(p), []
    for pair in effects.two_spheres(p, centres, rng):
        clump, members = O.bodies.appendClumped(
            [utils.sphere(tuple(c), radius, material=grain) for c in pair], discretization=10
        )
        effects.weigh_clump(p, O.bodies[clump], [O.bodies[i] for i in members])
        _members[clump] = members
        ids.append(clump)
    return ids


def _spheres(ids):
    """Ids of the spheres that grains consist of."""
    return [m for i in ids for m in _members.get(i, (i,))]


def _launched(p, ids, rng):
    """Give grains their velocities and the effects that act on them; returns the ids."""
    for i, velocity in zip(
        ids, rng.normal(0, material.random_speed(p), (len(ids), 3)), strict=True
    ):
        O.bodies[i].state.vel = (velocity[0], velocity[1], velocity[2] - p["pouring_velocity"])
    loop = list(O.engines)
    O.engines = loop[:-1] + effects.engines(p, _spheres(ids)) + loop[-1:]
    return ids


def pouring_rate(p, centres):
    """Mass over the time in which the cloud arrives in free fall [kg/s]."""
    g, v = material.GRAVITY, p["pouring_velocity"]
    low, high = (((v * v + 2 * g * z) ** 0.5 - v) / g for z in (centres[0][2], centres[-1][2]))
    return len(centres) * material.grain_mass(p) / (high - low) if high > low else 0.0


def erase(i):
    """Take a grain out of the scene for good."""
    _states.pop(i, None)
    O.bodies.erase(i, bool(_members))


def retire(ids, shift):
    """Take grains out of a periodic scene: set aside by `shift` [m], frozen, in no group.

    Erasing them would be simpler, but YADE's periodic collider can then sort for ever (three ledges
    of six hung). Freezing them where they are would not do: pairs that the collider has already
    found stay in contact.
    """
    for i in ids:
        body = O.bodies[i]
        body.state.pos += shift
        for part in {i, *_spheres([i])}:
            O.bodies[part].groupMask = 0
        body.dynamic = False
        body.state.vel = body.state.angVel = (0, 0, 0)


def total_mass(p, ids):
    """Mass of grains [kg], also of those that have been erased."""
    return sum(_sizes[i][1] for i in ids) if _sizes else len(ids) * material.grain_mass(p)


def share(p, part, whole):
    """Mass of some grains over that of others."""
    return total_mass(p, part) / total_mass(p, whole) if _sizes else len(part) / len(whole)


def radii(p, ids):
    """Radius [m] of the grains' spheres: one number where all have the same, else (n,)."""
    if _members:
        return material.clump_radius(p)
    return np.array([_sizes[i][0] for i in ids]) if _sizes else p["particle_radius"]


def are_clumps():
    """Whether grains are clumps."""
    return bool(_members)


def spins_on_end(p, i, state):
    """Whether a clump turns about the vertical, without rolling, on one contact."""
    rolling = math.hypot(state.angVel[0], state.angVel[1])
    if kinetic_energy(p, [state]) < p["rest_kinetic_energy"] or abs(state.angVel[2]) < 10 * rolling:
        return False
    return sum(c.isReal for m in _members[i] for c in O.bodies[m].intrs()) == 1


def kinetic_energy(p, states):
    """Mean translational kinetic energy of grains [J]."""
    return stop.mean_kinetic_energy(states, None if _sizes else material.grain_mass(p))


def positions(ids):
    """Centres (n, 3) [m] of the grains, or of the spheres that they are clumped of."""
    return np.array([tuple(state.pos) for state in states_of(_spheres(ids))]).reshape(-1, 3)
