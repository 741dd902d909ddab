"""What every set-up script does around its simulation: request, scene, record."""

import hashlib
import math
import os
import platform
import re
import traceback

from yade import (
    Bo1_Facet_Aabb,
    Bo1_Sphere_Aabb,
    Bo1_Wall_Aabb,
    ForceResetter,
    Ig2_Facet_Sphere_ScGeom,
    Ig2_Sphere_Sphere_ScGeom,
    Ig2_Wall_Sphere_ScGeom,
    InsertionSortCollider,
    InteractionLoop,
    Law2_ScGeom_MindlinPhys_Mindlin,
    NewtonIntegrator,
    O,
    utils,
)
from yade import config

import checkpoint
import contract
import effects
import material
import quiet
import stop

_members = {}  # {id of a clump: ids of its spheres}; empty where grains are spheres
_states = {}  # {id: state} of grains that were asked for in the present scene
_possible = {"speed": math.inf}  # what gravity can give a grain of this scene [m/s]
_sizes = {}  # {id: (radius [m], mass [kg])} of grains of several sizes; empty where all are alike

NOMINAL_FRACTION = 0.57


def main(setup, simulate):
    """Run one request and write its record to ./records.

    The request is the line of the yade-batch table named by YADE_BATCH, or the defaults of
    contract.json. One table may serve several set-ups, so columns that belong to another one are
    passed over. simulate(p, diagnostics) returns (status, responses, curves); its exceptions become
    the record's status.
    """
    defaults = {name: spec["default"] for name, spec in contract.CONTRACT["parameters"].items()}
    utils.readParamsFromTable(noTableOk=True, unknownOk=False, **defaults)
    from yade.params import table

    given = {name: getattr(table, name) for name in contract.parameters_of(setup)}
    diagnostics, curves = {}, {}
    record = dict(
        schema=contract.CONTRACT["schema"],
        setup=setup,
        run_id=_run_id(setup),
        parameters=contract.echoed(given),
    )
    checkpoint.begin(
        os.path.join("checkpoints", record["run_id"]), dict(record, scripts=scripts_hash())
    )
    try:
        p = contract.checked(setup, given)
        record["parameters"] = contract.echoed(p)
        status, responses, curves = simulate(p, diagnostics)
        record.update(status=status, responses=responses, error=None)
    except contract.BadInput as error:
        record.update(status="input", responses={}, error=str(error))
    except stop.NotSettled as error:
        record.update(status="not_settled", responses={}, error=str(error))
    except stop.Unstable as error:
        record.update(status="unstable", responses={}, error=str(error))
    except Exception as error:
        record.update(status="crash", responses={}, error="%s: %s" % (type(error).__name__, error))
        record["traceback"] = traceback.format_exc()
    record["diagnostics"] = diagnostics
    record["provenance"] = dict(
        yade=config.version,
        scripts=scripts_hash(),
        host=platform.node(),
        **checkpoint.provenance(),
    )
    contract.write_record("records", record["run_id"], record, curves)
    checkpoint.end()
    print(
        "%s: %s%s"
        % (record["run_id"], record["status"], ": " + record["error"] if record["error"] else "")
    )


def _run_id(setup):
    """The table's description column; a file name whatever a user wrote there."""
    description = O.tags["description"] if "description" in O.tags.keys() else setup + "_by_hand"
    return re.sub(r"[^A-Za-z0-9_.-]", "_", description)[:120]


def scripts_hash():
    """Short hash over the scripts and the contract: each record says which made it."""
    digest = hashlib.sha256()
    for name in sorted(os.listdir(contract.HERE)):
        if name.endswith((".py", ".json")):
            with open(os.path.join(contract.HERE, name), "rb") as stream:
                digest.update(stream.read())
    return digest.hexdigest()[:12]


def engines(p):
    """YADE's loop: damping 0, Hertz-Mindlin with moments, a collider margin near its optimum."""
    between_grains, at_walls = material.contact_functors(p)
    integrator = NewtonIntegrator(damping=0, gravity=(0, 0, -material.GRAVITY))
    effects.start(p, between_grains, at_walls, integrator)
    contacts = InteractionLoop(
        [
            Ig2_Sphere_Sphere_ScGeom(),
            Ig2_Facet_Sphere_ScGeom(hertzian=True),
            Ig2_Wall_Sphere_ScGeom(hertzian=True),
        ],
        [between_grains],
        [Law2_ScGeom_MindlinPhys_Mindlin(includeMoment=True, includeAdhesion=True)],
    )
    material.dispatch(contacts.physDispatcher, between_grains, at_walls)
    _prepare_checkpoints(between_grains, at_walls)
    return [
        ForceResetter(),
        InsertionSortCollider(
            [Bo1_Sphere_Aabb(), Bo1_Facet_Aabb(), Bo1_Wall_Aabb()],
            verletDist=0.2 * p["particle_radius"],
        ),
        contacts,
        integrator,
    ]


