"""The rotating drum in YADE and in LIGGGHTS, at two speeds: is its surface the same?

    python -m benchmarks.runs.drum_engines yade [N]  YADE's runs, N at a time: two hours of a core
    python -m benchmarks.runs.drum_engines liggghts  LIGGGHTS', an hour of a core
    python -m benchmarks.runs.drum_engines judge     compares what there is; the others resume
    python -m benchmarks.runs.drum_engines tiny      one small drum in both, minutes; writes nothing

They write grid/drum.csv, grid/drum_engines.csv and benchmarks/results/drum_engines.json. Both begin
with the same cloud of the same seed. YADE's rolling spring is set to that of LIGGGHTS' epsd2 under
five grain weights (rolling_stiffness_ratio = 1). LIGGGHTS' shell and faces are meshes, which its
fix move/mesh turns; its grains are dumped as often as YADE's script looks at them, and measured by
the functions that it uses, over as many turns after as many others: whether they are steady by then
is judged by the script's own rule, and reported.
"""

import csv
import math
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.common import rounded, write
from benchmarks.runs.dem import core_seconds
from benchmarks.runs.liggghts_hourglass import GRAINS, write_facets
from benchmarks.runs.rolling_engines import LAW
from benchmarks.runs.rolling_grains import grains_for, size_classes, tube, write_grains
from calibrator.case.physics import GRAVITY, rayleigh_time
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

import camera  # isort: skip  (benchmarks.runs.liggghts_hourglass put the scripts on the path)
import measure  # isort: skip
import packing  # isort: skip

REPO = Path(__file__).resolve().parents[2]
FOLDER = RunFolder(REPO / "results" / "drum_engines")
SHIPPED, ENGINE = REPO / "grid" / "drum.csv", REPO / "grid" / "drum_engines.csv"
COMMAND = "python -m benchmarks.runs.drum_engines"
SPEEDS = (30.0, 75.0)  # [rpm]: Froude numbers of 0.02 and 0.13
PAIRS = ((0.05, 0.3), (0.3, 0.6))  # rolling and sliding friction
SEEDS = (860_001, 860_002, 860_003)
DRUM = dict(
    drum_diameter=40e-3, drum_depth=10e-3, young_modulus=1e6, restitution=0.7,
    rolling_stiffness_ratio=1.0, longest_time=20.0, measuring_turns=3,
)  # fmt: skip
TINY = dict(
    drum_diameter=24e-3, drum_depth=7e-3, young_modulus=2.5e5, restitution=0.7, rotation_rpm=90.0,
    rolling_stiffness_ratio=1.0, sliding_friction=0.5, rolling_friction=0.1, seed=3,
)  # fmt: skip
COMPARED = (
    "drum_angle_deg", "drum_central_angle_deg", "drum_upper_angle_deg", "drum_lower_angle_deg",
    "drum_height_centre", "drum_filled_share", "drum_blur", "drum_layer_thickness",
)  # fmt: skip
COLUMNS = ("rotation_rpm", "rolling_friction", "sliding_friction", "seed", "drift_deg", "error_deg")
BLOCKS = 4  # of a turn: yade_scripts/rotating_drum.py
INPUT = (
    GRAINS
    + """fix m3 all property/global coefficientRestitution peratomtypepair 2 {e} {e} {e} {e}
fix m4 all property/global coefficientFriction peratomtypepair 2 {mu} {mu} {mu} {mu}
fix m5 all property/global coefficientRollingFriction peratomtypepair 2 {mur} {mur} {mur} {mur}
pair_style gran {law}
pair_coeff * *
timestep {dt:.10g}
fix g all gravity 9.81 vector 0.0 0.0 -1.0
fix shell all mesh/surface file shell.stl type 2
fix faces all mesh/surface file faces.stl type 2
fix w all wall/gran {law} mesh n_meshes 2 meshes shell faces
fix i all nve/sphere
thermo_style custom step atoms ke
thermo 100000
thermo_modify lost ignore norm no
run {settle}
fix t1 all move/mesh mesh shell rotate {turn}
fix t2 all move/mesh mesh faces rotate {turn}
run {first}
dump d all custom {every} film.dump x z radius vx vz
run {turns}
"""
)


def requests() -> Iterator[Request]:
    """YADE's runs."""
    for pair in PAIRS:
        for speed in SPEEDS:
            for seed in SEEDS:
                yield Request.of(
                    "rotating_drum", **DRUM, rotation_rpm=speed, seed=seed,
                    rolling_friction=pair[0], sliding_friction=pair[1],
                )  # fmt: skip


def sides(p: dict) -> int:
    """Sides of the shell's polygon, as in yade_scripts/rotating_drum.py."""
    deepest = 2 * p["particle_radius"] * 0.005 / (p["drum_diameter"] / 2)
    return max(packing.SEGMENTS, math.ceil(math.pi / math.acos(1 - deepest)))


