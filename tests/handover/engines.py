"""Exported files in LIGGGHTS and LAMMPS: two grains, one grain on a floor, and a heap.

A file is included as it was written. What is around it are the commands that its head asks for, and
for the heap the vessel and the stages of benchmarks/runs/rolling_engines.py.
"""

import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from benchmarks.runs import rolling_engines
from benchmarks.runs.dem import core_seconds
from benchmarks.runs.liggghts_hourglass import GRAINS, read_centres
from benchmarks.runs.rolling_grains import cloud, write_grains
from benchmarks.runs.rolling_scans import passed, responses
from calibrator.handover import contact, lammps, liggghts

TEXT = {"liggghts": liggghts.text, "lammps": lammps.text}
OWN = Path(__file__).resolve().parents[2] / ".venv-lammps" / "bin"  # what `make lammps` makes
OLDEST = 2022  # year of LAMMPS: that of 2021 does not know damping coeff_restitution
COMMAND = {
    "liggghts": shutil.which("liggghts"),
    "lammps": shutil.which("lmp", path=OWN) or shutil.which("lmp"),
}
# commands up to the one that makes the box, from inputs that are known to run
BEFORE = {
    "liggghts": GRAINS.split("soft_particles")[0],
    "lammps": rolling_engines.LAMMPS.split("pair_style")[0],
}
FLOOR = {
    "liggghts": "fix base all wall/gran ${law} primitive type ${wall} zplane 0.0",
    "lammps": "fix base all wall/gran granular ${wall_law} zplane 0.0 NULL",
}
LOG = """
group last id {n}
compute spins all property/atom omegay
compute spin last reduce sum c_spins
variable s equal step
variable w equal c_spin
variable u equal vx[{n}]
variable v1 equal vz[1]
variable vn equal vz[{n}]
variable h equal z[{n}]
fix log all print 1 "${{s}} ${{w}} ${{u}} ${{v1}} ${{vn}} ${{h}}" file grain.txt screen no
run {steps}
"""
NAMES = ("step", "spin", "velocity", "rise_1", "rise", "height")


def needs(engine):
    """A mark that skips a test where an engine is not installed, or too old, with the command.

    `make test` installs both; LIGGGHTS takes root.
    """
    remedy = {"liggghts": "run `make liggghts` as root or with sudo", "lammps": "run `make lammps`"}
    lacks = COMMAND[engine] is None or (engine == "lammps" and lammps_year() < OLDEST)
    return pytest.mark.skipif(lacks, reason=f"{engine} not installed, or too old: {remedy[engine]}")


def lammps_year():
    """Year of the release that says what it is."""
    said = subprocess.run([COMMAND["lammps"], "-h"], capture_output=True, text=True).stdout
    year = re.search(r"Simulator - \d+ \w+ (\d{4})", said)
    return int(year[1]) if year else 0


def each_engine(function):
    """Run a test for each engine that is there."""
    cases = [pytest.param(name, marks=needs(name)) for name in TEXT]
    return pytest.mark.parametrize("engine", cases)(function)


def include(engine, chosen, folder, side="f"):
    """Write the exported file; the commands up to and with its inclusion; side : of the box."""
    (folder / f"sand.{engine}").write_text(TEXT[engine](chosen))
    before = BEFORE[engine].format(side=side, skin=0.4 * chosen.numbers["particle_radius"])
    return f"{before}\ninclude sand.{engine}\n"


def follow(engine, chosen, folder, centres, velocities, spins, steps, dt, more=""):
    """What happens to grains at these centres [m] (n, 3), step by step: arrays by name, and time.

    spins : about y [rad/s], of each grain.
    """
    wide = [(-0.1, 0.1)] * 3
    p = {**chosen.numbers, "seed": 1}
    write_grains(folder, p, np.array(centres), np.array(velocities), wide, engine == "lammps")
    path = folder / "grains.lmp"
    head, _, rows = path.read_text().partition("Velocities\n\n")
    turned = [
        f"{' '.join(row.split()[:4])} 0 {w:.10g} 0"
        for row, w in zip(rows.splitlines(), spins, strict=True)
    ]
    path.write_text(head + "Velocities\n\n" + "\n".join(turned) + "\n")
    text = include(engine, chosen, folder) + f"timestep {dt:.10g}\nfix move all nve/sphere\n{more}"
    (folder / "in.run").write_text(text + LOG.format(n=len(centres), steps=steps))
    core_seconds([COMMAND[engine], "-in", "in.run"], folder)
    found = dict(zip(NAMES, np.loadtxt(folder / "grain.txt").T, strict=True))
    return {**found, "time": found["step"] * dt}


