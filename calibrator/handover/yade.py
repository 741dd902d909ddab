"""The material as a Python file for YADE.

Its contact law is copied word for word from yade_scripts/material.py, effects from
yade_scripts/effects.py; only the few lines that put them into a scene are written here.
"""

from __future__ import annotations

import json

from calibrator.case.vocabulary import SCRIPTS
from calibrator.handover.chosen import Chosen
from calibrator.handover.source import copied
from calibrator.handover.wording import head

LAW = ("materials", "contact_functors", "dispatch", "time_step")
AT_START = {
    "bond_number": "adhesion",
    "wall_friction_ratio": "wall_friction",
    "twisting_stiffness": "twisting",
    "size_spread": "rolling_of_several_sizes",
    "size_distribution": "rolling_of_several_sizes",
}
"""Functions of effects.py that set contacts, by the column that switches them on."""

USE = """
In a scene of your own, with this file beside the script or its text pasted above it:

    import sys; sys.path.insert(0, ".")  # YADE does not look where it was started
    import {stem}_yade as sand

    grain, wall = sand.add_materials()
    O.bodies.append(utils.sphere((0, 0, 0.01), sand.P["particle_radius"], material=grain))
    O.bodies.append(utils.wall(0, axis=2, sense=1, material=wall))
    O.engines = sand.engines(gravity=(0, 0, -9.81))
    O.dt = sand.time_step(sand.P)

Grains must have the one material, walls and facets the other: their rolling caps differ. Call
engines() once more after O.load, which loses the two functors.
"""

IMPORTS = """import contextlib
import math

from yade import (
    Bo1_Facet_Aabb,
    Bo1_Sphere_Aabb,
    Bo1_Wall_Aabb,
    ForceResetter,
    FrictMat,
    FrictMatCDM,
    Ig2_Facet_Sphere_ScGeom,
    Ig2_Sphere_Sphere_ScGeom,
    Ig2_Wall_Sphere_ScGeom,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_FrictMat_FrictMat_MindlinPhys,
    IPhysFunctor,
    Law2_ScGeom_MindlinPhys_Mindlin,
    NewtonIntegrator,
    O,
)
"""

SCENE = '''

# ---- how it gets into a scene


def add_materials():
    """Add the grains' and the walls' material to the scene; returns both."""
    grain, wall = materials(P)
    O.materials.append(grain)
    O.materials.append(wall)
    return grain, wall


def contact_loop():
    """The InteractionLoop in which mu_r, mu_s, e and E mean what the calibration means by them."""
    between_grains, at_walls = contact_functors(P)
{effects}    loop = InteractionLoop(
        [
            Ig2_Sphere_Sphere_ScGeom(),
            Ig2_Facet_Sphere_ScGeom(hertzian=True),
            Ig2_Wall_Sphere_ScGeom(hertzian=True),
        ],
        [between_grains],
        [Law2_ScGeom_MindlinPhys_Mindlin(includeMoment=True, includeAdhesion=True)],
    )
    dispatch(loop.physDispatcher, between_grains, at_walls)
    return loop


def engines(gravity=(0, 0, -GRAVITY)):
    """The whole loop of the calibration: no numerical damping, which YADE has by default."""
    collider = InsertionSortCollider(
        [Bo1_Sphere_Aabb(), Bo1_Facet_Aabb(), Bo1_Wall_Aabb()],
        verletDist=0.2 * P["particle_radius"],
    )
    integrator = NewtonIntegrator(damping=0, gravity=gravity)
    return [ForceResetter(), collider, contact_loop(), integrator]
'''


def text(chosen: Chosen) -> str:
    """The file."""
    doc = "\n".join(head(chosen, "yade", USE.format(stem=chosen.stem).splitlines()))
    doc = doc.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    rows = "\n".join(f"    {json.dumps(n)}: {v!r}," for n, v in chosen.values.items())
    on = [AT_START[name] for name in chosen.effects if name in AT_START]
    calls = "".join(f"    {name}(P, between_grains, at_walls, None)\n" for name in on)
    return "".join(
        [
            f'"""{doc.rstrip()}\n"""\n\n',
            IMPORTS,
            f"\nP = {{\n{rows}\n}}\n",
            "\n# ---- copied from dem-calibrator (GPL-3.0-or-later): yade_scripts/material.py\n",
            _law(on),
            SCENE.replace("{effects}", calls),
        ]
    )


def _law(effects: list[str]) -> str:
    """Material and effects in one name space."""
    law = copied(SCRIPTS / "material.py", (*LAW, "stiff_rolling_spring", "size_shares"))
    if not effects:
        return law
    more = copied(SCRIPTS / "effects.py", effects).replace("material.", "")
    return (
        f"{law}\n\n# ---- yade_scripts/effects.py: what the calibration has switched on\n\n\n{more}"
    )
