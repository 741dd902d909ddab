"""Do two builds of YADE give the same responses? Ten parameter sets, three seeds, three set-ups.

    python -m benchmarks.runs.versions --second "chroot ROOT"

compares the runs of grid/versions.csv (the yade on the PATH) with those of grid/versions_second.csv
(another one), makes those that they lack (about 15 core-minutes of each build), writes both and
benchmarks/results/versions.json. `--second` is what the second yade's commands begin with; it has
to see this folder under the same path, which a bind mount gives a root made with debootstrap.

Both builds get the same seeds, so a run may be the same to the last digits: "equal" counts those
whose responses all differ by less than a billionth. The rest has diverged, as packings do after a
rounding error, and is compared by its mean: "shift" with its standard error over all pairs, and
the chance of one so large if in each pair it did not matter which build made which run. Two of
the sets have grains of several sizes, one adhesion and smooth walls, and one clumps.
"""

import argparse
import os
import shlex
import subprocess
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from benchmarks.common import rounded, write
from calibrator.case.toml import read_case
from calibrator.case.vocabulary import SCRIPTS
from calibrator.runs.database import Database
from calibrator.runs.local import clean_environment
from calibrator.runs.record import InvalidRecord, Record, read_record
from calibrator.runs.request import Request, write_table

REPO = Path(__file__).resolve().parents[2]
CASE = REPO / "cases" / "missing_effect.toml"
SHIPPED = {b: REPO / "grid" / f"versions{s}.csv" for b, s in (("first", ""), ("second", "_second"))}
SEEDS = (77_001, 77_002, 77_003)
EFFECTS: dict[int, dict] = {
    6: {"size_spread": 0.1},
    7: {"size_spread": 0.2},
    8: {"bond_number": 1.0, "wall_friction_ratio": 0.5},
    9: {"clump_aspect": 1.2},
}
RESPONSES = {
    "hourglass": (
        "bulk_density", "drained_equivalent_angle_deg", "residual_fraction", "mass_flow_rate",
    ),
    "ledge": ("bulk_density", "ledge_equivalent_angle_deg", "residual_fraction"),
    "conical_pile": ("bulk_density", "pile_equivalent_angle_deg", "pile_angle_of_repose_deg"),
}  # fmt: skip
LONGEST = 900  # seconds of one run
EQUAL = 1e-9


def requests(setup: str, seeds: int) -> list[Request]:
    """The runs of one set-up: ten points of the case's box, so many seeds each."""
    problem = read_case(CASE).problem
    points = qmc.scale(qmc.Halton(2, seed=1).random(10), problem.low, problem.high)
    fixed = {**problem.fixed, **problem.setups[setup]}
    return [
        Request.of(
            setup, **fixed, **dict(zip(problem.names, map(float, point), strict=True)),
            **EFFECTS.get(i, {}), seed=seed,
        )
        for i, point in enumerate(points) for seed in SEEDS[:seeds]
    ]  # fmt: skip


