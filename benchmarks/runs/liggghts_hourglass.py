"""The hourglass in LIGGGHTS, done the plain way: an oracle for cost and physics.

It is never a dependency. Loose cloud, settle to the rest threshold, open, settle to the rest
threshold. Same grains (the same seeded cloud), same vessel, same contact law (Hertz-Mindlin,
elastic-plastic rolling resistance epsd2), a step of 20 % of the Rayleigh time.
"""

import math
import re
import sys
from pathlib import Path

import numpy as np

from benchmarks.runs.dem import core_seconds
from calibrator.case.physics import rayleigh_time
from calibrator.case.vocabulary import SCRIPTS
from calibrator.runs.request import Request

# both are plain numpy: LIGGGHTS gets the same cloud and the same scan
sys.path.append(str(SCRIPTS))
import measure
import packing

WALLS = "all wall/gran model hertz tangential history rolling_friction epsd2"
# what every input begins with, y being periodic (side p) or not (f); grains and walls are alike
GRAINS = """
atom_style granular
atom_modify map array
boundary f {side} f
newton off
communicate single vel yes
units si
read_data grains.lmp
neighbor {skin:.6g} bin
neigh_modify delay 0
soft_particles yes
fix m1 all property/global youngsModulus peratomtype {young:.10g} {young:.10g}
fix m2 all property/global poissonsRatio peratomtype {poisson:.10g} {poisson:.10g}
"""
MATERIAL = """fix m3 all property/global coefficientRestitution peratomtypepair 2 {e} {e} {e} {e}
fix m4 all property/global coefficientFriction peratomtypepair 2 {mu} {mu} {mu} {mu}
fix m5 all property/global coefficientRollingFriction peratomtypepair 2 {mur} {mur} {mur} {mur}
"""
INPUT = (
    GRAINS
    + MATERIAL
    + """pair_style gran model hertz tangential history rolling_friction epsd2
pair_coeff * *
timestep {dt:.10g}
fix g all gravity 9.81 vector 0.0 0.0 -1.0
fix bottom all mesh/surface file annulus.stl type 2
fix plug all mesh/surface file disk.stl type 2
fix wm {walls} mesh n_meshes 2 meshes bottom plug
fix wc {walls} primitive type 2 zcylinder {cylinder:.10g} 0.0 0.0
fix i all nve/sphere
compute ke all ke update_on_run_end yes
variable mean equal c_ke/(atoms+1e-30)
thermo_style custom step atoms ke
thermo 100000
thermo_modify lost ignore norm no
run {fall}
label settle
run {every} post no
if "${{mean}} > {rest}" then "jump SELF settle"
variable s equal step
print "FILLED ${{s}}"
write_dump all custom filled.dump id x y z
unfix wm
unfix plug
fix wo {walls} mesh n_meshes 1 meshes bottom
run {open}
label rest
run {every} post no
if "${{mean}} > {rest}" then "jump SELF rest"
print "RESTED ${{s}}"
write_dump all custom final.dump id x y z
"""
)


def write_facets(path: Path, triangles: list) -> None:
    """ASCII STL."""
    lines = ["solid s"]
    for a, b, c in triangles:
        lines += [
            "facet normal 0 0 1",
            "outer loop",
            *(f"vertex {v[0]:.9g} {v[1]:.9g} {v[2]:.9g}" for v in (a, b, c)),
        ]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid s"]) + "\n")


def cloud(p: dict, mass: float) -> tuple[np.ndarray, np.ndarray]:
    """Centres and velocities (n, 3) from which yade_scripts/hourglass.py would start.

    The random numbers are the same.
    """
    rng = np.random.default_rng(p["seed"])
    centres = packing.cloud_in_cylinder(p, round(p["fill_mass"] / mass), p["particle_radius"], rng)
    random_speed = 0.5 * (9.81 * 2 * p["particle_radius"]) ** 0.5
    return centres, rng.normal(0, random_speed, centres.shape) - (0, 0, p["pouring_velocity"])


