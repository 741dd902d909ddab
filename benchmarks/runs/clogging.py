"""Does the paper's own hourglass clog? 25 g of individual D in 32 mm, over a neck of 6.25 grains.

    python -m benchmarks.runs.clogging full         the paper's, one run: ten core-hours or more
    python -m benchmarks.runs.clogging narrow [N]   3 g in 13 mm, ten seeds, N at a time
    python -m benchmarks.runs.clogging              judge what has been run

Grains arch over a neck at random, at a rate per mass that passes which does not depend on how much
is above (Zuriguel et al., Physical Review E 68 (2003) 030301; Thomas and Durian, Physical Review
Letters 114 (2015) 178001): the mass between clogs is exponentially distributed. Its mean M comes
from all runs, clogged or not, as the mass that passed over the number of clogs, with the interval
of a Poisson count (Garwood, Biometrika 28 (1936) 437); exp(-m / M) is then the chance of m to pass.
Writes grid/clogging.csv and benchmarks/results/clogging.json.
"""

import csv
import math
import sys
import tomllib
from pathlib import Path

from scipy.stats import chi2

from benchmarks.common import rounded, write
from calibrator.files import read_arrays
from calibrator.runs.cost import core_hours
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

REPO = Path(__file__).resolve().parents[2]
FOLDER = RunFolder(REPO / "results" / "clogging")
SHIPPED = REPO / "grid" / "clogging.csv"
PAPER = REPO / "cases" / "reference_paper.toml"
VESSELS = {
    "full": dict(fill_mass=25e-3, cylinder_diameter=32e-3, neck_diameter=5e-3, longest_time=30.0),
    "narrow": dict(fill_mass=3e-3, cylinder_diameter=13e-3, neck_diameter=5e-3, longest_time=20.0),
}
DRAINED = 15e-3  # [kg] of the 25 g, roughly: the rest stays as the slope that the paper measures
FIRST_SEED, SEEDS = 825_001, {"full": 1, "narrow": 10}
RESPONSES = (
    "bulk_density",
    "drained_angle_of_repose_deg",
    "drained_equivalent_angle_deg",
    "discharge_time",
    "emptying_time",
    "mass_flow_rate",
    "residual_mass",
)
COLUMNS = ("vessel", "seed", "status", "fill_mass", "passed_mass", "core_seconds", *RESPONSES)


def requests(vessel: str) -> list[Request]:
    """The runs of one of the two vessels."""
    grains = tomllib.loads(PAPER.read_text())["individual"]["D"]["parameters"]
    return [
        Request.of("hourglass", **grains, **VESSELS[vessel], seed=FIRST_SEED + i)
        for i in range(SEEDS[vessel])
    ]


def rows() -> list[dict[str, str]]:
    """Every run, made here or shipped."""
    there = {}
    if SHIPPED.exists():
        with open(SHIPPED) as stream:
            for row in csv.DictReader(line for line in stream if not line.startswith("#")):
                there[row["vessel"], row["seed"]] = row
    for vessel in VESSELS:
        for record in gather(FOLDER, requests(vessel)):
            p, arrays = record.request.parameters, FOLDER.curves(record.run_id)
            passed = read_arrays(arrays)["passed_mass"][-1] if arrays.exists() else math.nan
            row = {"vessel": vessel, "seed": p["seed"], "status": record.status}
            row |= {"fill_mass": p["fill_mass"], "passed_mass": f"{passed:.6g}"}
            row["core_seconds"] = f"{3600 * core_hours(record):.4g}"
            row |= {n: f"{record.responses[n]:.6g}" for n in RESPONSES if n in record.responses}
            there[vessel, str(p["seed"])] = {n: str(row.get(n, "")) for n in COLUMNS}
    return [there[k] for k in sorted(there)]


def write_rows(found: list[dict[str, str]]) -> None:
    """Keep the runs."""
    with open(SHIPPED, "w", newline="") as stream:
        stream.write("# python -m benchmarks.runs.clogging full; ... narrow\n")
        table = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(found)


def judged(found: list[dict[str, str]]) -> dict[str, object]:
    """Mean mass between clogs, its 95 % interval, and the chance of the paper's mass to pass."""
    passed = math.fsum(float(row["passed_mass"]) for row in found)
    clogs = sum(row["status"] == "clogged" for row in found)
    low, high = (chi2.ppf(q, 2 * clogs + k) / 2 for q, k in ((0.025, 0), (0.975, 2)))
    means = [passed / n if n > 0 else None for n in (clogs, high, low)]
    return {
        "runs": len(found),
        "clogged": clogs,
        "passed_kg": rounded(passed),
        "mean_mass_between_clogs_kg": means[0] and rounded(means[0]),
        "interval_95_kg": [m and rounded(m) for m in means[1:]],
        "chance_to_drain": [None if m is None else rounded(math.exp(-DRAINED / m)) for m in means],
    }


def main() -> None:
    """Run one of the vessels, or judge both."""
    vessel, *jobs = sys.argv[1:] or [""]
    if vessel and vessel not in VESSELS:
        raise SystemExit(__doc__)
    if vessel:
        bar = ProgressBar(sys.stderr)
        run(FOLDER, requests(vessel), jobs=int(jobs[0]) if jobs else 1, report=bar)
    if not (found := rows()):
        raise SystemExit(f"nothing has been run yet\n\n{__doc__}")
    write_rows(found)
    good = [row for row in found if row["status"] in ("ok", "clogged")]
    own = {v: judged([r for r in good if r["vessel"] == v]) for v in VESSELS}
    write("clogging", {"vessels": own, "together": judged(good), "runs": found})


if __name__ == "__main__":
    main()