def _prepare_checkpoints(between_grains, at_walls):
    """YADE cannot load what material.dispatch leaves, and a scene that is loaded has new states."""

    def physics():
        (contacts,) = (e for e in O.engines if isinstance(e, InteractionLoop))
        return contacts.physDispatcher

    def plain():
        physics().functors = [between_grains]

    def mend():
        material.dispatch(physics(), between_grains, at_walls)
        effects.steer()
        _states.clear()

    checkpoint.before_save[:], checkpoint.after_load[:] = [plain], [mend]


def states_of(ids):
    """The grains' states: asking for a body by number costs more than reading its state."""
    new = [i for i in ids if i not in _states]
    _states.update((i, O.bodies[i].state) for i in new)
    return [_states[i] for i in ids]


def start(p):
    """Set step and engines; returns the grain and wall materials, added to the scene."""
    quiet.silence_log()
    for known in (_sizes, _members, _states):
        known.clear()
    O.dt = material.time_step(p)
    O.engines = engines(p)
    grain, wall = material.materials(p)
    O.materials.append(grain)
    O.materials.append(wall)
    return grain, wall


def grains_for_volume(p, volume):
    """Number of grains that fill a volume [m3] at the nominal packing fraction."""
    mass = NOMINAL_FRACTION * volume * p["particle_density"]
    return max(1, int(round(mass / material.mean_grain_mass(p))))


def add_grains(p, centres, grain, rng):
    """Create the grains, moving down at the pouring velocity and at random; returns their ids.

    The random part, half of sqrt(g d) in each direction, makes the falling cloud forget its
    lattice; without it the filled density scatters more from seed to seed.
    """
    if effects.is_on(p, "clump_aspect"):
        return _launched(p, _add_clumps(p, centres, grain, rng), rng)
    radii, sizes = material.size_classes(p), [0] * len(centres)
    if len(radii) > 1:
        sizes = rng.permutation(len(centres)) % len(radii)
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


def fill(p, ids, diagnostics):
    """Let the cloud fall and settle; a set-up that vibrates does so from then on.

    Raises Unstable where a grain is too fast, NotSettled where one has left the vessel: it would
    fall for ever.
    """
    begin, energy, top = O.time, material.filling_energy(p), states_of(ids)[-1].pos[2]
    not_before = begin + stop.fall_time(top, material.GRAVITY) / 2
    lost = -10 * material.largest_reach(p)
    _possible["speed"] = material.possible_speed(p, top)
    slower = " or a lower pouring_velocity" if p["pouring_velocity"] > 0 else ""

    def settled():
        states = states_of(ids)
        stop.check_speed(states, _possible["speed"], O.dt, "filling")
        if any(state.pos[2] < lost for state in states):
            raise stop.NotSettled("filling: a grain has left the vessel: try another seed" + slower)
        return O.time > not_before and kinetic_energy(p, states) < energy

    clock = checkpoint.cpu_time()
    stop.run_until(settled, p["sampling_interval"] * 5, p["longest_time"], "filling")
    diagnostics.update(
        particles=len(ids),
        time_step=O.dt,
        rayleigh_fraction=O.dt / material.rayleigh_time(p),
        filling_time=O.time - begin,
        filling_cpu=checkpoint.cpu_time() - clock,
    )
    effects.shake(p)


def finish(p, ids, diagnostics, released, clock, reason):
    """Diagnostics of the final state."""
    mass, states = material.grain_mass(p), states_of(ids)
    diagnostics.update(
        particles_left=len(ids),
        steps=O.iter,
        release_time=O.time - released,
        stop_reason=reason,
        kinetic_energy=kinetic_energy(p, states),
        rotational_energy=stop.mean_rotational_energy(states, mass, p["particle_radius"]),
        release_cpu=checkpoint.cpu_time() - clock,
    )


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
    import numpy as np

    if _members:
        return material.clump_radius(p)
    return np.array([_sizes[i][0] for i in ids]) if _sizes else p["particle_radius"]


def at_rest(p, ids, states):
    """Whether the grains' mean translational kinetic energy is below the request's.

    Of clumps those are left out that stand on end and spin about their only contact, as single
    spheres do, too (stop.mean_kinetic_energy): a clump's centre is not quite above the contact and
    circles with it. Nothing is at rest on a set-up that still vibrates.
    Raises Unstable where a grain is too fast.
    """
    stop.check_speed(states, _possible["speed"], O.dt, "release")
    if effects.shakes():
        return False
    energy, limit = kinetic_energy(p, states), p["rest_kinetic_energy"]
    if energy < limit or not _members:
        return energy < limit
    counted = [s for i, s in zip(ids, states, strict=True) if not _spins_on_end(p, i, s)]
    return kinetic_energy(p, counted) * len(counted) / len(states) < limit


def _spins_on_end(p, i, state):
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
    import numpy as np

    if _members:
        ids = [m for i in ids for m in _members[i]]

    return np.array([tuple(state.pos) for state in states_of(_spheres(ids))]).reshape(-1, 3)