def shell(p: dict) -> list:
    """Triangles of the shell, cut so that none is too thin for LIGGGHTS; the axis is at z = R."""
    radius, n = p["drum_diameter"] / 2, sides(p)
    half = p["drum_depth"] / 2 + p["particle_radius"]
    return [
        [(x, y, z + radius) for x, z, y in triangle] for triangle in tube(radius, -half, half, 4, n)
    ]


def faces(p: dict) -> list:
    """Triangles of the faces, squares that stand out of the shell."""
    found, side, middle = [], 0.55 * p["drum_diameter"], p["drum_diameter"] / 2
    for y in (-p["drum_depth"] / 2, p["drum_depth"] / 2):
        a, b, c, d = (
            (i * side, y, middle + j * side) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        )
        found += [(a, b, c), (a, c, d)]
    return found


def cloud(p: dict) -> tuple[np.ndarray, np.ndarray]:
    """Centres and velocities (n, 3) that YADE would start from: the same random numbers."""
    rng, radius = np.random.default_rng(p["seed"]), p["drum_diameter"] / 2
    section = math.pi * radius**2
    count = grains_for(p, p["fill_fraction"] * section * p["drum_depth"])
    inner = packing.inscribed_radius(radius, sides(p))
    reach = float(size_classes(p).max())
    depth = p["drum_depth"]
    centres = packing.cloud_in_drum(count, reach, p["cloud_fraction"], inner, depth, rng)
    speed = 0.5 * (GRAVITY * 2 * p["particle_radius"]) ** 0.5
    return centres + np.array([0, 0, radius]), rng.normal(0, speed, centres.shape)


def frames(path: Path) -> Iterator[np.ndarray]:
    """Rows of x, z, radius, vx, vz (n, 5) of each moment of a dump."""
    with open(path) as stream:
        for line in stream:
            if line.startswith("ITEM: NUMBER"):
                count = int(next(stream))
            elif line.startswith("ITEM: ATOMS"):
                yield np.array([next(stream).split() for _ in range(count)], float)


def measured(p: dict, path: Path) -> dict[str, float]:
    """Responses of a dump, with the drift of its angle, by the code that measures YADE's grains."""
    drum, grain = p["drum_diameter"] / 2, p["particle_radius"]
    at = camera.pixels(drum, grain)
    films, angles = [], []
    for rows in frames(path):
        layers = camera.frame(rows[:, :2] - (0, drum), rows[:, 3:], rows[:, 2], at)
        films.append(layers)
        x, z = camera.surface(layers[0], at, drum)
        middle = np.abs(x) < drum / 2
        angles.append(measure.fit_slope(x[middle], z[middle])["angle"])
    film = np.mean(films, axis=0)
    found, _ = measure.drum_responses(*camera.surface(film[0], at, drum), drum)
    blocks = np.array_split(angles, BLOCKS * p["measuring_turns"])
    found["drift_deg"], found["error_deg"], _ = measure.steadiness([b.mean() for b in blocks])
    angle = found["drum_angle_deg"]
    edges = [camera.surface(film[0], at, drum, level) for level in (0.16, 0.84)]
    found["drum_blur"] = measure.drum_blur(*edges, drum, angle)
    level = found["drum_height_centre"] * drum
    found["drum_layer_thickness"] = camera.layer_thickness(film, at, angle, level, grain)
    return {n: math.nan if v is None else float(v) for n, v in found.items()}


def run_liggghts(request: Request, folder: Path) -> dict[str, float]:
    """One drum in LIGGGHTS, in a folder that is emptied first; RuntimeError where it fails."""
    p = dict(request.parameters)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    centres, velocities = cloud(p)
    radius, half, r = p["drum_diameter"] / 2, p["drum_depth"] / 2, p["particle_radius"]
    box = [(-1.7 * radius, 1.7 * radius), (-half - 4 * r, half + 4 * r)]
    box.append((-0.7 * radius, 2.7 * radius))
    write_grains(folder, p, centres, velocities, box, False)
    write_facets(folder / "shell.stl", shell(p))
    write_facets(folder / "faces.stl", faces(p))
    numbers = {n: np.array(v) for n, v in p.items() if not isinstance(v, str)}
    dt, period = 0.2 * float(rayleigh_time(numbers)), 60 / p["rotation_rpm"]
    text = INPUT.format(
        side="f", skin=0.4 * r, young=p["young_modulus"], poisson=p["poisson_ratio"], law=LAW,
        e=p["restitution"], mu=p["sliding_friction"], mur=p["rolling_friction"], dt=dt,
        turn=f"origin 0. 0. {radius:.10g} axis 0. 1. 0. period {period:.10g}",
        settle=int(2.5 * math.sqrt(4 * radius / GRAVITY) / dt),
        first=int(p["settling_turns"] * period / dt),
        turns=int(p["measuring_turns"] * period / dt),
        every=max(1, round(p["sampling_interval"] / dt)),
    )  # fmt: skip
    (folder / "in.run").write_text(text)
    seconds = core_seconds(["liggghts", "-in", "in.run"], folder)
    kept = len(next(frames(folder / "film.dump")))
    if kept != len(centres):
        raise RuntimeError(f"LIGGGHTS lost {len(centres) - kept} grains: see {folder}/output.txt")
    return {**measured(p, folder / "film.dump"), "core_seconds": seconds}


