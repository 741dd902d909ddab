"""One run of an experiment in LIGGGHTS, with what is hidden in it, measured by the project's code.

Geometry, cloud and stages are those of benchmarks/runs/rolling_engines.py. What is added here:

- adhesion by LIGGGHTS' own model sjkr2, a force k 4 pi R_eff delta between grains and k 2 pi R
  delta at a wall, with delta the overlap: no force before contact, and a pull that grows with the
  load, where YADE's is constant (see `cohesion_energy_density`);
- grains of several sizes, each pair with its own rolling cap and stiffness;
- a tilted gravity, friction at walls, the true neck, and vibration, as yade_scripts/effects.py;
- rolling resistance of the older model epsd, with its dashpot, where a rolling viscosity is given.
"""

import math
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.runs.dem import core_seconds
from benchmarks.runs.liggghts_hourglass import GRAINS
from benchmarks.runs.rolling_engines import LAW, liggghts_walls, stages
from benchmarks.runs.rolling_grains import cloud, size_classes, write_grains
from benchmarks.runs.rolling_scans import grain_mass, mass_of, responses
from calibrator.case.physics import GRAVITY, rayleigh_time
from calibrator.case.vocabulary import parameters_of
from calibrator.runs.request import Request

LOAD = 5.0  # grain weights under which a contact's pull is the Bond number
STEP = 0.2  # of the Rayleigh time of the smallest grains
# Cohesive grains keep spinning about their contacts, which nothing resists (as many at a quarter of
# the step), and so shake a bed a little for ever: after so long [s] a mean kinetic energy [J] up to
# this one, 5e-5 of m g d and a tenth of where a filling counts as settled, is rest as well.
PATIENCE, SPINNING = 1.5, 1e-11
HEAD = (
    GRAINS
    + """{pairs}
pair_style gran {law}
pair_coeff * *
timestep {dt:.10g}
fix g all gravity 9.81 vector {gx:.10g} 0.0 {gz:.10g}
{walls}
fix i all nve/sphere
"""
)
SHAKEN = """
variable began equal {began}
variable swing atom {peak:.10g}*mass*sin({omega:.10g}*(step-v_began)*{dt:.10g})
fix shake all addforce v_swing 0 0
"""


@dataclass(frozen=True)
class Outcome:
    """What became of a run: status "ok" or a kind of failure with its reason, and what it gave."""

    status: str
    reason: str
    responses: dict[str, float]
    steps: int
    core_seconds: float


def cohesion_energy_density(p: dict) -> tuple[float, float]:
    """sjkr2's k [J/m3] between grains and at a wall, by the pull in a contact under some load.

    The force in a contact is (4/3) E* sqrt(R) delta^1.5 - k c R delta, with c = 4 pi between grains
    and 2 pi at a wall, and R = R_eff. Here k c R delta is Bo m g between grains, and twice that at
    a wall, where R_eff is twice as large, at the overlap that Hertz has for five grain weights: the
    load at which yade_scripts/material.py takes the rolling stiffness. Under one weight the pull
    then is 0.34 Bo m g, and the force that parts two grains, (c k)^3 R^2/(12 E*^2), is 0.6 % of m g
    at Bo = 1 with the case's stiffness and goes with Bo^3. By that force, Bo = 0.3 would be k such
    that grains under load hold each other with four weights, and no hourglass would flow.
    """
    e_star = p["young_modulus"] / (2 * (1 - p["poisson_ratio"] ** 2))
    weight, r = grain_mass(p) * GRAVITY, p["particle_radius"]

    def strength(bond, factor, effective_radius):
        overlap = (LOAD * weight / (4 / 3 * e_star * math.sqrt(effective_radius))) ** (2 / 3)
        return bond * weight / (factor * effective_radius * overlap)

    bond = p.get("bond_number", 0.0)
    return strength(bond, 4 * math.pi, r / 2), strength(2 * bond, 2 * math.pi, r)


def law(p: dict, rolling_viscosity: float) -> str:
    """Contact model of the grains and of the walls."""
    rolling = "epsd" if rolling_viscosity else "epsd2"
    cohesion = "cohesion sjkr2 " if p.get("bond_number", 0.0) else ""
    return f"model hertz tangential history {cohesion}rolling_friction {rolling}"


def pairs(p: dict, rolling_viscosity: float) -> str:
    """Properties of pairs of materials; grains are of type 1, walls of type 2."""
    mu, e, rolling = p["sliding_friction"], p["restitution"], p["rolling_friction"]
    values = {
        "coefficientRestitution": (e, e),
        "coefficientFriction": (mu, mu * p.get("wall_friction_ratio", 1.0)),
        "coefficientRollingFriction": (rolling, rolling),
    }
    if rolling_viscosity:
        values["coefficientRollingViscousDamping"] = (rolling_viscosity, rolling_viscosity)
    if p.get("bond_number", 0.0):
        values["cohesionEnergyDensity"] = cohesion_energy_density(p)
    return "\n".join(
        f"fix p{i} all property/global {name} peratomtypepair 2 {a:.10g} {b:.10g} {b:.10g} {b:.10g}"
        for i, (name, (a, b)) in enumerate(values.items())
    )


