"""How large may the time step be for inelastic grains, whose contacts are strongly damped?

    python -m benchmarks.runs.damped_step beds      about 3 core-hours, resumable
    python -m benchmarks.runs.damped_step setups    about 1 core-hour, resumable
    python -m benchmarks.runs.damped_step           writes what is there

Writes benchmarks/results/damped_step.json and .png, and grid/damped_step.csv and
grid/damped_step_setups.csv. `beds` are 300 grains poured into a vessel of 6 diameters
(damped_step_scene.py) at steps on a ladder of sqrt(2), and at the scripts' bound: stable is a bed
that comes to rest, "restless" one that does not within 30 sqrt(d/g), and "explodes" one in which a
grain is three times as fast as gravity can make it. `setups` are the three set-ups with the
scripts' own step, and with a fifth of the Rayleigh time.
"""

import argparse
import csv
import json
import subprocess
from pathlib import Path

import matplotlib
import numpy as np

from benchmarks.common import RESULTS, write
from calibrator.case.physics import damped_step, damping_ratio, rayleigh_time
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

matplotlib.use("Agg")
import sys

import matplotlib.pyplot as plt

REPO = Path(__file__).resolve().parents[2]
WORK = REPO / "results" / "damped_step"
SCENE = Path(__file__).with_name("damped_step_scene.py")
LADDER = sorted([0.01 * 2 ** (k / 2) for k in range(13)] + [0.4, 0.9])
GRAINS = {  # Young's modulus [Pa], radius [m], density [kg/m3]
    "soft": (4e6, 3e-3, 4000.0),
    "medium": (1.4e7, 3e-3, 4000.0),
    "stiff": (1.4e7, 4e-4, 2650.0),
}
ALL = (0.1, 0.2, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
COLUMNS = ("young_modulus", "particle_radius", "particle_density", "restitution", "share", "seed")
FOUND = ("fastest", "overlap", "settled", "time", "steps", "kinetic")


def shares(restitution: float) -> list[float]:
    """Steps to try, as shares of the Rayleigh time: about where the damping becomes unstable."""
    if restitution > 0.65:
        return [0.4, 0.64, 0.9]
    ratio = damping_ratio(restitution)
    return [s for s in LADDER if 0.045 <= s * ratio <= 0.26]


# grains, restitution, share, seeds: at the scripts' bound, and where a law for all would have it
EXTRA = [
    ("soft", 0.3, 0.0649, (3, 4, 5, 6)),
    ("soft", 0.35, 0.088, (3, 4, 5, 6)),
    ("soft", 0.4, 0.1149, (3, 4, 5, 6)),
    ("medium", 0.3, 0.08, (3, 4, 5, 6)),
    ("medium", 0.4, 0.1416, (3, 4, 5, 6)),
    ("medium", 0.2, 0.0419, (1,)),
    ("medium", 0.1, 0.0179, (1,)),
]


def beds(odd: int) -> list[list]:
    """[key, numbers] of every bed with an odd (1) or even (0) seed."""
    cases = []
    wanted = [(n, e, s, (1, 2)) for n in GRAINS for e in ALL for s in shares(e)] + EXTRA
    for name, e, share, seeds in wanted:
        for seed in seeds:
            values = (*GRAINS[name], e, share, seed)
            key = " ".join(f"{v:.4g}" for v in values)
            if seed % 2 == odd:
                cases.append([key, dict(zip(COLUMNS, values, strict=True))])
    return cases


def run_beds() -> None:
    """Make what is missing, on two cores."""
    WORK.mkdir(parents=True, exist_ok=True)
    started = []
    for seed in (0, 1):
        (WORK / f"beds_{seed}.json").write_text(json.dumps(beds(seed)))
        files = f"beds_{seed}.json:beds_{seed}.jsonl"
        command = ["env", f"DAMPED_STEP={files}", "yade", "-n", "-x", "-j1", str(SCENE)]
        started.append(subprocess.Popen(command, cwd=WORK, stdin=subprocess.DEVNULL))
    for one in started:
        one.wait()


def read_beds() -> list[dict]:
    """What has been measured: the CSV, and what the work folder has beyond it."""
    rows = {}
    for path in [REPO / "grid" / "damped_step.csv"] * (REPO / "grid" / "damped_step.csv").exists():
        lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
        for row in csv.DictReader(lines):
            rows[tuple(float(row[c]) for c in COLUMNS)] = {n: float(v) for n, v in row.items()}
    for path in WORK.glob("beds_*.jsonl"):
        for line in path.read_text().splitlines():
            row = {n: float(v) for n, v in json.loads(line).items() if n not in ("key", "kind")}
            row["share"] = float(f"{row['share']:.4g}")
            rows[tuple(row[c] for c in COLUMNS)] = row
    return [rows[k] for k in sorted(rows)]


def write_csv(rows: list[dict]) -> None:
    """The beds as grid/damped_step.csv."""
    lines = [
        "# beds of 300 grains poured at a share of the Rayleigh time: python -m"
        " benchmarks.runs.damped_step beds",
        "# units: Pa, m, kg/m3, 1, 1, 1; largest speed over that of free fall, largest overlap over"
        " the radius, whether it came to rest, time over sqrt(d/g), steps, mean kinetic energy over"
        " that at which a filling counts as settled",
        ",".join([*COLUMNS, *FOUND]),
    ]
    lines += [",".join(f"{row[c]:.4g}" for c in (*COLUMNS, *FOUND)) for row in rows]
    (REPO / "grid" / "damped_step.csv").write_text("\n".join(lines) + "\n")


def outcome(row: dict) -> str:
    """What became of a bed."""
    return "stable" if row["settled"] else "explodes" if row["fastest"] > 3 else "restless"


def limits(rows: list[dict]) -> list[dict]:
    """For grains and restitution: the largest share below all unstable ones, the smallest of them.

    And the law's share, and the larger of what `time_step` was bounded by before.
    """
    found = []
    for name, (young, radius, density) in GRAINS.items():
        for e in ALL:
            own = [
                r
                for r in rows
                if (r["young_modulus"], r["particle_radius"], r["restitution"])
                == (young, radius, e)
            ]
            bad = {r["share"] for r in own if outcome(r) != "stable"}
            good = {r["share"] for r in own if r["share"] < min(bad, default=np.inf)}
            p = dict(young_modulus=young, particle_radius=radius, particle_density=density)
            p.update(poisson_ratio=0.3, restitution=e)
            crossing = float(rayleigh_time({n: np.array(v) for n, v in p.items()}))
            found.append(
                {
                    "grains": name,
                    "stiffness_number": young / (density * 9.81 * 2 * radius),
                    "restitution": e,
                    "beds": len(own),
                    "explode": sum(outcome(r) == "explodes" for r in own),
                    "largest_stable": max(good, default=None),
                    "smallest_unstable": min(bad, default=None),
                    "law": damped_step(p) / crossing,
                }
            )
    return [f for f in found if f["beds"]]


def setup_requests() -> list[Request]:
    """Three small set-ups of the softest grains, with the scripts' own step and with 0.2."""
    radius, (young, _, density) = 1.5e-3, GRAINS["soft"]
    common = dict(young_modulus=young, particle_radius=radius, particle_density=density)
    setups = {
        "hourglass": dict(fill_mass=0.017, cylinder_diameter=0.027, neck_diameter=0.015),
        "ledge": dict(box_length=0.027, box_width=0.012, fill_height=0.018),
        "conical_pile": dict(cylinder_diameter=0.024, fill_height=0.02),
    }
    made = []
    for e in (0.3, 0.4, 0.5):
        for setup, geometry in setups.items():
            numbers = {**common, **geometry, "restitution": e, "seed": 81_001}
            made.append(Request.of(setup, **numbers))
            p = {n: v for n, v in made[-1].parameters.items() if not isinstance(v, str)}
            fifth = 0.2 * float(rayleigh_time({n: np.array(v) for n, v in p.items()}))
            if e < 0.45:
                made.append(Request.of(setup, **numbers, time_step=fifth))
    return made


def run_setups() -> None:
    """Make what is missing; that many of them fail is the point."""
    run(
        RunFolder(WORK / "setups"),
        setup_requests(),
        2,
        1,
        report=ProgressBar(sys.stderr, "set-ups"),
        go_on=True,
    )


def read_setups() -> list[dict]:
    """Restitution, set-up, step and status of every run of a set-up that is there."""
    path, requests = REPO / "grid" / "damped_step_setups.csv", setup_requests()
    there = Database.read(path).records if path.exists() else {}
    here = {r.run_id: r for r in gather(RunFolder(WORK / "setups"), requests)}
    records = [{**there, **here}[r.run_id] for r in requests if r.run_id in {**there, **here}]
    if records:
        Database(records).write(path, "python -m benchmarks.runs.damped_step setups")
    return [
        {
            "setup": r.request.setup,
            "restitution": r.request.parameters["restitution"],
            "step": "a fifth" if r.request.parameters["time_step"] else "the law's",
            "status": r.status,
            "reason": r.error,
        }
        for r in records
    ]


def draw(rows: list[dict], found: list[dict]) -> None:
    """Shares over restitution, a panel for each kind of grains."""
    colours = {"stable": "tab:blue", "restless": "tab:orange", "explodes": "tab:red"}
    fig, axes = plt.subplots(1, len(GRAINS), figsize=(10, 3.6), sharey=True, layout="constrained")
    for axis, (name, (young, radius, _)) in zip(axes, GRAINS.items(), strict=True):
        for label, colour in colours.items():
            own = [
                r
                for r in rows
                if (r["young_modulus"], r["particle_radius"]) == (young, radius)
                and outcome(r) == label
            ]
            where = [r["restitution"] + 0.006 * (r["seed"] - 1.5) for r in own]
            axis.plot(where, [r["share"] for r in own], "o", ms=3.5, color=colour, label=label)
        law = [f for f in found if f["grains"] == name]
        axis.plot([f["restitution"] for f in law], [f["law"] for f in law], "k-", label="bound")
        number = law[0]["stiffness_number"] if law else np.nan
        axis.set(xlabel="restitution", yscale="log", title=f"E/(rho g d) = {number:,.0f}")
    axes[0].set_ylabel("step over the Rayleigh time")
    axes[0].legend(frameon=False, fontsize=8)
    fig.savefig(RESULTS / "damped_step.png", dpi=110)


def main() -> None:
    """Make runs where they are asked for; write what is there."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="?", choices=("beds", "setups"))
    what = parser.parse_args().what
    if what == "beds":
        run_beds()
    if what == "setups":
        run_setups()
    rows = read_beds()
    write_csv(rows)
    found = limits(rows)
    write("damped_step", {"beds": found, "setups": read_setups()})
    draw(rows, found)
    print(*found, sep="\n")


if __name__ == "__main__":
    main()
