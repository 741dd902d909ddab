"""How the bookkeeping grows with the number of runs: records, database, and the verbs.

    python -m benchmarks.numerics.growth            some minutes
    python -m benchmarks.numerics.growth --quick    few records, prints only: a smoke test

Writes benchmarks/results/growth.json and growth.png. The records are synthetic: made-up responses
of hourglass runs that never took place, in the format of real ones. "Ratio to linear" is the time
(or memory) per record over that with the fewest but one, so 1 is linear growth and less is better;
with the fewest, what every call costs once still shows. The verbs work on the demo's case with 50
parameter sets and as many replicates as give the number. Memory is tracemalloc's peak in a pass of
its own.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import (
    RESPONSES,
    RESULTS,
    asked_for_quick,
    paper_problem,
    peak_memory,
    power,
    rounded,
    runs,
    seconds_of,
    write,
)
from calibrator.case.toml import read_case
from calibrator.case.vocabulary import SCHEMA
from calibrator.plan.forecast import forecast
from calibrator.plan.requests import plan_requests
from calibrator.plan.run import collect
from calibrator.report.page import write_report
from calibrator.responses.table import response_table
from calibrator.runs import batch
from calibrator.runs.database import Database
from calibrator.runs.folder import Failure, RunFolder, gather
from calibrator.runs.request import Request, write_table
from calibrator.runs.workspace import Workspace
from calibrator.search.calibrate import calibrate

SIZES = [100, 1000, 10_000, 100_000]
SETS = 50
REPO = Path(__file__).resolve().parents[2]
LOST = 100  # one in so many runs has failed for good


def made_up_requests(count: int) -> list[Request]:
    """Hourglass runs over the paper's five parameters, no two alike."""
    problem = paper_problem()
    points = [
        dict(zip(problem.names, map(float, row), strict=True)) for row in runs(problem, count)[0]
    ]
    return [Request.of("hourglass", **point, seed=seed) for seed, point in enumerate(points)]


def write_records(
    folder: RunFolder, requests: list[Request], responses: np.ndarray, names: list[str]
) -> None:
    """A record for each request with made-up responses (n, m); one in LOST is a failure instead."""
    folder.prepare()
    failed = requests[::LOST]
    folder.write_failures({r.run_id: Failure("crash", "made up", 2) for r in failed})
    for index, (request, row) in enumerate(zip(requests, responses, strict=True)):
        if index % LOST:
            record = {
                "schema": SCHEMA,
                "setup": request.setup,
                "run_id": request.run_id,
                "parameters": request.parameters,
                "status": "ok",
                "responses": dict(zip(names, map(float, row), strict=True)),
                "error": None,
                "diagnostics": {"particles": 1000, "steps": 100_000},
                "provenance": {"yade": "none", "scripts": "none"},
            }
            folder.record(request).write_text(json.dumps(record))


def workspace(path: Path, count: int) -> Workspace:
    """The demo's case with so many runs, all of them made up, and calibrated."""
    text = (REPO / "cases" / "coarse_sand.toml").read_text()
    for line, other in (
        ("sets = 24", f"sets = {SETS}"),
        ("replicates = 2\n", f"replicates = {max(2, count // SETS)}\n"),
        ('shipped = "../grid/coarse_sand.csv"\n', ""),
    ):
        if line not in text:
            raise SystemExit(
                f"cases/coarse_sand.toml has no line {line!r} any more: adapt this benchmark"
            )
        text = text.replace(line, other)
    path.mkdir()
    for name in ("coarse_sand_lab.csv", "coarse_sand_truth.toml"):
        shutil.copy(REPO / "cases" / name, path)
    (path / "case.toml").write_text(text)
    case = read_case(path / "case.toml")
    space = Workspace(case, path / "results")
    requests = plan_requests(case)
    rolling, sliding, modulus = np.array(
        [[r.parameters[n] for n in case.problem.names] for r in requests]
    ).T
    clean = np.column_stack(
        [
            1600 - 60 * sliding - 20 * rolling - modulus / 1e5,
            45 + 20 * sliding + 30 * rolling,
            0.03 - 0.005 * sliding,
        ]
    )
    noisy = clean * (1 + 0.01 * np.random.default_rng(count).standard_normal(clean.shape))
    names = ["bulk_density", "drained_equivalent_angle_deg", "mass_flow_rate"]
    write_records(space.runs, requests, noisy, names)
    calibrate(space)
    return space


