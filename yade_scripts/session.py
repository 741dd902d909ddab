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
import grains
import material
import quiet
import stop

_possible = {"speed": math.inf}  # what gravity can give a grain of this scene [m/s]


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
        grains.forget_states()

    checkpoint.before_save[:], checkpoint.after_load[:] = [plain], [mend]


def start(p):
    """Set step and engines; returns the grain and wall materials, added to the scene."""
    quiet.silence_log()
    grains.forget()
    O.dt = material.time_step(p)
    O.engines = engines(p)
    grain, wall = material.materials(p)
    O.materials.append(grain)
    O.materials.append(wall)
    return grain, wall


def fill(p, ids, diagnostics):
    """Let the cloud fall and settle; a set-up that vibrates does so from then on.

    Raises Unstable where a grain is too fast, NotSettled where one has left the vessel: it would
    fall for ever.
    """
    begin, energy, top = O.time, material.filling_energy(p), grains.states_of(ids)[-1].pos[2]
    not_before = begin + stop.fall_time(top, material.GRAVITY) / 2
    lost = -10 * material.largest_reach(p)
    _possible["speed"] = material.possible_speed(p, top)
    slower = " or a lower pouring_velocity" if p["pouring_velocity"] > 0 else ""

    def settled():
        states = grains.states_of(ids)
        check_speed(states, "filling")
        if any(state.pos[2] < lost for state in states):
            raise stop.NotSettled("filling: a grain has left the vessel: try another seed" + slower)
        return O.time > not_before and grains.kinetic_energy(p, states) < energy

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
    mass, states = material.grain_mass(p), grains.states_of(ids)
    diagnostics.update(
        particles_left=len(ids),
        steps=O.iter,
        release_time=O.time - released,
        stop_reason=reason,
        kinetic_energy=grains.kinetic_energy(p, states),
        rotational_energy=stop.mean_rotational_energy(states, mass, p["particle_radius"]),
        release_cpu=checkpoint.cpu_time() - clock,
    )


def check_speed(states, what, more=0.0):
    """Raise Unstable where a grain is too fast; more : speed [m/s] of what drives the grains."""
    stop.check_speed(states, _possible["speed"] + more, O.dt, what)


def at_rest(p, ids, states):
    """Whether the grains' mean translational kinetic energy is below the request's.

    Of clumps those are left out that stand on end and spin about their only contact, as single
    spheres do, too (stop.mean_kinetic_energy): a clump's centre is not quite above the contact and
    circles with it. Nothing is at rest on a set-up that still vibrates.
    Raises Unstable where a grain is too fast.
    """
    check_speed(states, "release")
    if effects.shakes():
        return False
    energy, limit = grains.kinetic_energy(p, states), p["rest_kinetic_energy"]
    if energy < limit or not grains.are_clumps():
        return energy < limit
    counted = [s for i, s in zip(ids, states, strict=True) if not grains.spins_on_end(p, i, s)]
    return grains.kinetic_energy(p, counted) * len(counted) / len(states) < limit