def carried_out(build: str, prefix: str, request: Request) -> Record:
    """One run, without yade-batch: the driver looks for YADE on the PATH only."""
    folder = REPO / "results" / "versions" / build
    record = folder / "records" / f"{request.run_id}.json"
    try:
        return read_record(record, request)
    except (FileNotFoundError, InvalidRecord):
        folder.mkdir(parents=True, exist_ok=True)
    write_table(folder / f"{request.run_id}.table", [request])
    # A chroot starts in the root of its tree.
    go = [*shlex.split(prefix), "sh", "-c", 'cd "$0" && exec yade -n -x -j1 "$1"', str(folder)]
    done = subprocess.run(
        [*go, str(SCRIPTS / f"{request.setup}.py")],
        env={**clean_environment(LONGEST), "YADE_BATCH": f"{request.run_id}.table:2"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=LONGEST,
    )
    try:
        return read_record(record, request)
    except FileNotFoundError:
        output = done.stdout.decode(errors="replace")
        raise SystemExit(f"the {build} yade left no record; it said:\n{output[-2000:]}") from None


def runs(build: str, prefix: str | None, wanted: list[Request]) -> dict[str, Record]:
    """The shipped runs of a build, and those that are missing there, by run id."""
    path = SHIPPED[build]
    known = Database.read(path).records if path.exists() else {}
    missing = [r for r in wanted if r.run_id not in known]
    if missing and prefix is None:
        lack = f"{path.name} lacks {len(missing)} runs"
        raise SystemExit(f"{lack}: say with --second how to make them")
    with ThreadPoolExecutor(int(os.environ.get("WORKERS", 2))) as pool:
        new = list(pool.map(lambda r: carried_out(build, prefix or "", r), missing))
    if new:
        Database([*known.values(), *new]).write(path, "python -m benchmarks.runs.versions")
    return {**known, **{r.run_id: r for r in new}}


def equal(one: Record, other: Record) -> bool:
    """Whether two runs went the same way: the same steps, and responses but for rounding."""
    if one.diagnostics.get("steps") != other.diagnostics.get("steps"):
        return False
    a, b = one.responses, other.responses
    return a.keys() == b.keys() and all(np.isclose(a[n], b[n], EQUAL, EQUAL) for n in a)


def paired_p(change: np.ndarray, times: int = 10_000) -> float:
    """Chance of a mean change at least this large if the sign of each pair's were drawn by lot."""
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (times, len(change)))
    drawn = np.abs(signs @ change) >= np.abs(change.sum()) * (1 - 1e-12)
    return float((1 + drawn.sum()) / (1 + times))


def compared(setup: str, pairs: list[tuple[Record, Record]]) -> dict:
    """Of one set-up: how many runs are equal, and the mean change of each response."""
    out: dict = {
        "pairs": len(pairs),
        "equal": sum(equal(*pair) for pair in pairs),
        "statuses": [Counter(r.status for r in side) for side in zip(*pairs, strict=True)],
        "responses": {},
    }
    for name in RESPONSES[setup]:
        values = np.array([[r.responses.get(name, np.nan) for r in pair] for pair in pairs])
        values = values[np.isfinite(values).all(1)]
        change = values[:, 1] - values[:, 0]
        mean, error = values[:, 0].mean(), change.std(ddof=1) / np.sqrt(len(change))
        out["responses"][name] = {
            "pairs": len(values),
            "mean": rounded(mean),
            "shift_percent": rounded(100 * change.mean() / mean, 2),
            "standard_error_percent": rounded(100 * error / mean, 2),
            "p_value": rounded(paired_p(change), 2),
        }
    return out


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--second", metavar="COMMAND", help="what reaches the second yade")
    count = dict(type=int, choices=range(1, len(SEEDS) + 1), default=len(SEEDS))
    parser.add_argument("--seeds", **count, help="runs of each parameter set (3)")
    return parser.parse_args()


def main() -> None:
    """Run what is missing and compare."""
    given = arguments()
    asked = {setup: requests(setup, given.seeds) for setup in RESPONSES}
    wanted = [r for own in asked.values() for r in own]
    found = [runs("first", "", wanted), runs("second", given.second, wanted)]
    versions = [sorted({side[r.run_id].provenance["yade"] for r in wanted}) for side in found]
    plain = {r.run_id for r in wanted if not {"size_spread", "clump_aspect"} & set(r.parameters)}
    results: dict = {"yade": versions, "seeds": given.seeds}
    for setup, own in asked.items():
        pairs = {r.run_id: (found[0][r.run_id], found[1][r.run_id]) for r in own}
        results[setup] = compared(setup, list(pairs.values()))
        results[setup]["equal_of_plain_spheres"] = [
            sum(equal(*pair) for i, pair in pairs.items() if i in plain),
            sum(i in plain for i in pairs),
        ]
    write("versions", results)


if __name__ == "__main__":
    main()
