"""What small vessels do to each response, in the runs that come with the project.

    python -m benchmarks.numerics.smallest_vessels    some seconds; no run is made

Writes benchmarks/results/smallest_vessels.json; `measurement_page` puts it into the tables of
docs/own_measurement.md. A heap's height in grains is `heap_height` of its equivalent angle. Scatter
is that of single runs that differ in their seed only, pooled over sets.
"""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from benchmarks.common import rounded, write
from calibrator.case.physics import GRAVITY
from calibrator.case.vocabulary import PARAMETERS
from calibrator.foresight.smallest import heap_height
from calibrator.runs import setups
from calibrator.runs.database import Database
from calibrator.runs.record import Record

GRID = Path(__file__).resolve().parents[2] / "grid"
DATABASES = (
    "coarse_sand",
    "coarse_sand_lab_runs",
    "heap_step",
    "hourglass_scale",
    "ledge_full_scale",
    "missing_effect",
    "pile_scale",
    "quartz_sand_adaptive",
    "quartz_sand_reduced",
    "quartz_sand_reduced_grid",
    "quartz_sand_reduced_validation",
    "quartz_sand_reduced_verification",
    "rolling_stiffness",
    "similarity",
    "versions",
)
RESTITUTION = 0.9  # of all but the runs with another one
HEIGHTS = (0.0, 3.0, 4.0, 6.0, 8.0, 20.0)  # of heaps, in grains
NECKS = (6.0, 6.5, 7.1, 7.7, 12.0)  # in grain diameters; 7.1 keeps the necks of 7 together
ROUGH = (0.3, 0.45)  # rolling and sliding friction from which on necks are counted apart
OPTIONAL = tuple(n for n, q in PARAMETERS.items() if q.unmentioned)
FITTED, EQUIVALENT = "pile_angle_of_repose_deg", "pile_equivalent_angle_deg"
CRATER, CRATER_EQ = "drained_angle_of_repose_deg", "drained_equivalent_angle_deg"
LEDGE, LEDGE_EQ = "ledge_angle_of_repose_deg", "ledge_equivalent_angle_deg"
TIMES = ("mass_flow_rate", "emptying_time", "discharge_time")
SMOOTH, STEEP = (0.1, 0.3), (0.4, 0.7)


def records(*names: str) -> list[Record]:
    """All runs of the databases, each once."""
    found = [r for n in names for r in Database.read(GRID / f"{n}.csv").records.values()]
    return list({r.run_id: r for r in found}.values())


def number(run: Record, name: str) -> float:
    """A parameter of a run."""
    return float(setups.numbers(run.request)[name])


def is_plain(run: Record, but: str = "") -> bool:
    """Whether a run has no effect and the usual restitution; `but` : may be as it is."""
    given = run.request.parameters
    effects = [n for n in OPTIONAL if n in given and n != but]
    return not effects and (given["restitution"] == RESTITUTION or but == "restitution")


def diameters(run: Record, name: str) -> float:
    """A length of a run in grain diameters."""
    return number(run, name) / (2 * number(run, "particle_radius"))


def height(run: Record) -> float:
    """Of a heap, in grains."""
    return heap_height(setups.particles(run.request), run.responses[EQUIVALENT])


def slope(run: Record) -> float:
    """Length of a crater's slope in grain diameters."""
    return (diameters(run, "cylinder_diameter") - diameters(run, "neck_diameter")) / 2


def good(runs: Iterable[Record], setup: str, *names: str) -> list[Record]:
    """Successful runs of a set-up that have these responses."""
    return [
        r
        for r in runs
        if r.request.setup == setup and r.status == "ok" and all(n in r.responses for n in names)
    ]


def scatter(runs: Iterable[Record], name: str, relative: bool = False) -> float | None:
    """Standard deviation of a response over seeds, pooled over sets; or its share of the mean."""
    sets = defaultdict(list)
    for r in runs:
        key = tuple(sorted((n, v) for n, v in r.request.parameters.items() if n != "seed"))
        sets[key].append(r.responses[name])
    many = [np.array(v) / (np.mean(v) if relative else 1) for v in sets.values() if len(v) > 1]
    free = sum(len(v) - 1 for v in many)
    if not free:
        return None
    return rounded(math.sqrt(sum(float(v.var(ddof=1)) * (len(v) - 1) for v in many) / free), 3)


def compared(runs: list[Record], fitted: str, equivalent: str) -> dict[str, Any]:
    """The fitted angle beside the equivalent one."""
    gap = np.array([r.responses[fitted] - r.responses[equivalent] for r in runs])
    return {
        "runs": len(runs),
        "grains": [f(setups.particles(r.request) for r in runs) for f in (min, max)],
        "fitted_minus_equivalent": rounded(float(gap.mean()), 3),
        "lowest": rounded(float(gap.min()), 3),
        "highest": rounded(float(gap.max()), 3),
        "scatter_fitted": scatter(runs, fitted),
        "scatter_equivalent": scatter(runs, equivalent),
    }


def by_size(
    runs: list[Record], size: Callable[[Record], float], edges: tuple[float, ...], *angles: str
) -> dict[str, Any]:
    """`compared` between the edges, where there are runs."""
    found = {}
    for low, high in itertools.pairwise(edges):
        if own := [r for r in runs if low <= size(r) < high]:
            sizes = [size(r) for r in own]
            extent = {"from": rounded(min(sizes), 3), "to": rounded(max(sizes), 3)}
            found[f"{low:g} to {high:g}"] = {**extent, **compared(own, *angles)}
    return found


