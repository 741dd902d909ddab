"""The grains that another engine starts from, those of the YADE scripts, and its vessels.

Grains of several sizes (size_spread) have the scripts' seven equally frequent ones, in another
order: which grain has which size is drawn by a generator of their own.
"""

import itertools
import math
from pathlib import Path

import numpy as np

import benchmarks.runs.liggghts_hourglass  # noqa: F401 - it puts the scripts' folder on the path
from benchmarks.runs.rolling_scans import mean_grain_mass
from calibrator.case.physics import GRAVITY
from calibrator.runs.setups import NOMINAL_FRACTION

import packing  # isort: skip

SIZE_CLASSES = 7  # yade_scripts/material.py


def cloud(setup: str, p: dict) -> tuple[np.ndarray, np.ndarray]:
    """Centres and velocities (n, 3) that YADE would start from: the same random numbers."""
    rng, radius = np.random.default_rng(p["seed"]), float(size_classes(p).max())
    if setup == "ledge":
        length, width = p["box_length"], p["box_width"]

        def inside(x, y, margin):
            return (np.abs(x) < length / 2 - margin) & (np.abs(y) < width / 2 - margin)

        count = grains_for(p, length * width * p["fill_height"])
        half = length / 2, width / 2
        centres = packing.cloud(
            count, radius, p["cloud_fraction"], inside, *half, p["pouring_height"], rng
        )
        centres = centres + np.array([length / 2, width / 2, 0])
    else:
        if setup == "hourglass":
            count = max(1, round(p["fill_mass"] / mean_grain_mass(p)))
        else:
            count = grains_for(p, math.pi * p["cylinder_diameter"] ** 2 / 4 * p["fill_height"])
        centres = packing.cloud_in_cylinder(p, count, radius, rng)
    random_speed = 0.5 * (GRAVITY * 2 * p["particle_radius"]) ** 0.5
    return centres, rng.normal(0, random_speed, centres.shape) - (0, 0, p["pouring_velocity"])


def grains_for(p: dict, volume: float) -> int:
    """Number of grains that nominally fill a volume [m3]."""
    return max(1, round(NOMINAL_FRACTION * volume * p["particle_density"] / mean_grain_mass(p)))


def size_classes(p: dict) -> np.ndarray:
    """Equally frequent radii [m] whose coefficient of variation is size_spread: one where it is 0.

    They are those of yade_scripts/material.py.
    """
    if not p.get("size_spread", 0.0):
        return np.array([p["particle_radius"]])
    steps = np.arange(SIZE_CLASSES) - (SIZE_CLASSES - 1) / 2
    return p["particle_radius"] * (1 + p["size_spread"] * steps / steps.std())


def sizes(p: dict, count: int) -> np.ndarray:
    """Radius [m] of each grain (count,)."""
    classes = size_classes(p)
    order = np.random.default_rng([p["seed"], SIZE_CLASSES]).permutation(count)
    return classes[order % len(classes)]


def tube(
    radius: float, bottom: float, top: float, pieces: int = 6, sides: int = packing.SEGMENTS
) -> list:
    """Triangles of YADE's polygonal cylinder, cut so that none is too thin for LIGGGHTS."""
    found, heights = [], np.linspace(bottom, top, pieces + 1)
    for z0, z1 in itertools.pairwise(heights):
        low, high = packing.ring(radius, z0, sides), packing.ring(radius, z1, sides)
        for i in range(len(low)):
            a, b, c, d = low[i - 1], low[i], high[i], high[i - 1]
            found += [(a, b, c), (a, c, d)]
    return found


def write_grains(
    folder: Path, p: dict, centres: np.ndarray, velocities: np.ndarray, box: list, lammps: bool
) -> None:
    """The data file that both engines read."""
    grains = [f"{2 * r:.10g} {p['particle_density']:.10g}" for r in sizes(p, len(centres))]
    rows = [
        f"{i} 1 {grain} {x:.10g} {y:.10g} {z:.10g}"
        for i, (grain, (x, y, z)) in enumerate(zip(grains, centres, strict=True), 1)
    ]
    speeds = [f"{i} {u:.10g} {v:.10g} {w:.10g} 0 0 0" for i, (u, v, w) in enumerate(velocities, 1)]
    sides = "\n".join(
        f"{lo:.10g} {hi:.10g} {n}lo {n}hi" for n, (lo, hi) in zip("xyz", box, strict=True)
    )
    head = f"grains\n\n{len(centres)} atoms\n{1 if lammps else 2} atom types\n{sides}\n"
    text = "\n".join([head, "Atoms\n", *rows, "", "Velocities\n", *speeds]) + "\n"
    (folder / "grains.lmp").write_text(text)
