"""Watch a run: its set-up's script as it is, and snapshots at moments at which that looks anyway.

The verb `view` lays a copy of this file, called as the set-up's script is, into `watched/` of a
folder of runs, and has yade-batch call it. It lies in a folder of its own because the scripts are
what makes a record, and their hash says which did: this one only reads. No engine is added, so that
the steps, the checkpoints and the record are those of the run that nobody watched, bit for bit.

A snapshot is `snapshots/<wait>_<look>.npz`, numbered by the run's waits and the looks of each.
Every look is taken until a wait has MOST of them; then every other one is dropped, and so on. A run
that goes on from a checkpoint knows where it was, as the set-ups do, from the wait's memory.
"""

import glob
import os
import sys

HERE = os.path.dirname(os.path.abspath(sys.argv[0]))
SCRIPTS = os.path.join(os.path.dirname(HERE), "scripts")
sys.argv[0] = os.path.join(SCRIPTS, os.path.basename(sys.argv[0]))
sys.path.insert(0, SCRIPTS)

import numpy as np
from yade import Facet, O, Sphere, Wall

import stop

MOST = 128  # snapshots of a wait; half as many stay at least, where there are that many looks
FOLDER = "snapshots"

_run_until, _waits = stop.run_until, []


def watched_until(look, interval, longest, what, memory=None):
    """`stop.run_until`, with a snapshot of the scene as some of the looks leave it."""
    memory = {} if memory is None else memory
    memory["watched"] = [0, 1]  # looks so far, and how many there are from snapshot to snapshot
    wait = len(_waits)
    _waits.append(what)

    def watched():
        done = look()
        looks, stride = memory["watched"]
        if looks == 0:
            _drop(wait, lambda number: True)  # those of a process that was killed
        if done or looks % stride == 0:
            _write(wait, looks)
        if len(_numbers(wait)) > MOST:
            stride *= 2
            _drop(wait, lambda number: number % stride)
        memory["watched"] = [looks + 1, stride]
        return done

    _run_until(watched, interval, longest, what, memory)


def _path(wait, number):
    return os.path.join(FOLDER, "%d_%09d.npz" % (wait, number))


def _numbers(wait):
    """Numbers of the looks that there are snapshots of."""
    names = glob.glob(os.path.join(FOLDER, "%d_*.npz" % wait))
    return sorted(int(os.path.basename(name)[len("%d_" % wait) : -len(".npz")]) for name in names)


def _drop(wait, unwanted):
    for number in _numbers(wait):
        if unwanted(number):
            os.remove(_path(wait, number))


def _write(wait, number):
    """Write a snapshot, whole or not at all."""
    os.makedirs(FOLDER, exist_ok=True)
    path = _path(wait, number)
    with open(path + ".tmp", "wb") as stream:
        np.savez_compressed(stream, stage=wait, time=O.time, **spheres(), **walls())
    os.replace(path + ".tmp", path)


def spheres():
    """Arrays of the n spheres that are not retired (grains.retire).

    Those of a clump share its number; a periodic scene's lie within its cell.
    """
    found = [b for b in O.bodies if isinstance(b.shape, Sphere) and b.groupMask]
    centres = np.array([tuple(b.state.pos) for b in found]).reshape(-1, 3)
    if O.periodic:
        centres = np.mod(centres, np.array(tuple(O.cell.size)))
    return dict(
        ids=np.array([b.id for b in found], dtype="i4"),
        clumps=np.array([b.clumpId if b.isClumpMember else b.id for b in found], dtype="i4"),
        centres=centres.astype("f4"),
        radii=np.array([b.shape.radius for b in found], dtype="f4"),
        speeds=np.array([b.state.vel.norm() for b in found], dtype="f4"),
    )


def walls():
    """Corners (m, 3, 3) of the facets, and axis and place (k, 2) of the planes without end."""
    facets = [b for b in O.bodies if isinstance(b.shape, Facet)]
    corners = [[tuple(b.state.pos + b.state.ori * v) for v in b.shape.vertices] for b in facets]
    planes = [b for b in O.bodies if isinstance(b.shape, Wall)]
    return dict(
        facets=np.array(corners, dtype="f4").reshape(-1, 3, 3),
        planes=np.array([(b.shape.axis, b.state.pos[b.shape.axis]) for b in planes]).reshape(-1, 2),
    )


stop.run_until = watched_until
with open(sys.argv[0]) as _stream:
    exec(compile(_stream.read(), sys.argv[0], "exec"), {"__name__": "__main__"})
