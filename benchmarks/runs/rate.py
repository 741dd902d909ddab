"""Particle-steps a second and core, and how they fall with the number of grains.

    python -m benchmarks.runs.rate        ten minutes of a slow core; resumes

Heaps of the same shape with 250, 1,000 and 4,000 grains on this machine, one at a time, and the
shipped runs of another one, whose median is where the default of `run.particle_steps_per_second`
comes from. Writes benchmarks/results/rate.json. The cost model that rests on both is in
calibrator/runs/cost.py; that other machine's rate with 3,519 grains is in checkpoints.json.
"""

import csv
import json
import sys
from pathlib import Path

import numpy as np

from benchmarks.common import write
from calibrator.runs.cost import spent_seconds
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.setups import particles, steps
from calibrator.runs.speed import PROBE
from calibrator.terminal import ProgressBar

REPO = Path(__file__).resolve().parents[2]
LARGER = (1.0, 1.6, 2.5)
"""Edge lengths over those of the heap that `init` times."""
LENGTHS = ("cylinder_diameter", "fill_height", "lift_height")
SEEDS = (1, 2)


def heap(larger: float, seed: int) -> Request:
    """A heap of the same shape, lifted at the same Froude number."""
    p = {**PROBE.parameters, "seed": seed}
    p |= {name: larger * float(p[name]) for name in LENGTHS}
    return Request(PROBE.setup, {**p, "lift_speed": larger**0.5 * float(p["lift_speed"])})


def rate(record: Record) -> float:
    """Particle-steps a second of a finished run."""
    steps_made = particles(record.request) * record.diagnostics["steps"]
    return float(steps_made / spent_seconds(record))


def here() -> dict[str, object]:
    """Rates by number of grains, and the power that they fall with."""
    requests = [heap(larger, seed) for larger in LARGER for seed in SEEDS]
    folder = RunFolder(REPO / "results" / "rate")
    records = run(folder, requests, jobs=1, report=ProgressBar(sys.stderr, "heaps"))
    good = [r for r in records if r.status == "ok"]
    grains, rates = [particles(r.request) for r in good], [rate(r) for r in good]
    slope = np.polyfit(np.log(grains), np.log(rates), 1)[0]
    return {"grains": grains, "particle_steps_per_second": rates, "power": float(slope)}


def shipped() -> dict[str, object]:
    """Rates of the shipped runs that have their times, and how well steps are forecast."""
    database = Database.read(REPO / "grid" / "coarse_sand.csv")
    text = (REPO / "grid" / "coarse_sand_timings.csv").read_text()
    timings = {r["run_id"]: r for r in csv.DictReader(text.splitlines())}
    rates, forecast, grains = [], [], set()
    for run_id, record in database.records.items():
        if run_id in timings and record.status == "ok":
            seconds = sum(float(timings[run_id][c]) for c in ("filling_cpu", "release_cpu"))
            rates.append(particles(record.request) * record.diagnostics["steps"] / seconds)
            forecast.append(steps(record.request) / record.diagnostics["steps"])
            grains.add(particles(record.request))
    return {
        "runs": len(rates),
        "grains": sorted(grains),
        "particle_steps_per_second_median": float(np.median(rates)),
        "particle_steps_per_second_range": [min(rates), max(rates)],
        "steps_forecast_over_actual_median": float(np.median(forecast)),
        "steps_forecast_over_actual_range": [min(forecast), max(forecast)],
    }


def main() -> None:
    """Make the runs that are missing, and write what both machines say."""
    found = {"another_machine": shipped(), "this_machine": here()}
    write("rate", found)
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
