"""The demo's calibrated material in other engines: what its set-ups measure there.

    python -m tests.campaigns.handed_on    half an hour of a core at most

It exports the compromise of results/coarse_sand, where `calibrator all cases/coarse_sand.toml` has
left it, and runs the hourglass and the heap with the exported files in LIGGGHTS, and the heap in
LAMMPS, from the clouds of YADE's verification and validation. The table goes to
benchmarks/results/handed_on.json and is that of docs/export.md.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.common import rounded, write
from calibrator.case.toml import read_case
from calibrator.handover.chosen import CONTACT, chosen
from calibrator.runs.database import Database
from calibrator.runs.request import Request
from calibrator.runs.workspace import Workspace
from tests.handover.engines import bulk

REPO = Path(__file__).resolve().parents[3]
RUNS = (
    ("hourglass", "verification.csv", ("liggghts",)),
    ("conical_pile", "validation.csv", ("liggghts", "lammps")),
)
RESPONSES = {
    "hourglass": ("bulk_density", "drained_equivalent_angle_deg", "mass_flow_rate"),
    "conical_pile": ("bulk_density", "pile_equivalent_angle_deg", "pile_angle_of_repose_deg"),
}


def yades(space: Workspace, setup: str, table: str) -> list[tuple[Request, dict[str, float]]]:
    """YADE's fresh runs of the compromise: requests and responses."""
    values = chosen(space).values
    records = Database.read(space.path / table).records.values()
    return [
        (r.request, r.responses)
        for r in records
        if r.request.setup == setup
        and r.status == "ok"
        and all(r.request.value(n) == values[n] for n in CONTACT)
    ]


def summary(setup: str, rows: list[dict[str, float]]) -> dict[str, dict[str, float]]:
    """Mean and standard error of each response, and the number of runs."""
    found = {}
    for name in RESPONSES[setup]:
        own = np.array([row[name] for row in rows if name in row])
        error = own.std(ddof=1) / len(own) ** 0.5
        found[name] = {"mean": rounded(own.mean(), 4), "error": rounded(error, 2), "runs": len(own)}
    return found


def main() -> None:
    """Run what YADE ran, in the other engines."""
    results = Path(sys.argv[1]) if sys.argv[1:] else REPO / "results" / "coarse_sand"
    space = Workspace(read_case(REPO / "cases" / "coarse_sand.toml"), results)
    one, found = chosen(space), {}
    for setup, table, engines in RUNS:
        runs = yades(space, setup, table)
        found[setup] = {"YADE": summary(setup, [responses for _, responses in runs])}
        for engine in engines:
            rows = []
            for request, _ in runs:
                with tempfile.TemporaryDirectory() as folder:
                    status, own = bulk(engine, setup, one, request.parameters, Path(folder))
                print(setup, engine, request.parameters["seed"], status, own, flush=True)
                if status == "ok":
                    rows.append(own)
            found[setup][engine] = summary(setup, rows)
    write("handed_on", found)


if __name__ == "__main__":
    main()
