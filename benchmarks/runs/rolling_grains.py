"""The grains that another engine starts from, those of the YADE scripts, and its vessels."""

import itertools
import math
from pathlib import Path

import numpy as np

import benchmarks.runs.liggghts_hourglass  # noqa: F401 - it puts the scripts' folder on the path
from benchmarks.runs.rolling_scans import grain_mass
from calibrator.case.physics import GRAVITY
from calibrator.runs.setups import NOMINAL_FRACTION

import packing  # isort: skip


def cloud(setup: str, p: dict) -> tuple[np.ndarray, np.ndarray]:
    """Centres and velocities (n, 3) that YADE would start from: the same random numbers."""
    rng, radius = np.random.default_rng(p["seed"]), p["particle_radius"]
    if setup == "ledge":
        length, width = p["box_length"], p["box_width"]

        def inside(x, y, margin):
            return (np.abs(x) < length / 2 - margin) & (np.abs(y) < width / 2 - margin)

        count = grains_for(p, length * width * p["fill_height"])
        half = length / 2, width / 2
        centres = packing.cloud(
            count, radius, p["cloud_fraction"], inside, *half, p["pouring_height"], rng
        )
        centres = (*centres, length / 2, width / 2, 0)
    else:
        if setup == "hourglass":
            count = max(1, round(p["fill_mass"] / grain_mass(p)))
        else:
            count = grains_for(p, math.pi * p["cylinder_diameter"] ** 2 / 4 * p["fill_height"])
        centres = packing.cloud_in_cylinder(p, count, radius, rng)
    random_speed = 0.5 * (GRAVITY * 2 * radius) ** 0.5
    return centres, rng.normal(0, random_speed, centres.shape) - (0, 0, p["pouring_velocity"])


def grains_for(p: dict, volume: float) -> int:
    """Number of grains that nominally fill a volume [m3]."""
    return max(1, round(NOMINAL_FRACTION * volume * p["particle_density"] / grain_mass(p)))


def tube(radius: float, bottom: float, top: float, pieces: int = 6) -> list:
    """Triangles of YADE's polygonal cylinder, cut so that none is too thin for LIGGGHTS."""
    found, heights = [], np.linspace(bottom, top, pieces + 1)
    for z0, z1 in itertools.pairwise(heights):
        low, high = packing.ring(radius, z0), packing.ring(radius, z1)
        for i in range(len(low)):
            a, b, c, d = low[i - 1], low[i], high[i], high[i - 1]
            found += [(a, b, c), (a, c, d)]
    return found


def write_grains(
    folder: Path, p: dict, centres: np.ndarray, velocities: np.ndarray, box: list, lammps: bool
) -> None:
    """The data file that both engines read."""
    grain = f"{2 * p['particle_radius']:.10g} {p['particle_density']:.10g}"
    rows = [f"{i} 1 {grain} {x:.10g} {y:.10g} {z:.10g}" for i, (x, y, z) in enumerate(centres, 1)]
    speeds = [f"{i} {u:.10g} {v:.10g} {w:.10g} 0 0 0" for i, (u, v, w) in enumerate(velocities, 1)]
    sides = "\n".join(
        f"{lo:.10g} {hi:.10g} {n}lo {n}hi" for n, (lo, hi) in zip("xyz", box, strict=True)
    )
    head = f"grains\n\n{len(centres)} atoms\n{1 if lammps else 2} atom types\n{sides}\n"
    text = "\n".join([head, "Atoms\n", *rows, "", "Velocities\n", *speeds]) + "\n"
    (folder / "grains.lmp").write_text(text)