def write_inputs(
    folder: Path, p: dict, centres: np.ndarray, velocities: np.ndarray, dt: float
) -> None:
    """Everything that LIGGGHTS reads, for parameters p under the project's names."""
    cylinder, neck, radius = (
        p["cylinder_diameter"] / 2,
        p["neck_diameter"] / 2,
        p["particle_radius"],
    )
    inner, outer = packing.ring(neck, 0.0), packing.ring(cylinder * 1.05, 0.0)
    flat = [
        t
        for i in range(32)
        for t in ((inner[i - 1], inner[i], outer[i]), (inner[i - 1], outer[i], outer[i - 1]))
    ]
    write_facets(folder / "annulus.stl", flat)
    write_facets(folder / "disk.stl", [((0, 0, 0), inner[i - 1], inner[i]) for i in range(32)])
    half, top = cylinder * 1.2, centres[:, 2].max() + 20 * radius
    grain = f"{2 * radius:.10g} {p['particle_density']:.10g}"
    rows = [f"{i} 1 {grain} {x:.10g} {y:.10g} {z:.10g}" for i, (x, y, z) in enumerate(centres, 1)]
    speeds = [f"{i} {u:.10g} {v:.10g} {w:.10g} 0 0 0" for i, (u, v, w) in enumerate(velocities, 1)]
    sides = f"{-half} {half} xlo xhi\n{-half} {half} ylo yhi\n{-4 * radius} {top} zlo zhi\n"
    head = f"grains\n\n{len(centres)} atoms\n2 atom types\n{sides}"
    (folder / "grains.lmp").write_text(
        "\n".join([head, "Atoms\n", *rows, "", "Velocities\n", *speeds]) + "\n"
    )
    (folder / "in.hourglass").write_text(
        INPUT.format(
            side="f",
            walls=WALLS,
            skin=0.4 * radius,
            young=p["young_modulus"],
            poisson=p["poisson_ratio"],
            e=p["restitution"],
            mu=p["sliding_friction"],
            mur=p["rolling_friction"],
            dt=dt,
            cylinder=cylinder,
            fall=int(0.05 / dt),
            open=int(math.sqrt(2 * p["neck_diameter"] / 9.81) / dt),
            every=max(1, int(p["sampling_interval"] / dt)),
            rest=p["rest_kinetic_energy"],
        )
    )


def particle_steps(output: str) -> float:
    """Sum over the steps of the grains in the scene, from the log's lines "step atoms energy"."""
    rows = np.array(re.findall(r"^ +(\d+) +(\d+) +\S+ *$", output, re.MULTILINE), float)
    rows = rows[np.concatenate([[True], np.diff(rows[:, 0]) > 0])]
    return float(np.trapezoid(rows[:, 1], rows[:, 0]))


def read_centres(path: Path) -> np.ndarray:
    """Positions (n, 3) of a dump, by id."""
    rows = np.loadtxt(path, skiprows=9)
    return rows[np.argsort(rows[:, 0])][:, 1:4]


def responses(p: dict, mass: float, filled: np.ndarray, final: np.ndarray) -> dict:
    """Density, residual fraction and equivalent angle, scanned as in yade_scripts/hourglass.py."""
    radius, cylinder, neck = (
        p["particle_radius"],
        p["cylinder_diameter"] / 2,
        p["neck_diameter"] / 2,
    )
    x, y, height = measure.height_map(filled, radius, cylinder, cylinder)
    section = np.hypot(x[:, None], y[None, :]) < cylinder
    share = np.pi * cylinder**2 / (section.sum() * (x[1] - x[0]) * (y[1] - y[0]))
    density = len(filled) * mass / (measure.filled_volume(x, y, height, section) * share)
    return {
        "bulk_density": density,
        "residual_fraction": len(final) / len(filled),
        "drained_equivalent_angle_deg": measure.crater_angle_from_volume(
            len(final) * mass / density, cylinder, neck
        ),
    }


def run_liggghts(folder: Path, parameters: dict) -> dict:
    """One hourglass in LIGGGHTS: core-seconds, steps, particle-steps and responses.

    Raises RuntimeError where it fails.
    """
    p = Request.of("hourglass", **parameters).parameters
    mass = 4 / 3 * math.pi * p["particle_radius"] ** 3 * p["particle_density"]
    folder.mkdir(parents=True, exist_ok=True)
    dt = 0.2 * float(
        rayleigh_time({n: np.array(v) for n, v in p.items() if not isinstance(v, str)})
    )
    write_inputs(folder, p, *cloud(p, mass), dt)
    seconds = core_seconds(["liggghts", "-in", "in.hourglass"], folder)
    output = (folder / "output.txt").read_text(errors="replace")
    steps = {
        word: int(re.search(rf"^{word} (\d+)", output, re.MULTILINE).group(1))
        for word in ("FILLED", "RESTED")
    }
    return {
        "core_seconds": seconds,
        "filling_steps": steps["FILLED"],
        "steps": steps["RESTED"],
        "particle_steps": particle_steps(output),
        "responses": responses(
            p, mass, read_centres(folder / "filled.dump"), read_centres(folder / "final.dump")
        ),
    }
