"""The conical pile of the project with an exported material instead of its own contact law.

By hand:  EXPORTED=folder MODULE=sand_yade YADE_BATCH=t.table:2 yade -n -x -j1 scene_heap.py
"""

import os
import sys

# The script's path is in argv: inside YADE __file__ is YADE's own.
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))
sys.path.insert(0, os.path.join(sys.path[0], "..", "..", "yade_scripts"))
sys.path.insert(0, os.environ["EXPORTED"])

import grains
import quiet
import session
from yade import O

SCRIPTS = sys.path[1]
sand = __import__(os.environ["MODULE"])


def start(p):
    """What session.start does, by the exported module alone."""
    quiet.silence_log()
    grains.forget()
    O.dt, O.engines = sand.time_step(sand.P), sand.engines()
    return sand.add_materials()


session.start = start
with open(os.path.join(SCRIPTS, "conical_pile.py")) as stream:
    exec(compile(stream.read(), "conical_pile.py", "exec"))