def heap_sizes(runs: list[Record], small: list[Record]) -> dict[str, Any]:
    """Heaps of the same grains in larger vessels, and from slower lifts."""
    found = defaultdict(list)
    for r in [*good(runs, "conical_pile", FITTED), *good(small, "conical_pile", FITTED)]:
        p = r.request.parameters
        pair = (p["rolling_friction"], p["sliding_friction"])
        usual = "time_step" not in p or p["time_step"] == 0
        if pair in (SMOOTH, STEEP, (0.327, 0.429)) and usual:
            key = (*pair, setups.particles(r.request), 1e3 * number(r, "lift_speed"))
            found[key].append(r)
    return {
        f"{mu_r:g}, {mu_s:g}, {grains} grains, {speed:g} mm/s": {
            "runs": len(own),
            "height": rounded(float(np.mean([height(r) for r in own])), 3),
            "speed_over_root_gd": rounded(
                1e-3 * speed / math.sqrt(GRAVITY * 2 * number(own[0], "particle_radius")), 3
            ),
            **{n: mean_of(own, n) for n in (FITTED, EQUIVALENT, "bulk_density")},
        }
        for (mu_r, mu_s, grains, speed), own in sorted(found.items())
    }


def mean_of(runs: list[Record], name: str) -> dict[str, Any]:
    """Mean of a response and its standard error, where there are several runs."""
    values = np.array([r.responses[name] for r in runs])
    error = float(values.std(ddof=1) / math.sqrt(len(values))) if len(values) > 1 else None
    return {
        "mean": rounded(float(values.mean()), 5),
        "standard_error": None if error is None else rounded(error, 2),
    }


def necks(runs: list[Record]) -> dict[str, Any]:
    """How many hourglasses clogged, by their neck in grain diameters and by friction."""
    found = {}
    for low, high in itertools.pairwise(NECKS):
        for rough in (False, True):
            own = [
                r
                for r in runs
                if r.request.setup == "hourglass"
                and low <= diameters(r, "neck_diameter") < high
                and rough
                == (
                    number(r, "rolling_friction") >= ROUGH[0]
                    and number(r, "sliding_friction") >= ROUGH[1]
                )
            ]
            clogged, sizes = (
                sum(r.status == "clogged" for r in own),
                [diameters(r, "neck_diameter") for r in own],
            )
            interval = stats.binomtest(clogged, len(own)).proportion_ci()
            found[f"{low:g} to {high:g}, {'rough' if rough else 'others'}"] = {
                "from": rounded(min(sizes), 3),
                "to": rounded(max(sizes), 3),
                "runs": len(own),
                "clogged": clogged,
                "interval": [rounded(interval.low, 2), rounded(interval.high, 2)],
            }
    return found


def times(runs: list[Record]) -> dict[str, Any]:
    """Relative scatter of rates and times, by the number of grains and the neck."""
    found = {}
    for label, low, high, least, most in (
        ("811 grains, neck 7", 800, 900, 6.9, 7.1),
        ("811 grains, neck 9", 800, 900, 8.9, 9.1),
        ("1441 grains, neck 7", 1400, 1500, 6.9, 7.1),
        ("1599 to 4080 grains, neck 7.5 to 10", 1590, 4200, 7.4, 10.1),
    ):
        own = [
            r
            for r in good(runs, "hourglass", *TIMES)
            if low <= setups.particles(r.request) <= high
            and least <= diameters(r, "neck_diameter") <= most
        ]
        found[label] = {
            **{n: scatter(own, n, relative=True) for n in TIMES},
            "onset_delay_s": scatter(own, "onset_delay"),
            "bulk_density": scatter(own, "bulk_density", relative=True),
        }
    return found


def fills(small: list[Record]) -> dict[str, Any]:
    """The demo's hourglass with less and more in it; of clogged runs there is the density only."""
    found = defaultdict(list)
    for r in small:
        if r.request.setup == "hourglass":
            found[1e3 * number(r, "fill_mass")].append(r)
    names = ("mass_flow_rate", "late_early_ratio", "drained_equivalent_angle_deg", "bulk_density")
    section = math.pi / 4 * number(found[16.0][0], "cylinder_diameter") ** 2
    summary = {}
    for mass, own in sorted(found.items()):
        density = float(np.mean([r.responses["bulk_density"] for r in own]))
        neck = number(own[0], "neck_diameter")
        summary[f"{mass:g} g"] = {
            "runs": len(own),
            "clogged": sum(r.status == "clogged" for r in own),
            "height_over_neck": rounded(1e-3 * mass / density / section / neck, 3),
            **{n: mean_of(own, n) for n in names if all(n in r.responses for r in own)},
        }
    return summary


def main() -> None:
    """Look at every shipped run."""
    runs, small = [r for r in records(*DATABASES) if is_plain(r)], records("small_vessels")
    ledges, craters = good(runs, "ledge", LEDGE), good(runs, "hourglass", CRATER)
    write(
        "smallest_vessels",
        {
            "heaps": by_size(
                good([*runs, *small], "conical_pile", FITTED), height, HEIGHTS, FITTED, EQUIVALENT
            ),
            "heap_sizes": heap_sizes(runs, small),
            "ledges": by_size(
                ledges, lambda r: diameters(r, "box_length"), (0, 13, 16, 25), LEDGE, LEDGE_EQ
            ),
            "craters": by_size(craters, slope, (0, 3.5, 4.2, 7, 20), CRATER, CRATER_EQ),
            "necks": necks(runs),
            "times": times(runs),
            "fills": fills(small),
        },
    )


if __name__ == "__main__":
    main()
