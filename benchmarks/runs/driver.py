"""How much of the cores' time the driver turns into YADE's steps, on real runs of a minute.

    python -m benchmarks.runs.driver [cores]      about 10 minutes on an idle machine

Writes benchmarks/results/driver.json and .png. A core's time lasts from the driver's call to the
end of the last run on that core; the idle tail after it is given apart, as it shrinks with the
number of runs. "Stepping" is CPU time within filling and release: time that another machine's load
takes from a core counts as lost.
"""

import itertools
import os
import shutil
import sys
import time

import matplotlib
import numpy as np

from benchmarks.common import RESULTS, rounded, write
from benchmarks.runs.dem import HOURGLASSES, WORK
from calibrator.runs.cost import core_seconds
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.record import Record
from calibrator.runs.request import Request

matplotlib.use("Agg")
import matplotlib.pyplot as plt

# Pa: steps, and with them the time of a run, grow with the root
MODULI = (5e7, 6e7, 7e7, 8e7, 9e7, 1e8)


def requests() -> list[Request]:
    """Six hourglasses of quartz grains, the shortest first: the driver has to turn that round."""
    quartz = HOURGLASSES["quartz"]
    return [
        Request.of("hourglass", **{**quartz, "young_modulus": e, "seed": 72_001}) for e in MODULI
    ]


def spans(records: list[Record], begin: float) -> list[tuple[float, float, float]]:
    """(start, end, stepping) of each run in seconds after the driver's call, by start."""
    rows = []
    for r in records:
        start = float(r.provenance["started"]) - begin
        stepping = float(r.diagnostics["filling_cpu"]) + float(r.diagnostics["release_cpu"])
        rows.append((start, start + float(r.provenance["wall_time"]), stepping))
    return sorted(rows)


def on_cores(
    rows: list[tuple[float, float, float]], cores: int
) -> list[list[tuple[float, float, float]]]:
    """The runs of each core: each run took the core that was free the longest."""
    own: list[list[tuple[float, float, float]]] = [[] for _ in range(cores)]
    for row in rows:
        min(own, key=lambda o: o[-1][1] if o else 0.0).append(row)
    return own


def figure(own: list[list[tuple[float, float, float]]]) -> None:
    """The runs of each core over time."""
    fig, axis = plt.subplots(figsize=(9, 1 + 0.6 * len(own)), layout="constrained")
    for core, rows in enumerate(own):
        axis.barh(
            [core] * len(rows),
            [e - s for s, e, _ in rows],
            left=[s for s, _, _ in rows],
            edgecolor="white",
            height=0.7,
        )
        for start, end, stepping in rows:
            axis.text(
                (start + end) / 2,
                core,
                f"{end - start:.0f} s\n{stepping / (end - start):.1%}",
                ha="center",
                va="center",
            )
    axis.set(
        yticks=range(len(own)),
        yticklabels=[f"core {i + 1}" for i in range(len(own))],
        xlabel="time [s]",
    )
    fig.savefig(RESULTS / "driver.png", dpi=110)


def main() -> None:
    """Run, account, draw."""
    cores = int(sys.argv[1]) if sys.argv[1:] else len(os.sched_getaffinity(0))
    folder, plan = WORK / "driver", requests()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    begin = time.time()
    records = run(RunFolder(folder), plan, jobs=cores)
    wall = time.time() - begin
    rows = spans(records, begin)
    own = on_cores(rows, cores)
    stepping, occupied = sum(r[2] for r in rows), sum(o[-1][1] for o in own)
    started = sorted(records, key=lambda r: float(r.provenance["started"]))
    cost = core_seconds([r.request for r in started])
    found = {
        "cores": cores,
        "runs": len(records),
        "statuses": sorted({r.status for r in records}),
        "seconds_of_a_run": [rounded(f(e - s for s, e, _ in rows)) for f in (min, max)],
        "stepping_share": rounded(stepping / occupied),
        "stepping_share_with_idle_tail": rounded(stepping / (cores * wall)),
        "idle_tail_seconds": [rounded(wall - o[-1][1]) for o in own],
        "seconds_before_a_run_starts": rounded(float(np.mean([o[0][0] for o in own]))),
        "seconds_between_runs": rounded(
            float(np.mean([b[0] - a[1] for o in own for a, b in itertools.pairwise(o)]))
        ),
        "longest_first": bool(np.all(np.diff(cost) <= 0)),
    }
    write("driver", found)
    figure(own)
    print(found)


if __name__ == "__main__":
    main()
