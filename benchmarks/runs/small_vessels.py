"""What a slower lift does to a heap, and a lower or higher fill to a discharge.

    python -m benchmarks.runs.small_vessels [N]   N runs at a time, ten core-minutes; resumes

Makes what grid/small_vessels.csv lacks, and writes it. Grains and the heap are those of
cases/missing_effect.toml, whose heaps are lifted at 40 mm/s and are the other half of the
comparison; the hourglass is the demo's. `python -m benchmarks.numerics.smallest_vessels` compares.
"""

import sys
from pathlib import Path

from calibrator.case.toml import read_case
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

REPO = Path(__file__).resolve().parents[2]
FOLDER = RunFolder(REPO / "results" / "small_vessels")
SHIPPED = REPO / "grid" / "small_vessels.csv"
COMMAND = "python -m benchmarks.runs.small_vessels"
SMOOTH, ROUGH = (0.1, 0.3), (0.4, 0.7)  # rolling and sliding friction, as in rolling_stiffness
FLOWING = (0.2, 0.4)
SLOWER, SLOW = 5e-3, 10e-3  # lifts [m/s]
FILLS = {8e-3: 2, 16e-3: 2, 32e-3: 1}  # of the demo's hourglass [kg]: seeds
FIRST_SEED = 860_001
# friction pair, speed of the lift, seeds
HEAPS = (
    (SMOOTH, SLOW, 2),
    (SMOOTH, SLOWER, 1),
    (ROUGH, SLOW, 1),
)


def heaps(pair: tuple[float, float], speed: float, seeds: int) -> list[Request]:
    """The small heap with another lift."""
    shape = read_case(REPO / "cases" / "missing_effect.toml").problem.setups["conical_pile"]
    return _requests("conical_pile", pair, {**shape, "lift_speed": speed}, seeds)


def hourglasses(fill_mass: float, seeds: int) -> list[Request]:
    """The demo's hourglass with another fill."""
    shape = read_case(REPO / "cases" / "coarse_sand.toml").problem.setups["hourglass"]
    return _requests("hourglass", FLOWING, {**shape, "fill_mass": fill_mass}, seeds)


def _requests(
    setup: str, pair: tuple[float, float], shape: dict[str, float], seeds: int
) -> list[Request]:
    grains = read_case(REPO / "cases" / "missing_effect.toml").problem.fixed
    frictions = dict(rolling_friction=pair[0], sliding_friction=pair[1])
    return [
        Request.of(setup, **{**grains, **shape, **frictions, "seed": FIRST_SEED + i})
        for i in range(seeds)
    ]


def blocks() -> list[list[Request]]:
    """All runs: heaps, then hourglasses."""
    flows = [r for fill, seeds in FILLS.items() for r in hourglasses(fill, seeds)]
    return [[r for one in HEAPS for r in heaps(*one)], flows]


def finished() -> list[Record]:
    """Runs that are shipped or were made here."""
    wanted = [r for block in blocks() for r in block]
    shipped = Database.read(SHIPPED).find(wanted) if SHIPPED.exists() else []
    return list({r.run_id: r for r in [*shipped, *gather(FOLDER, wanted)]}.values())


def main() -> None:
    """Make what is missing, block by block."""
    jobs = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    for block in blocks():
        known = {r.run_id for r in finished()}
        if missing := [r for r in block if r.run_id not in known]:
            run(FOLDER, missing, jobs=jobs, report=ProgressBar(sys.stderr))
            Database(finished()).write(SHIPPED, COMMAND)


if __name__ == "__main__":
    main()
