"""What grains that are softer, and so cheaper, do to heaps, slopes, flows and drums.

    python -m benchmarks.runs.softness run [SETUP ...]   YADE's: two hours of a slow core; resumes
    python -m benchmarks.runs.softness                   compares what there is

Softness is the pressure at the bottom of the fill over Young's modulus, as `calibrator init` counts
it; set-ups, frictions and seeds are those of benchmarks/runs/rolling_stiffness.py, and the drum is
the default one with fewer of them. Writes grid/softness.csv and benchmarks/results/softness.json:
each response at each softness less that at the least, over it or in degrees, and the share of its
cost. A p value is that of a t test with the variance between seeds pooled by friction pair.
"""

import sys
from pathlib import Path

import numpy as np

from benchmarks.common import rounded, write
from benchmarks.runs.rolling_stiffness import PAIRS, RESPONSES, SEEDS, Samples, difference
from benchmarks.runs.rolling_stiffness import parameters as of_small_set_up
from calibrator.case.physics import GRAVITY
from calibrator.first_case.files import fill_height
from calibrator.first_case.grains import SOFTNESS
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.setups import NOMINAL_FRACTION, numbers, steps
from calibrator.terminal import ProgressBar

REPO = Path(__file__).resolve().parents[2]
FOLDER = RunFolder(REPO / "results" / "softness")
SHIPPED = REPO / "grid" / "softness.csv"
COMMAND = "python -m benchmarks.runs.softness"
DRUM = "rotating_drum"
OF_DRUM = ("drum_angle_deg", "drum_upper_angle_deg", "drum_lower_angle_deg")
OBSERVED = {**RESPONSES, DRUM: OF_DRUM}


def request(setup: str, pair: tuple[float, float], softness: float, seed: int) -> Request:
    """One run, whose Young's modulus is the pressure under its fill over the softness."""
    frictions = {"rolling_friction": pair[0], "sliding_friction": pair[1]}
    own = {**frictions, "seed": seed} if setup == DRUM else of_small_set_up(setup, pair, seed)
    young = pressure(numbers(Request.of(setup, **own))) / softness
    return Request.of(setup, **{**own, "young_modulus": float(f"{young:.3g}")})


def pressure(p: dict[str, float]) -> float:
    """Pressure [Pa] at the bottom of a fill."""
    return NOMINAL_FRACTION * p["particle_density"] * GRAVITY * fill_height(p)


def wanted(setup: str) -> list[Request]:
    """All runs of a set-up, a seed at a time."""
    pairs, seeds = (PAIRS[::2], SEEDS[:3]) if setup == DRUM else (PAIRS, SEEDS)
    return [request(setup, p, s, seed) for seed in seeds for p in pairs for s in SOFTNESS]


def finished(setup: str) -> list[Record]:
    """Its runs, shipped or made here."""
    own = wanted(setup)
    shipped = Database.read(SHIPPED).find(own) if SHIPPED.exists() else []
    return list({r.run_id: r for r in [*shipped, *gather(FOLDER, own)]}.values())


def run_yade(setups: list[str]) -> None:
    """Make what is missing."""
    for setup in setups:
        known = {r.run_id for r in finished(setup)}
        missing = [r for r in wanted(setup) if r.run_id not in known]
        if missing:
            run(FOLDER, missing, report=ProgressBar(sys.stderr, setup))
        Database([r for s in OBSERVED for r in finished(s)]).write(SHIPPED, f"{COMMAND} run")


def softness_of(record: Record) -> float:
    """Which softness a run has."""
    p = numbers(record.request)
    return min(SOFTNESS, key=lambda s: abs(np.log(s * p["young_modulus"] / pressure(p))))


def samples(setup: str, response: str) -> Samples:
    """Values by friction pair and softness; of what is no angle their logarithms."""
    found: Samples = {}
    for r in finished(setup):
        if r.status != "ok" or response not in r.responses:
            continue
        pair = (r.request.value("rolling_friction"), r.request.value("sliding_friction"))
        value = r.responses[response]
        values = found.setdefault(pair, {}).setdefault(f"{softness_of(r):g}", np.empty(0))
        found[pair][f"{softness_of(r):g}"] = np.append(
            values, value if response.endswith("_deg") else np.log(value)
        )
    return found


def judge() -> None:
    """Compare what there is."""
    least, found = f"{SOFTNESS[0]:g}", {}
    for setup, names in OBSERVED.items():
        for name in names:
            own = samples(setup, name)
            apart = {f"{s:g}": difference(own, f"{s:g}", least) for s in SOFTNESS[1:]}
            if any(apart.values()):
                found[f"{setup}.{name}"] = apart
    dear = wanted("conical_pile")[: len(SOFTNESS)]
    share = {
        f"{s:g}": rounded(steps(r) / steps(dear[0]), 3) for s, r in zip(SOFTNESS, dear, strict=True)
    }
    ends: dict[str, int] = {}
    for r in (r for setup in OBSERVED for r in finished(setup)):
        ends[f"{r.request.setup} {r.status}"] = ends.get(f"{r.request.setup} {r.status}", 0) + 1
    write("softness", {"ends": ends, "steps_over_stiff": share, "less_stiff": found})


if __name__ == "__main__":
    if sys.argv[1:2] == ["run"]:
        run_yade(sys.argv[2:] or list(OBSERVED))
    judge()
