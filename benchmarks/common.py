"""What benchmarks share: a made-up response surface over the paper's parameters, and output."""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
import tracemalloc
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.plan.design import sobol
from calibrator.responses.gaussian_process import GaussianProcess
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

RESULTS = Path(__file__).parent / "results"
RESPONSES = (
    "hourglass.bulk_density",
    "hourglass.discharge_time",
    "hourglass.drained_angle_of_repose_deg",
)
NOISE = np.array([3.0, 0.01, 0.5])  # seed noise of the made-up responses, in their units
ABOUT = (
    "synthetic: a smooth made-up surface of 3 responses over the paper's 5 parameters, no"
    " simulation"
)
TRUTH = np.array([0.25, 0.5, 0.35e-3, 2700.0, 100e6])


def paper_problem() -> Problem:
    """The reference paper's five parameters of 8 bits, with the made-up targets at TRUTH."""
    parameters = (
        Parameter("rolling_friction", 0.1, 0.5),
        Parameter("sliding_friction", 0.2, 0.7),
        Parameter("particle_radius", 0.3e-3, 0.4e-3),
        Parameter("particle_density", 2600.0, 2800.0),
        Parameter("young_modulus", 5e6, 500e6),
    )
    unit = (TRUTH - [p.low for p in parameters]) / [p.high - p.low for p in parameters]
    values = surface(unit[None])[0]
    return Problem(
        parameters, tuple(Target(*k.split("."), v) for k, v in zip(RESPONSES, values, strict=True))
    )


def surface(unit: np.ndarray) -> np.ndarray:
    """Made-up density, discharge time and drained angle (n, 3) at points (n, 5) of the unit box."""
    rolling, sliding, radius, density, modulus = unit.T
    friction = 1 - np.exp(-1.5 * rolling - sliding)
    bulk = 1480 + 110 * density - 70 * friction + 25 * (1 - modulus) ** 4 - 10 * radius
    discharge = 1.1 + 0.4 * friction + 0.25 * radius * (1 + sliding) - 0.05 * density
    angle = 20 + 18 * friction + 4 * np.sin(2 * sliding) * rolling - 2 * modulus * rolling
    return np.column_stack([bulk, discharge, angle])


def runs(problem: Problem, sets: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (sets, 5) of the project's own design, and noisy made-up responses (sets, 3)."""
    points = sobol(problem, sets)
    scatter = NOISE * np.random.default_rng(sets).standard_normal((sets, 3))
    return points, surface((points - problem.low) / (problem.high - problem.low)) + scatter


def fitted(problem: Problem, sets: int, restarts: int = 3) -> GaussianProcess:
    """Gaussian processes through the made-up runs, seed noise known."""
    bounds = np.array([problem.low, problem.high])
    return GaussianProcess.fit(*runs(problem, sets), RESPONSES, bounds, NOISE, restarts=restarts)


def asked_for_quick(description: str | None, quick: str) -> bool:
    """Whether the command line has --quick, whose help is `quick`."""
    parser = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help=quick)
    return bool(parser.parse_args().quick)


def seconds_of(function: Callable[[], Any]) -> tuple[float, Any]:
    """Wall-clock time of a call, and what it returned."""
    begin = time.perf_counter()
    found = function()
    return time.perf_counter() - begin, found


def peak_memory(function: Callable[[], Any]) -> float:
    """Largest memory in use during a call beyond that before it [MB]."""
    tracemalloc.start()
    function()
    peak = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    return peak


def power(sizes: list[int], seconds: list[float]) -> float:
    """Slope of log time over log size by least squares: 1 is linear growth."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def shipped_or_run(
    shipped: Path, folder: RunFolder, wanted: Sequence[Request], command: str
) -> list[Record]:
    """Records of the wanted runs: shipped ones, and the rest made in a folder.

    The shipped database is written anew.
    """
    there = Database.read(shipped).find(wanted) if shipped.exists() else []
    known = {r.run_id for r in there}
    records = [
        *there,
        *run(folder, [r for r in wanted if r.run_id not in known], report=ProgressBar(sys.stderr)),
    ]
    Database(records).write(shipped, command)
    return records


def write(name: str, results: dict[str, Any], folder: Path = RESULTS) -> None:
    """Write the results with the versions behind them."""
    packages = {
        p: version(p) for p in ("numpy", "scipy", "scikit-learn", "pymoo", "moocore", "pandas")
    }
    results = {**results, "versions": {"python": platform.python_version(), **packages}}
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.json").write_text(json.dumps(results, indent=1) + "\n")


def rounded(value: float, digits: int = 4) -> float:
    """The value with so many significant digits."""
    return float(f"{value:.{digits}g}")
