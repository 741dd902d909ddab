"""Particle-steps a second and core on the shipped runs: the constant of the cost model.

    python -m benchmarks.runs.rate        writes benchmarks/results/rate.json

The cost model is in calibrator/runs/cost.py.
"""

import csv
import json
from pathlib import Path

import numpy as np

from calibrator.runs.database import Database
from calibrator.runs.setups import particles, steps

REPO = Path(__file__).resolve().parents[2]


def main() -> None:
    """Rates (grains times steps over core-seconds), and how well steps are forecast."""
    database = Database.read(REPO / "grid" / "coarse_sand.csv")
    timings = {
        r["run_id"]: r
        for r in csv.DictReader(
            (REPO / "grid" / "coarse_sand_timings.csv").read_text().splitlines()
        )
    }
    rates, forecast = [], []
    for run_id, record in database.records.items():
        if run_id in timings and record.status == "ok":
            seconds = sum(float(timings[run_id][c]) for c in ("filling_cpu", "release_cpu"))
            rates.append(particles(record.request) * record.diagnostics["steps"] / seconds)
            forecast.append(steps(record.request) / record.diagnostics["steps"])
    found = {
        "runs": len(rates),
        "particle_steps_per_second_median": float(np.median(rates)),
        "particle_steps_per_second_range": [min(rates), max(rates)],
        "steps_forecast_over_actual_median": float(np.median(forecast)),
        "steps_forecast_over_actual_range": [min(forecast), max(forecast)],
    }
    out = REPO / "benchmarks" / "results" / "rate.json"
    out.parent.mkdir(exist_ok=True)
    out.write_text(json.dumps(found, indent=1) + "\n")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
