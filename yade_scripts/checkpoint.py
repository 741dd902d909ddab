"""Checkpoints of long runs: what a run that is killed goes on from.

Every so many particle-steps a run saves its scene by YADE's own save, with what the set-up's script
remembers beside it, into ./checkpoints/<run id>. A run that finds a checkpoint of its own request,
scripts and YADE builds its scene as always and then takes, in `stop.run_until`, the saved scene for
the one that it has just built.

YADE's file holds every number of the scene, but not the order in which its collider will find the
next contacts, and forces are summed in that order. So a scene that was loaded parts from the one
that went on, first by a rounding error. That is why a run loads each of its own checkpoints, too:
the moments depend on the request alone, so that a run and one that was killed and went on are the
same, bit for bit (tests/test_checkpoints.py). A run that ends before its first checkpoint is the
same as one of scripts that have never heard of them.

Waits that had ended before the checkpoint are not made again either: the scene at the end of each
long one is kept, because the script reads positions there.
"""

import gzip
import json
import os
import shutil
import sys
import time
import zlib

from yade import O, config

EVERY = 1e8  # particle-steps between two checkpoints: one or two minutes of a core
SHORT = 0.1  # share of EVERY up to which a wait is made again, rather than its end be kept
ENDING = ".bin.gz"  # YADE chooses the format by it
TRIES = 3  # times that a run goes on from one checkpoint and does not reach the next

before_save = []  # functions without arguments that make a scene such that YADE can load it
after_load = []  # those that undo this, and mend what a load leaves undone
_run = {}


def begin(folder, request):
    """Start to keep checkpoints of a run in a folder, and look for one to go on from.

    request : whatever it depends on, as JSON can hold it; one of anything else is not used.
    """
    about = json.loads(json.dumps(dict(request, yade=config.version)))
    now = time.time()
    _run.clear()
    _run.update(folder=folder, about=about, found=None, wait=-1, last=0, ends={}, memories={})
    _run.update(cpu=0.0, wall=0.0, started=now, woke=now, resumed=[])
    found = _read()
    if found and found["about"] == about and found["tries"] < TRIES and _whole(found):
        found["tries"] += 1
        _write_state(found)
        _run.update(found=found)
        print("%s: goes on from its checkpoint at step %d" % (folder, found["last"]))
    else:
        end()


def end():
    """Remove the checkpoint of the run: it has its record, or starts from the beginning."""
    shutil.rmtree(_run["folder"], ignore_errors=True)


def provenance():
    """When the run began, how long it has worked, and the steps it went on from, if it did."""
    noted = dict(started=_run["started"], wall_time=_wall_time())
    if _run["resumed"]:
        noted["resumed"] = "from step " + ", ".join(str(step) for step in _run["resumed"])
    return noted


def _wall_time():
    return _run["wall"] + time.time() - _run["woke"]


def cpu_time():
    """CPU time [s] of the run so far, that of earlier processes included."""
    return _run.get("cpu", 0.0) + time.process_time()


def enter(memory):
    """A wait begins: "ended" where the scene is now that of its end, else "under way" or "new".

    memory : a dictionary, as JSON can hold it, of what the script remembers from look to look; it
    gets what it held in the scene that was loaded.
    """
    if not _run:  # a scene that is no run
        return "new"
    _run.update(wait=_run["wait"] + 1, began=O.iter)
    found, wait = _run["found"], str(_run["wait"])
    if found and _run["wait"] == found["wait"]:
        _load(found["scene"])
        _run.update({n: found[n] for n in ("last", "ends", "memories", "started", "wall")})
        _run.update(resumed=[*found["resumed"], found["last"]], found=None)
        _take_over(found["memories"][wait], found["cpu"], memory)
        return "under way"
    if found and wait in found["ends"]:
        _load("end_" + wait)
        _take_over(found["memories"][wait], found["ends"][wait], memory)
        return "ended"
    return "new"


def due():
    """Whether it is time for a checkpoint."""
    return bool(_run) and not _run["found"] and _work(_run["last"]) >= EVERY


def save(memory):
    """Write a checkpoint within a wait, and go on from it. A full disk costs the checkpoint only.

    memory : see `enter`.
    """
    _run["last"], name = O.iter, "step_%d" % O.iter
    _run["memories"][str(_run["wait"])] = memory
    state = {n: _run[n] for n in ("about", "wait", "last", "ends", "memories", "started")}
    state.update(resumed=_run["resumed"], scene=name, tries=0, cpu=cpu_time(), wall=_wall_time())
    if _written(name, state):
        kept = {"state.json", *(n + ENDING for n in (name, *("end_" + w for w in _run["ends"])))}
        for other in set(os.listdir(_run["folder"])) - kept:
            os.remove(os.path.join(_run["folder"], other))
        _load(name)


def leave(memory):
    """A wait has ended: keep the scene if it would take long to come here again."""
    if not _run or _run["found"]:
        return
    name = str(_run["wait"])
    far = _run["ends"] or _run["last"] or _work(_run["began"]) >= SHORT * EVERY
    if far and _written("end_" + name):
        _run["ends"][name], _run["memories"][name] = cpu_time(), memory


def _work(since):
    """Particle-steps since a step."""
    return (O.iter - since) * len(O.bodies)


def _take_over(remembered, cpu, memory):
    """Take over what a wait remembered, and the CPU time [s] at that moment."""
    memory.update(remembered)
    _run.update(cpu=cpu - time.process_time(), woke=time.time())


def _written(name, state=None):
    """Whether the scene could be written under a name, and then the state."""
    for function in before_save:
        function()
    path = os.path.join(_run["folder"], name + ENDING)
    temporary = os.path.join(_run["folder"], "new" + ENDING)
    try:
        os.makedirs(_run["folder"], exist_ok=True)
        O.save(temporary, True)
        _read_through(temporary)  # YADE says nothing of a full disk
        with open(temporary, "rb") as stream:
            os.fsync(stream.fileno())
        os.replace(temporary, path)
        if state:
            _write_state(state)
    except (OSError, EOFError, zlib.error, RuntimeError) as error:
        print("no checkpoint: %s: %s" % (type(error).__name__, error), file=sys.stderr)
        return False
    finally:
        for function in after_load:
            function()
    return True


def _whole(found):
    """Whether every scene of a checkpoint can be read to its end."""
    try:
        for name in (found["scene"], *("end_" + wait for wait in found["ends"])):
            _read_through(os.path.join(_run["folder"], name + ENDING))
    except (OSError, EOFError, zlib.error):
        return False
    return True


def _read_through(path):
    """Raise OSError or the like where a compressed file is cut off or damaged."""
    with gzip.open(path) as stream:
        while stream.read(1 << 20):
            pass


def _load(name):
    """Put the scene of that name in the place of the one that there is."""
    O.load(os.path.join(_run["folder"], name + ENDING), True)
    for function in after_load:
        function()


def _write_state(state):
    path = os.path.join(_run["folder"], "state.json")
    with open(path + ".new", "w") as stream:
        json.dump(state, stream)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(path + ".new", path)


def _read():
    """The state of the last checkpoint, or None."""
    try:
        with open(os.path.join(_run["folder"], "state.json")) as stream:
            return json.load(stream)
    except (OSError, ValueError):
        return None