def step_of(p: dict) -> float:
    """Time step [s]."""
    smallest = {**p, "particle_radius": float(size_classes(p).min())}
    numbers = {n: np.array(v) for n, v in smallest.items() if not isinstance(v, str)}
    return STEP * float(rayleigh_time(numbers))


def head(p: dict, rolling_viscosity: float, dt: float, side: str, walls: str) -> str:
    """LIGGGHTS' commands up to the first step; side is "p" where y is periodic, else "f"."""
    lean = math.radians(p.get("tilt_deg", 0.0))
    return HEAD.format(
        side=side, skin=0.4 * p["particle_radius"], young=p["young_modulus"], dt=dt,
        poisson=p["poisson_ratio"], pairs=pairs(p, rolling_viscosity), walls=walls,
        law=law(p, rolling_viscosity), gx=math.sin(lean), gz=-math.cos(lean),
    )  # fmt: skip


def shaken(p: dict, dt: float, began: str) -> str:
    """Commands that begin a vibration along x at a step: gravity swings, the same seen inside."""
    omega = 2 * math.pi * p["shaking_frequency"]
    return SHAKEN.format(began=began, peak=p["shaking"] * GRAVITY, omega=omega, dt=dt)


def script(
    setup: str, p: dict, rolling_viscosity: float, folder: Path, top: float
) -> tuple[str, list]:
    """The whole input, and the box; writes the meshes of the vessel."""
    dt = step_of(p)
    vessel = {**p, "neck_diameter": p.get("neck_diameter", 0.0) + p.get("neck_error", 0.0)}
    walls, release, stop, box = liggghts_walls(setup, vessel, folder, top)
    own = law(p, rolling_viscosity)
    walls, release = walls.replace(LAW, own), release.replace(LAW, own)
    # grains of several sizes: the mass above the neck and not their number is what is weighed
    release = release.replace("count(all,above)", "mass(all,above)")
    release = release.format(every=max(1, round(p["sampling_interval"] / dt)))
    if p.get("shaking", 0.0):
        release += shaken(p, dt, "$s")
        stop += f"\nrun {int(p['shaking_time'] / dt)}\nunfix shake"
    text = head(p, rolling_viscosity, dt, "p" if setup == "ledge" else "f", walls)
    text += stages(setup, p, dt, top, release, stop, False)
    text = text.replace(
        "last equal $s+" + str(int(3.0 / dt)), f"last equal $s+{int(PATIENCE / dt)}"
    )
    return text.replace("id x y z", "id x y z radius"), box


def read_grains(path: Path) -> np.ndarray:
    """Rows of x, y, z and radius (n, 4) [m] of a dump."""
    return np.loadtxt(path, skiprows=9, ndmin=2)[:, 1:5]


def weighed(left: np.ndarray, dt: float, total: float) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] since the release and masses [kg] passed, from rows of step and mass left."""
    rows = left[np.concatenate([[True], np.diff(left[:, 0]) > 0])]
    return (rows[:, 0] - rows[0, 0]) * dt, np.maximum(total - rows[:, 1], 0.0)


def run(request: Request, rolling_viscosity: float, folder: Path) -> Outcome:
    """One run in a folder of its own, which is emptied first."""
    setup, p = request.setup, {n: request.value(n) for n in parameters_of(request.setup)}
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    centres, velocities = cloud(setup, p)
    text, box = script(setup, p, rolling_viscosity, folder, float(centres[:, 2].max()))
    write_grains(folder, p, centres, velocities, box, False)
    (folder / "in.run").write_text(text)
    try:
        seconds = core_seconds(["liggghts", "-in", "in.run"], folder)
    except RuntimeError as error:
        return Outcome("crash", " ".join(str(error).split())[-200:].replace(",", ";"), {}, 0, 0.0)
    output = (folder / "output.txt").read_text(errors="replace")
    (steps, energy) = [x.split()[1:] for x in output.splitlines() if x.startswith("RESTED")][-1]
    filled, final = (read_grains(folder / f"{name}.dump") for name in ("filled", "final"))
    status, found, reason = "ok", {}, ""
    if len(filled) < len(centres) or (setup == "conical_pile" and len(final) < len(filled)):
        status, reason = "lost", f"{len(centres) - len(filled)} grains lost in the filling"
    elif not float(energy) <= SPINNING:
        status, reason = "not_settled", f"a mean kinetic energy of {float(energy):.2g} J is left"
    else:
        left = np.loadtxt(folder / "left.txt", skiprows=1) if setup == "hourglass" else None
        curve = None if left is None else weighed(left, step_of(p), mass_of(p, filled))
        status, found = responses(setup, p, filled, final, curve)
        reason = "grains are left above the open neck" if status == "clogged" else ""
    return Outcome(status, reason, found, int(steps), seconds)


def version() -> str:
    """What LIGGGHTS says that it is."""
    with tempfile.TemporaryDirectory() as folder:  # it leaves a log where it is called
        command = ["liggghts", "-h"]
        said = subprocess.run(command, capture_output=True, text=True, cwd=folder).stdout
    return said.splitlines()[0].partition("(")[2].partition(",")[0] if said else "unknown"
