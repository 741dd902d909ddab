"""What one hourglass costs, what each change saved, and what LIGGGHTS takes the plain way.

    python -m benchmarks.runs.dem_cost           about 20 minutes; needs YADE and LIGGGHTS
    python -m benchmarks.runs.dem_cost quartz    one of the two hourglasses only, prints only

Writes benchmarks/results/dem_cost.json and .png. Core-seconds are CPU time of the whole process,
summed over three rounds with a seed each (how long the last grains trickle is chance); in a round
every variant runs once, one after the other, so that a slow quarter of an hour hits them all.
"""

import itertools
import json
import shutil
import sys
from statistics import mean

import matplotlib
import numpy as np

from benchmarks.common import RESULTS, rounded, write
from benchmarks.runs.dem import (
    HOURGLASSES,
    START,
    START_NUMERICS,
    WORK,
    core_seconds,
    run_hourglass,
)
from benchmarks.runs.liggghts_hourglass import run_liggghts
from calibrator.case.vocabulary import SCRIPTS
from calibrator.runs.request import Request, write_table

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROUNDS = 3
SEED = 71_000
# what is in force: scripts of a commit ("" is the work tree) and columns that differ from today's
# defaults
RUNGS = {
    "start": (START, START_NUMERICS),
    "cached states": ("1a914f7", START_NUMERICS),
    "silent log": ("", START_NUMERICS),
    "filling threshold": ("", {"rayleigh_fraction": START_NUMERICS["rayleigh_fraction"]}),
    "time step": ("", {}),
}
STAGES = ("start_up", "filling", "discharge", "settling")


def particle_steps(record: dict) -> tuple[float, float]:
    """Sum over the steps of the grains in the scene, and its part after the last has passed."""
    d, time = record["diagnostics"], record["curves"]["time"]
    passed = (
        record["curves"]["passed_mass"]
        / record["curves"]["passed_mass"][-1]
        * (d["particles"] - d["particles_left"])
    )
    grains = (d["particles"] - passed) / d["time_step"]
    settling = time >= time[np.argmax(passed >= passed[-1] - 0.5)]
    filling = d["particles"] * d["filling_time"] / d["time_step"]
    return filling + np.trapezoid(grains, time), np.trapezoid(grains[settling], time[settling])


def stages(record: dict) -> dict[str, float]:
    """Core-seconds of each stage.

    What the scripts do not time (the start's settling) is shared out by particle-steps.
    """
    d = record["diagnostics"]
    total, settled = particle_steps(record)
    released = total - d["particles"] * d["filling_time"] / d["time_step"]
    settling = d.get("settling_cpu", d["release_cpu"] * settled / released)
    return {
        "start_up": record["core_seconds"] - d["filling_cpu"] - d["release_cpu"],
        "filling": d["filling_cpu"],
        "discharge": d["release_cpu"] - settling,
        "settling": settling,
    }


def means(rows: list[dict]) -> dict:
    """Mean of each number over the rounds."""
    return {name: rounded(mean(row[name] for row in rows)) for name in rows[0]}


def measure(case: str) -> dict:
    """All variants of one hourglass."""
    yade: dict[str, list[dict]] = {name: [] for name in RUNGS}
    liggghts = []
    for round_ in range(ROUNDS):
        parameters = {**HOURGLASSES[case], "seed": SEED + round_}
        for name, (commit, numerics) in RUNGS.items():
            yade[name].append(
                run_hourglass(
                    commit,
                    {**parameters, **numerics},
                    again=f"_cost{round_}_{name.replace(' ', '_')}",
                )
            )
            print(case, round_, name, f"{yade[name][-1]['core_seconds']:.1f} core-s", flush=True)
        liggghts.append(run_liggghts(WORK / f"liggghts_{case}_{round_}", parameters))
        print(case, round_, "LIGGGHTS", f"{liggghts[-1]['core_seconds']:.1f} core-s", flush=True)
    return {**summary(yade, liggghts), "engine_shares": engine_shares(case)}


def same_responses(some: list[dict], others: list[dict]) -> bool:
    """True if every round gave the same responses to the last bit."""
    return [r["responses"] for r in some] == [r["responses"] for r in others]


TIMED = """
import json, sys
from yade import O
O.timingEnabled = True
sys.argv[0] = {script!r}
exec(compile(open(sys.argv[0]).read(), sys.argv[0], "exec"))
spent = {{type(e).__name__: e.execTime for e in O.engines}}
json.dump({{name: t / sum(spent.values()) for name, t in spent.items()}}, open("engines.json", "w"))
"""


