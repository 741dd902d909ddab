"""Small experiments on the contact law, run inside YADE; their numbers go into one JSON file.

By hand:  CONTACT_LAW_RECORD=numbers.json yade -n -x -j1 scenes.py

One start of YADE costs two seconds, so all experiments share one process. Their scenes are built
with the project's own modules (materials, contact functors, engines, time step); the formulas they
must obey are in test_contact_law.py and test_effects.py. Everything is in SI units.
"""

import json
import os
import sys

# The script's path is in argv: inside YADE __file__ is YADE's own.
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))
sys.path.insert(0, os.path.join(sys.path[0], "..", "..", "yade_scripts"))

from scenes_contact import (
    bent_contact,
    pressed,
    rebound,
    rocking,
    rolling,
    sliding_impact,
    spinning,
    spinning_impact,
    time_steps,
    unled_dispatch,
)
from scenes_drum import on_a_turning_face, on_a_turning_shell
from scenes_effects import (
    clump,
    clump_fall,
    clump_rebound,
    falling,
    falling_askew,
    falling_from_a_shaken_hand,
    friction_at,
    given_sizes,
    hanging,
    pull_off,
    sized_caps,
    sizes,
    twisted_contact,
)
from scenes_rest import lingering_step, lost_grain, settled_layer, shot_grain
from scenes_step import damped_steps, largest_stable_step


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
        for partner in ("grain", "facet", "wall"):
            yield bent_contact, (partner, 0.2, 1.0, "epsd2", ratio)
        yield from ((rocking, (kind, ratio)) for kind in ("facet", "wall"))
    for kind in ("facet", "wall"):
        yield from ((rolling, (kind, 0.3, 0.1, ratio)) for ratio in (1.0, 16.0))
    yield from ((time_steps, (ratio,)) for ratio in (0.5, 1.0, 4.0, 16.0))
    for ratio in (0.5, 1.0, 16.0):
        yield from (
            (bent_contact, (partner, 0.2, 1.0, "epsd2", ratio))
            for partner in ("grain", "facet", "wall")
        )
        yield from ((rocking, (kind, ratio)) for kind in ("facet", "wall"))
    yield from (
        (rolling, (kind, 0.3, 0.1, ratio)) for kind in ("facet", "wall") for ratio in (1.0, 16.0)
    )
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
    yield unled_dispatch, ()
    yield from ((clump, (aspect,)) for aspect in (1.3, 2.0))
    yield clump_rebound, ()
    yield clump_fall, (0.01,)
    yield sizes, (0.25,)
    yield settled_layer, ()
    yield from ((lost_grain, (speed,)) for speed in (0.0, 0.1))
    yield from (*steps_of_damped_grains(), *walls_that_turn())


def steps_of_damped_grains():
    """Those on the time step."""
    yield shot_grain, ()
    for mode in ("normal", "spin"):
        yield from ((largest_stable_step, (mode, e)) for e in (0.3, 0.5, 0.9))
    yield damped_steps, ()


def walls_that_turn():
    """Those on a drum, and of grains of given sizes."""
    yield given_sizes, ("0.8:1|1.0:2|1.4:1",)
    yield from ((on_a_turning_shell, pair) for pair in ((0.6, 0.0), (0.6, 0.2), (0.2, 0.6)))
    yield from ((on_a_turning_face, (how,)) for how in ("stuck", "rolling", "slipping"))


def main():
    """Run everything; the record is {"experiment argument argument": {quantity: number}}."""
    record = {}
    for experiment, arguments in experiments():
        record[" ".join([experiment.__name__, *map(str, arguments)])] = experiment(*arguments)
    with open(os.environ["CONTACT_LAW_RECORD"], "w") as stream:
        json.dump(record, stream, indent=1, allow_nan=False)


main()