def timestep(text):
    """The step [s] that a file asks for."""
    (line,) = (line for line in text.splitlines() if line.startswith("timestep"))
    return float(line.split()[1])


def bulk(engine, setup, chosen, p, folder):
    """Status and responses of a run with the exported contact law; p : the set-up's parameters.

    LAMMPS has the heap only.
    """
    p = {**p, **chosen.values}
    centres, velocities = cloud(setup, p)
    top, dt = float(centres[:, 2].max()), timestep(TEXT[engine](chosen))
    walls, release, stop, box = own_walls(engine, setup, p, folder, dt, top)
    every = max(1, round(p["sampling_interval"] / dt))
    text = include(engine, chosen, folder, "p" if setup == "ledge" else "f")
    text += f"fix g all gravity 9.81 vector 0.0 0.0 -1.0\n{walls}\nfix move all nve/sphere\n"
    release = release.format(every=every)
    text += rolling_engines.stages(setup, p, dt, top, release, stop, engine == "lammps")
    write_grains(folder, p, centres, velocities, box, engine == "lammps")
    (folder / "in.run").write_text(text)
    seconds = core_seconds([COMMAND[engine], "-in", "in.run"], folder)
    filled, final = (read_centres(folder / f"{name}.dump") for name in ("filled", "final"))
    assert len(filled) == len(centres), "grains were lost"
    left = np.loadtxt(folder / "left.txt", skiprows=1) if setup == "hourglass" else None
    curve = None if left is None else passed(left, dt, p, len(filled))
    status, found = responses(setup, p, filled, final, curve)
    return status, {**found, "core_seconds": seconds}


def own_walls(engine, setup, p, folder, dt, top):
    """Walls, release, what follows it, and the box, of the benchmark, with the file's own law."""
    if engine == "lammps":
        assert setup == "conical_pile"
        _, walls, release, box = rolling_engines.lammps_walls("LAMMPS", p, 1.0, dt, top)
        walls, stop = walls.replace(law_at_walls(walls), "${wall_law}"), ""
        assert walls.count("${wall_law}") == 2
        return walls, release, stop, box
    walls, release, stop, box = rolling_engines.liggghts_walls(setup, p, folder, top)
    walls, release = (
        text.replace(rolling_engines.LAW, law).replace("type 2", f"type {wall}")
        for text, law, wall in (
            (walls, "${law}", "${wall}"),
            (release, "${{law}}", "${{wall}}"),  # which is formatted once more
        )
    )
    assert "${law}" in walls and "rolling_friction" not in walls + release
    return walls, release, stop, box


def law_at_walls(walls):
    """The contact law of the benchmark's floor."""
    line = walls.splitlines()[0]
    return line.removeprefix("fix wb all wall/gran granular ").removesuffix(" zplane 0.0 NULL")


def period_of(times, spin):
    """Period [s] of an oscillation that begins with a positive spin."""
    i = np.flatnonzero(np.diff(np.sign(spin)) != 0)[:7]
    zeros = times[i] + (times[i + 1] - times[i]) * spin[i] / (spin[i] - spin[i + 1])
    return 2 * float(np.diff(zeros).mean())


def inertia(p):
    """Of a grain [kg m2]."""
    return 0.4 * contact.grain_mass(p) * p["particle_radius"] ** 2


def spring_period(p, rolling_stiffness):
    """Period [s] of two held grains that turn against each other on a rolling spring [N m/rad].

    Each turns by theta, the spring by 2 theta: I theta'' = -2 k theta.
    """
    return 2 * math.pi * math.sqrt(inertia(p) / (2 * rolling_stiffness))
