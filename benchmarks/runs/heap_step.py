"""What the time step does to heaps at the default rolling stiffness.

    python -m benchmarks.runs.heap_step run [N]   N runs at a time, two hours of a core; resumes
    python -m benchmarks.runs.heap_step judge     compares what there is

They write grid/heap_step.csv and benchmarks/results/heap_step.json. Heaps, friction pairs and the p
values are those of `rolling_stiffness`, whose seeds are not used again. Each seed's heap is built
with the step that the scripts take by themselves, with half and with a quarter of it. If the
default step is short enough, all three stand alike.
"""

import sys
from pathlib import Path

import numpy as np

from benchmarks.common import rounded, write
from benchmarks.runs.rolling_stiffness import PAIRS, difference, name_of, parameters
from calibrator.case.physics import time_step
from calibrator.case.values import is_number
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

REPO = Path(__file__).resolve().parents[2]
FOLDER = RunFolder(REPO / "results" / "heap_step")
SHIPPED = REPO / "grid" / "heap_step.csv"
COMMAND = "python -m benchmarks.runs.heap_step"
SHARES = (1.0, 0.5, 0.25)
SEEDS = tuple(range(850_101, 850_116))
RESPONSES = ("pile_equivalent_angle_deg", "pile_angle_of_repose_deg", "bulk_density")


def request(pair: tuple[float, float], seed: int, share: float) -> Request:
    """One heap; share : of the step that its material takes by default."""
    own = parameters("conical_pile", pair, seed)
    if share != 1:
        full = Request.of("conical_pile", **own).parameters
        own["time_step"] = share * time_step({n: v for n, v in full.items() if is_number(v)})
    return Request.of("conical_pile", **own)


def blocks() -> list[list[Request]]:
    """All runs, seed by seed, so that what there is can be judged at any time."""
    return [[request(p, s, share) for share in SHARES for p in PAIRS] for s in SEEDS]


def finished() -> dict[str, Record]:
    """Runs that are shipped or were made here, by run id."""
    wanted = [r for block in blocks() for r in block]
    shipped = Database.read(SHIPPED).find(wanted) if SHIPPED.exists() else []
    return {r.run_id: r for r in [*shipped, *gather(FOLDER, wanted)]}


def run_yade(jobs: int) -> None:
    """Make what is missing, a seed at a time."""
    for block in blocks():
        known = finished()
        missing = [r for r in block if r.run_id not in known]
        if missing:
            run(FOLDER, missing, jobs=jobs, report=ProgressBar(sys.stderr))
            Database(list(finished().values())).write(SHIPPED, f"{COMMAND} run")


def judge() -> None:
    """Means of each friction pair and step, and what halving and quartering the step changes."""
    known = finished()
    found = {}
    for name in RESPONSES:
        samples = {}
        for pair in PAIRS:
            own = {
                f"{share:g}": [known.get(request(pair, s, share).run_id) for s in SEEDS]
                for share in SHARES
            }
            samples[pair] = {
                label: np.array([r.responses[name] for r in records if r and r.status == "ok"])
                for label, records in own.items()
            }
        table = {
            name_of(pair): {
                label: {
                    "mean": rounded(v.mean(), 4),
                    "standard_error": rounded(v.std(ddof=1) / len(v) ** 0.5, 2),
                    "runs": len(v),
                }
                for label, v in own.items()
            }
            for pair, own in samples.items()
        }
        changes = {f"{s:g} minus 1": difference(samples, f"{s:g}", "1") for s in SHARES[1:]}
        found[name] = {"table": table, **changes}
    write("heap_step", {"responses": found})


if __name__ == "__main__":
    if sys.argv[1:2] == ["run"]:
        run_yade(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    else:
        judge()
