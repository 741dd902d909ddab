"""Only E / (rho_p g d) matters: pairs of runs that similarity calls the same.

    python -m benchmarks.runs.similarity      40 core-minutes where no run is shipped

Compares the runs of grid/similarity.csv, of the reduced paper case, and makes those that it lacks;
writes it and benchmarks/results/similarity.json.

"exact": density, Young's modulus, filled mass and rest threshold doubled. Doubling rounds nothing,
so every trajectory and response must be the same to the last bit, masses doubled. "in use": the
ends of the case's own density range at the same E / rho_p and the same filled mass, which is what
taking the density out of the interpolation assumes. The lighter grains are then a few more, which
leaves a difference beside the seed noise; its mean over the sets is "in_use_mean".
"""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import shipped_or_run, write
from calibrator.case.toml import read_case
from calibrator.case.vocabulary import RESPONSES
from calibrator.runs.folder import RunFolder
from calibrator.runs.record import Record
from calibrator.runs.request import Request

REPO = Path(__file__).resolve().parents[2]
FOLDER = RunFolder(REPO / "results" / "similarity")
SHIPPED = REPO / "grid" / "similarity.csv"
# rolling and sliding friction
SETS = {"low": (0.1, 0.2), "middle": (0.3, 0.45), "high": (0.5, 0.7)}
LIGHT, HEAVY = 2600.0, 2800.0
SOFT = 5e6  # of the light grains [Pa]
KEYS = ("bulk_density", "drained_equivalent_angle_deg", "mass_flow_rate")
FIRST_SEED, SEEDS = 830_001, 4


def requests() -> dict[str, dict[str, list[Request]]]:
    """{set: {kind of run: requests}}."""
    small = read_case(REPO / "cases" / "quartz_sand_reduced.toml").problem.setups["hourglass"]
    found: dict[str, dict[str, list[Request]]] = {}
    for label, (rolling, sliding) in SETS.items():
        base = {
            **small,
            "rolling_friction": rolling,
            "sliding_friction": sliding,
            "particle_radius": 0.4e-3,
        }
        light = {**base, "particle_density": LIGHT, "young_modulus": SOFT}
        doubled = {
            "particle_density": 2 * LIGHT,
            "young_modulus": 2 * SOFT,
            "rest_kinetic_energy": 2e-15,
        }
        doubled["fill_mass"] = 2 * float(small["fill_mass"])
        heavy = {**base, "particle_density": HEAVY, "young_modulus": SOFT * HEAVY / LIGHT}
        seeds = range(FIRST_SEED, FIRST_SEED + SEEDS)
        found[label] = {
            "light": [Request.of("hourglass", **light, seed=s) for s in seeds],
            "doubled": [Request.of("hourglass", **{**light, **doubled}, seed=FIRST_SEED)],
            "heavy": [Request.of("hourglass", **heavy, seed=s) for s in seeds],
        }
    return found


def exact(light: Record, doubled: Record) -> bool:
    """Whether two runs are the same bit for bit, masses doubled.

    Two that clogged have fewer responses to be the same.
    """
    expected = {n: v * (2 if "kg" in RESPONSES[n].unit else 1) for n, v in light.responses.items()}
    return light.status == doubled.status in ("ok", "clogged") and doubled.responses == expected


def in_use(light: list[Record], heavy: list[Record]) -> dict[str, dict[str, float]]:
    """{response: relative difference of the means once masses are scaled, and its error}."""
    found = {}
    for name in KEYS:
        factor = HEAVY / LIGHT if "kg" in RESPONSES[name].unit else 1.0
        a, b = (
            np.array([r.responses[name] for r in own if r.status == "ok"]) for own in (light, heavy)
        )
        b = b / factor
        error = np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b))
        found[name] = {
            "difference": float(b.mean() / a.mean() - 1),
            "standard_error": float(error / a.mean()),
        }
    return found


def mean_over_sets(found: list[dict[str, dict[str, float]]]) -> dict[str, dict[str, float]]:
    """Mean (n sets) of each response's difference, weighted by the standard errors."""
    means = {}
    for name in KEYS:
        weights = np.array([own[name]["standard_error"] ** -2.0 for own in found])
        difference = np.average([own[name]["difference"] for own in found], weights=weights)
        means[name] = {
            "difference": float(difference),
            "standard_error": float(weights.sum() ** -0.5),
        }
    return means


def main() -> None:
    """Run what is missing, then compare."""
    asked = requests()
    wanted = [r for own in asked.values() for kind in own.values() for r in kind]
    records = shipped_or_run(SHIPPED, FOLDER, wanted, "python -m benchmarks.runs.similarity")
    by_id = {r.run_id: r for r in records}
    found: dict[str, Any] = {}
    for label, own in asked.items():
        light, doubled, heavy = (
            [by_id[r.run_id] for r in own[kind]] for kind in ("light", "doubled", "heavy")
        )
        found[label] = {"exact": exact(light[0], doubled[0]), "in_use": in_use(light, heavy)}
    mean = mean_over_sets([own["in_use"] for own in found.values()])
    write(
        "similarity",
        {
            "sets": found,
            "in_use_mean": mean,
            "grid_runs_with_density": 810,
            "grid_runs_without": 270,
        },
    )


if __name__ == "__main__":
    main()