def yade(jobs: int) -> None:
    """Make what is missing of YADE's runs."""
    wanted = list(requests())
    records = run(FOLDER, wanted, jobs=jobs, report=ProgressBar(sys.stderr))
    Database(records).write(SHIPPED, f"{COMMAND} yade")


def liggghts() -> None:
    """Make what is missing of LIGGGHTS' runs."""
    rows = read_engine()
    for request in requests():
        if key(request.parameters) not in rows:
            name = "_".join(f"{value:g}" for value in key(request.parameters))
            found = run_liggghts(request, FOLDER.path / "liggghts" / name)
            rows[key(request.parameters)] = found
            write_engine(rows)


def key(p: dict) -> tuple[float, ...]:
    """Which run it is."""
    return tuple(float(p[name]) for name in COLUMNS[:4])


def read_engine() -> dict[tuple[float, ...], dict[str, float]]:
    """What LIGGGHTS gave so far."""
    if not ENGINE.exists():
        return {}
    with open(ENGINE) as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    return {key(row): {n: float(v) for n, v in row.items() if n not in COLUMNS[:4]} for row in rows}


def write_engine(rows: dict[tuple[float, ...], dict[str, float]]) -> None:
    """Write what LIGGGHTS gave."""
    names = (*COLUMNS, *COMPARED, "core_seconds")
    with open(ENGINE, "w", newline="") as stream:
        stream.write(f"# LIGGGHTS, rolling resistance epsd2; {COMMAND} liggghts\n")
        table = csv.writer(stream)
        table.writerow(names)
        for own, found in rows.items():
            table.writerow([*own, *(found[name] for name in names[4:])])


def judge() -> None:
    """Means of both engines at each speed and friction, and whether their difference is noise."""
    theirs, found = read_engine(), []
    ours = {key(r.request.parameters): r.responses for r in gather(FOLDER, list(requests()))}
    if SHIPPED.exists():
        ours |= {
            key(r.request.parameters): r.responses for r in Database.read(SHIPPED).records.values()
        }
    for pair in PAIRS:
        for speed in SPEEDS:
            keys = [(speed, *pair, float(seed)) for seed in SEEDS]
            for name in COMPARED:
                a, b = ([e[k][name] for k in keys if name in e.get(k, {})] for e in (ours, theirs))
                if len(a) > 1 and len(b) > 1:
                    found.append({"rpm": speed, "friction": pair, "response": name, **both(a, b)})
    write("drum_engines", {"compared": found})
    for row in found:
        print(row)


def both(a: list[float], b: list[float]) -> dict[str, float]:
    """Means of YADE and LIGGGHTS, their difference, and its standard error."""
    error = math.hypot(*(np.std(e, ddof=1) / math.sqrt(len(e)) for e in (a, b)))
    means = {"YADE": rounded(np.mean(a)), "LIGGGHTS": rounded(np.mean(b))}
    difference = rounded(np.mean(a) - np.mean(b))
    return {**means, "difference": difference, "standard_error": rounded(error)}


def tiny() -> None:
    """One small drum in both engines, to see that everything runs."""
    request, folder = Request.of("rotating_drum", **TINY), FOLDER.path / "tiny"
    theirs = run_liggghts(request, folder / "liggghts")
    (record,) = run(RunFolder(folder / "yade"), [request])
    print(f"YADE {record.status} {record.error}")
    for name in COMPARED:
        print(f"{name:<24} {record.responses.get(name, math.nan):9.4g} {theirs[name]:9.4g}")
    print(f"LIGGGHTS drifts by {theirs['drift_deg']:.2g} +- {theirs['error_deg']:.2g} degrees")


if __name__ == "__main__":
    if sys.argv[1:2] == ["yade"]:
        yade(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    else:
        verbs = {"liggghts": liggghts, "judge": judge, "tiny": tiny}
        if len(sys.argv) != 2 or sys.argv[1] not in verbs:
            raise SystemExit(__doc__)
        verbs[sys.argv[1]]()