def steps(path: Path, count: int) -> dict[str, Callable[[], Any]]:
    """What a calibration does with its records, in order; each step finds its files."""
    requests = made_up_requests(count)
    folder = RunFolder(path)
    write_records(
        folder, requests, runs(paper_problem(), count)[1], [key.split(".")[1] for key in RESPONSES]
    )
    space = workspace(path / "case", count)
    records = gather(folder, requests)
    database = Database(records)
    database.write(path / "database.csv")
    return {
        "make requests": partial(made_up_requests, count),
        "write table": partial(write_table, path / "runs.table", requests),
        "find pending runs": partial(batch.pending_requests, folder, requests, 2),
        "gather records": partial(gather, folder, requests),
        "write database": partial(database.write, path / "database.csv"),
        "read database": partial(Database.read, path / "database.csv"),
        "find in database": partial(database.find, requests),
        "table of responses": partial(response_table, paper_problem(), records, RESPONSES),
        "verb plan": partial(forecast, space),
        "verb collect": partial(collect, space),
        "verb report": partial(write_report, space),
    }


def measure_size(count: int) -> dict[str, dict[str, float]]:
    """Seconds and peak memory of each step with so many records."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, step in steps(Path(folder), count).items():
            seconds = min(seconds_of(step)[0] for _ in range(3 if count <= 10_000 else 1))
            found[name] = {
                "seconds": rounded(seconds, 3),
                "peak_megabytes": rounded(peak_memory(step), 3),
            }
            print(count, name, found[name])
    return found


def summarise(sizes: list[int], found: list[dict[str, dict[str, float]]]) -> dict[str, Any]:
    """By step: the series, their powers, and the largest size against linear growth."""
    results = {}
    for step in found[0]:
        results[step] = {"records": sizes}
        for key in ("seconds", "peak_megabytes"):
            series = [one[step][key] for one in found]
            growth = (series[-1] / series[1]) / (sizes[-1] / sizes[1])
            results[step] |= {key: series, f"{key}_ratio_to_linear": rounded(growth, 3)}
        results[step]["power"] = rounded(power(sizes[1:], results[step]["seconds"][1:]), 3)
    return results


def plot(results: dict[str, Any]) -> None:
    """Time and memory of each step over the number of records."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
    for axis, key, label in zip(
        axes, ("seconds", "peak_megabytes"), ("time [s]", "peak memory [MB]"), strict=True
    ):
        for step, row in results["steps"].items():
            axis.loglog(
                row["records"], row[key], "s--" if step.startswith("verb") else "o-", label=step
            )
        sizes = np.array(row["records"])
        axis.loglog(sizes, 1e-6 * sizes if key == "seconds" else 1e-4 * sizes, "k:", label="linear")
        axis.set(xlabel="records (synthetic)", ylabel=label)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center", frameon=False)
    figure.savefig(RESULTS / "growth.png", dpi=150)


def main() -> None:
    """Measure, write, draw."""
    sizes = [30, 100, 300] if asked_for_quick(__doc__, "few records, nothing written") else SIZES
    found = [measure_size(count) for count in sizes]
    results = {
        "about": f"synthetic records; one run in {LOST} failed for good",
        "steps": summarise(sizes, found),
    }
    print(
        json.dumps(
            {step: row["seconds_ratio_to_linear"] for step, row in results["steps"].items()},
            indent=1,
        )
    )
    if sizes == SIZES:
        write("growth", results)
        plot(results)


if __name__ == "__main__":
    main()