def engine_shares(case: str) -> dict[str, float]:
    """Share of YADE's engines in the time of a run, by YADE's own timing."""
    folder = WORK / f"engines_{case}"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "timed.py").write_text(TIMED.format(script=str(SCRIPTS / "hourglass.py")))
    write_table(folder / "run.table", [Request.of("hourglass", **HOURGLASSES[case], seed=SEED)])
    core_seconds(["yade", "-j1", "-n", "-x", "timed.py"], folder, YADE_BATCH="run.table:2")
    return {
        name: rounded(share, 3)
        for name, share in json.loads((folder / "engines.json").read_text()).items()
    }


def summary(yade: dict[str, list[dict]], liggghts: list[dict]) -> dict:
    """Ratios of the means over the rounds, and what each change saved."""
    total = {name: mean(r["core_seconds"] for r in rows) for name, rows in yade.items()}
    work = {name: mean(particle_steps(r)[0] for r in rows) for name, rows in yade.items()}
    names, now, peer = list(RUNGS), yade["time step"][0], mean(r["core_seconds"] for r in liggghts)
    peer_work = mean(r["particle_steps"] for r in liggghts)
    per_step = total["time step"] / work["time step"], peer / peer_work
    return {
        "particles": now["diagnostics"]["particles"],
        "ratio_to_start": rounded(total["start"] / total["time step"]),
        "ratio_to_liggghts_total": rounded(total["time step"] / peer),
        "ratio_to_liggghts_total_at_start": rounded(total["start"] / peer),
        "ratio_to_liggghts_per_particle_step": rounded(per_step[0] / per_step[1]),
        "saved_by": {b: rounded(1 - total[b] / total[a], 3) for a, b in itertools.pairwise(names)},
        "same_bits_as_start": [
            n
            for n in names[1:]
            if [r["responses"] for r in yade[n]] == [r["responses"] for r in yade["start"]]
        ],
        "yade": {
            name: {
                **core_seconds_of(rows),
                "stages": means([stages(r) for r in rows]),
                "steps": rounded(mean(r["diagnostics"]["steps"] for r in rows)),
                "particle_steps": rounded(work[name]),
                "nanoseconds_per_particle_step": rounded(1e9 * total[name] / work[name]),
                "responses": means(
                    [{n: r["responses"][n] for n in liggghts[0]["responses"]} for r in rows]
                ),
            }
            for name, rows in yade.items()
        },
        "liggghts": {
            **core_seconds_of(liggghts),
            **means(
                [{n: r[n] for n in ("steps", "filling_steps", "particle_steps")} for r in liggghts]
            ),
            "nanoseconds_per_particle_step": rounded(1e9 * per_step[1]),
            "responses": means([r["responses"] for r in liggghts]),
        },
    }


def core_seconds_of(rows: list[dict]) -> dict:
    """Mean and range of the core-seconds over the rounds."""
    spent = [r["core_seconds"] for r in rows]
    return {
        "core_seconds": rounded(mean(spent)),
        "core_seconds_range": [rounded(min(spent)), rounded(max(spent))],
    }


def figure(found: dict[str, dict]) -> None:
    """Stacked stages of every rung, LIGGGHTS beside them."""
    fig, axes = plt.subplots(
        1, len(found), figsize=(5.5 * len(found), 4), layout="constrained", squeeze=False
    )
    for axis, (case, one) in zip(axes[0], found.items(), strict=True):
        names, bottom = list(one["yade"]), np.zeros(len(one["yade"]))
        for stage, colour in zip(
            STAGES, ("0.6", "tab:blue", "tab:orange", "tab:green"), strict=True
        ):
            heights = np.array([one["yade"][n]["stages"][stage] for n in names])
            axis.bar(names, heights, bottom=bottom, label=stage.replace("_", "-"), color=colour)
            bottom += heights
        axis.bar(["LIGGGHTS\nplain way"], one["liggghts"]["core_seconds"], color="tab:red")
        axis.set(title=f"{case}: {one['particles']} grains", ylabel="core-seconds a run")
        axis.tick_params(axis="x", labelrotation=35)
    axes[0][0].legend(frameon=False)
    fig.savefig(RESULTS / "dem_cost.png", dpi=110)


def main() -> None:
    """Measure, write, draw."""
    found = {case: measure(case) for case in sys.argv[1:] or HOURGLASSES}
    if sys.argv[1:]:
        print(json.dumps(found, indent=1))
        return
    write("dem_cost", found)
    figure(found)
    for folder in WORK.glob("*_cost*"):
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
