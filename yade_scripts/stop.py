"""Running until a condition holds, and the energies that decide it."""

import math
import time

from yade import O, PyRunner

import checkpoint

LOOK = "import stop; stop._look()"
_watch = {"look": None, "done": False, "error": None}
FAR_ABOVE = 5  # times the speed that gravity can give: no collision of grains multiplies it so


class NotSettled(Exception):
    """The longest simulated time passed first."""


class Unstable(Exception):
    """A grain is faster than gravity can make it: the time step is too long."""


def run_until(look, interval, longest, what, memory=None):
    """Step until look() is true.

    look is called every `interval` seconds of simulated time, inside one single O.run: separate
    short runs cost 40 ms each. Raises NotSettled after `longest` seconds, and whatever look()
    raises.

    memory : a dictionary, as JSON can hold it, in which look keeps what it has to know the next
    time. A long run is saved with it (checkpoint.py) and may go on in another process, where YADE's
    objects are others as well: look asks for grains' states anew each time (grains.states_of).
    """
    end, memory = O.time + longest, {} if memory is None else memory

    def guarded():
        if look():
            return True
        if O.time > end:
            raise NotSettled("%s: not at rest after %g s of simulated time" % (what, longest))
        return False

    _watch.update(look=guarded, done=False, error=None)
    there = checkpoint.enter(memory)
    if there == "ended":
        return
    if there == "new":
        every = max(1, int(round(interval / O.dt)))
        O.engines = [*O.engines, PyRunner(command=LOOK, iterPeriod=every, initRun=False)]
    _run_to_pause()
    while not _watch["done"] and checkpoint.due():
        checkpoint.save(memory)
        _run_to_pause()
    O.engines = [e for e in O.engines if not (isinstance(e, PyRunner) and e.command == LOOK)]
    if _watch["error"] is not None:
        raise _watch["error"]
    checkpoint.leave(memory)


def _run_to_pause():
    O.run(-1, True)
    # YADE calls itself paused as soon as it is told to, and the step may still be on its way.
    # Engines that are set within a step take their turn after it, and would then replace those of
    # the next wait, which would never look.
    while O.subStep >= 0:
        time.sleep(1e-4)


def _look():
    # An exception, or sys.exit(), inside a PyRunner would hang YADE for ever: keep it and pause
    # instead.
    try:
        _watch["done"] = _watch["look"]()
    except BaseException as error:
        _watch.update(done=True, error=error)
    if _watch["done"] or checkpoint.due():
        O.pause()


def mean_kinetic_energy(states, mass=None):
    """Mean translational kinetic energy of grains of one mass [kg], or of each one's own [J].

    Translational only: a few grains spin about a vertical contact normal for ever, because nothing
    in the model resists that, and YADE's own kineticEnergy() would count them.
    """
    total = 0.0
    for state in states:
        v = state.vel
        square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
        total += square if mass is not None else square * state.mass
    return 0.5 * (1 if mass is None else mass) * total / len(states) if states else 0.0


def check_speed(states, possible, step, what):
    """Raise Unstable where a grain is far above the speed [m/s] that is physically possible.

    step : the time step [s], which then is too long.
    """
    limit = FAR_ABOVE * possible
    # not (a <= b), so that a speed that is no number any more counts as well
    wrong = [speed for state in states if not (speed := state.vel.norm()) <= limit]
    if wrong:
        raise Unstable(
            "%s: a grain moves at %.3g m/s, gravity gives it %.3g at most: the time step of %.3g s"
            " is unstable: lower time_step where it is fixed, else rayleigh_fraction"
            % (what, max(wrong), possible, step)
        )


def mean_rotational_energy(states, mass, radius):
    """Mean rotational kinetic energy of the grains [J], reported beside the translational one."""
    total = sum(state.angVel.squaredNorm() for state in states)
    return 0.5 * 0.4 * mass * radius**2 * total / len(states) if states else 0.0


def fall_time(length, gravity):
    """Time [s] to fall a length from rest: no verdict of rest is given earlier after a release."""
    return math.sqrt(2 * length / gravity)
