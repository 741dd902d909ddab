"""What the stiffness of the rolling spring does to heaps, slopes and flows, and to other engines'.

    python -m benchmarks.runs.rolling_stiffness run [N]  YADE's runs, N at a time: an hour of a core
    python -m benchmarks.runs.rolling_stiffness engines  LIGGGHTS' and LAMMPS', a quarter of an hour
    python -m benchmarks.runs.rolling_stiffness judge    compares what there is; the others resume

They write grid/rolling_stiffness.csv, grid/rolling_stiffness_engines.csv, and
benchmarks/results/rolling_stiffness.json and .png. YADE's spring is rolling_stiffness_ratio times
k_t R_eff^2 under five grain weights; LIGGGHTS' epsd2 is k_t R_eff^2 under the load of the moment;
LAMMPS' sds is constant like YADE's. Set-ups and grains are those of cases/missing_effect.toml, the
hourglass with its wide neck, which rough grains clog less often. A p value is that of a t or F test
with the variance between seeds pooled over all samples of a friction pair.
"""

import csv
import sys
from collections.abc import Iterable
from pathlib import Path

import matplotlib
import numpy as np
from scipy import stats

from benchmarks.common import RESULTS, rounded, write
from benchmarks.runs.rolling_engines import SHEAR, checked_on_one_grain, run_engine
from calibrator.case.physics import time_step
from calibrator.case.toml import read_case
from calibrator.case.values import is_number
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

matplotlib.use("Agg")
import matplotlib.pyplot as plt

REPO = Path(__file__).resolve().parents[2]
FOLDER = RunFolder(REPO / "results" / "rolling_stiffness")
SHIPPED = REPO / "grid" / "rolling_stiffness.csv"
ENGINES = REPO / "grid" / "rolling_stiffness_engines.csv"
COMMAND = "python -m benchmarks.runs.rolling_stiffness"
RATIOS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
FIRST = (1.0, 4.0, 16.0)  # of ledge and hourglass: made before the others
PAIRS = ((0.1, 0.3), (0.2, 0.5), (0.3, 0.5), (0.4, 0.7))  # rolling and sliding friction
SEEDS = tuple(range(850_001, 850_006))
CONTROL = (1.0, 4.0)  # heaps once more with the small step of the stiffest spring
WIDE_NECK = 18e-3
RESPONSES = {
    "conical_pile": ("pile_equivalent_angle_deg", "pile_angle_of_repose_deg", "bulk_density"),
    "ledge": ("ledge_equivalent_angle_deg", "ledge_angle_of_repose_deg", "bulk_density"),
    "hourglass": ("drained_equivalent_angle_deg", "mass_flow_rate", "bulk_density"),
}
LAMMPS_RATIOS = (1.0, 4.0)
COLUMNS = ("engine", "setup", "rolling_friction", "sliding_friction", "ratio", "seed", "status")
OTHERS = ("LIGGGHTS", *(f"{engine} {r:g}" for engine in SHEAR for r in LAMMPS_RATIOS))
Samples = dict[tuple[float, float], dict[str, np.ndarray]]  # by friction pair, by sample


def parameters(setup: str, pair: tuple[float, float], seed: int) -> dict:
    """Everything of a run but the rolling stiffness."""
    problem = read_case(REPO / "cases" / "missing_effect.toml").problem
    shape = {**problem.fixed, **problem.setups[setup]}
    if setup == "hourglass":
        shape["neck_diameter"] = WIDE_NECK
    return {**shape, "rolling_friction": pair[0], "sliding_friction": pair[1], "seed": seed}


def request(
    setup: str, pair: tuple[float, float], ratio: float, seed: int, step_of: float = 0.0
) -> Request:
    """One run of YADE; step_of : the ratio whose time step it takes instead of its own."""
    own = parameters(setup, pair, seed)
    if step_of:
        numbers = {
            n: float(v) for n, v in Request.of(setup, **own).parameters.items() if is_number(v)
        }
        own["time_step"] = time_step({**numbers, "rolling_stiffness_ratio": step_of})
    return Request.of(setup, **own, rolling_stiffness_ratio=ratio)


def blocks() -> list[list[Request]]:
    """All runs, in the order in which they are made: what there is can be judged at any time."""
    order = [("conical_pile", s, RATIOS) for s in SEEDS]
    for ratios in (FIRST, tuple(r for r in RATIOS if r not in FIRST)):
        order += [(name, s, ratios) for s in SEEDS for name in ("ledge", "hourglass")]
    found = [[request(name, p, r, s) for p in PAIRS for r in rs] for name, s, rs in order]
    small = [
        [request("conical_pile", p, r, s, RATIOS[-1]) for s in SEEDS]
        for p in PAIRS[::-1]
        for r in CONTROL
    ]
    found[len(SEEDS) : len(SEEDS)] = small
    return found


def finished() -> list[Record]:
    """YADE's runs, shipped or made here."""
    wanted = [r for block in blocks() for r in block]
    shipped = Database.read(SHIPPED).find(wanted) if SHIPPED.exists() else []
    return list({r.run_id: r for r in [*shipped, *gather(FOLDER, wanted)]}.values())


def run_yade(jobs: int) -> None:
    """Make what is missing, a block at a time."""
    known = {r.run_id for r in finished()}
    for block in blocks():
        missing = [r for r in block if r.run_id not in known]
        if missing:
            run(FOLDER, missing, jobs=jobs, report=ProgressBar(sys.stderr))
            Database(finished()).write(SHIPPED, f"{COMMAND} run")


def engine_runs() -> list[tuple[str, str, tuple[float, float], float, int]]:
    """Engine, set-up, friction pair, ratio and seed of every run, in the order they are made."""
    kinds = [("LIGGGHTS", "conical_pile", 1.0), ("LIGGGHTS", None, 1.0)]
    kinds += [(engine, "conical_pile", ratio) for engine in SHEAR for ratio in LAMMPS_RATIOS]
    return [
        (engine, name, pair, ratio, seed)
        for engine, setup, ratio in kinds
        for seed in SEEDS
        for name in ([setup] if setup else ["ledge", "hourglass"])
        for pair in PAIRS
    ]


def engine_rows() -> list[dict[str, str]]:
    """What the engines have measured so far."""
    if not ENGINES.exists():
        return []
    with open(ENGINES) as stream:
        return list(csv.DictReader(line for line in stream if not line.startswith("#")))


def run_engines() -> None:
    """Make what is missing; the table is written after each run."""
    rows = engine_rows()
    names = sorted({n for own in RESPONSES.values() for n in own})
    done = {tuple(row[c] for c in COLUMNS[:-1]) for row in rows}
    for engine, setup, pair, ratio, seed in engine_runs():
        key = (engine, setup, str(pair[0]), str(pair[1]), str(ratio), str(seed))
        if key in done:
            continue
        folder = FOLDER.path / "engines" / "_".join(key).replace(" ", "_")
        found = run_engine(engine, folder, setup, parameters(setup, pair, seed), ratio)
        print(*key, found["status"], found["at_rest"], found["lost"], flush=True)
        values = {n: repr(float(found["responses"][n])) for n in names if n in found["responses"]}
        row = {**dict(zip(COLUMNS, (*key, found["status"]), strict=True)), **values}
        rows.append({**row, "at_rest": str(found["at_rest"]), "lost": str(found["lost"])})
        with open(ENGINES, "w", newline="") as stream:
            stream.write(f"# {COMMAND} engines; angles [deg], density [kg/m3], rate [kg/s]\n")
            fields = [*COLUMNS, "at_rest", "lost", *names]
            table = csv.DictWriter(stream, fields, restval="", lineterminator="\n")
            table.writeheader()
            table.writerows(rows)


def label_of(engine: str, ratio: float) -> str:
    """Name of a sample: LIGGGHTS has one rolling spring only."""
    return engine if engine == "LIGGGHTS" else f"{engine} {ratio:g}"


def samples(setup: str, response: str) -> Samples:
    """Values of the runs that have the response: YADE's under their ratio, the engines' under
    their name, LAMMPS' with its ratio."""
    rows: list[tuple[tuple[float, float], str, float]] = []
    for r in finished():
        if r.request.setup == setup and response in r.responses and r.status == "ok":
            pair = (r.request.value("rolling_friction"), r.request.value("sliding_friction"))
            ratio = r.request.value("rolling_stiffness_ratio")
            step = " small step" if r.request.value("time_step") else ""
            rows.append((pair, f"{ratio:g}{step}", r.responses[response]))
    for row in engine_rows():
        if row["setup"] == setup and row["status"] == "ok" and row[response]:
            pair = (float(row["rolling_friction"]), float(row["sliding_friction"]))
            rows.append((pair, label_of(row["engine"], float(row["ratio"])), float(row[response])))
    labels = [*(f"{r:g}" for r in RATIOS), *(f"{r:g} small step" for r in CONTROL), *OTHERS]
    found: Samples = {}
    for pair in PAIRS:
        values = {
            n: np.array([v for p, label, v in rows if (p, label) == (pair, n)]) for n in labels
        }
        found[pair] = {n: v for n, v in values.items() if len(v)}
    return found


def pooled(own: dict[str, np.ndarray]) -> tuple[float, int]:
    """Variance between the seeds of one friction pair, over all its samples, and its degrees of
    freedom; rough grains scatter more than smooth ones."""
    freedom = sum(len(v) - 1 for v in own.values())
    squares = sum(float(((v - v.mean()) ** 2).sum()) for v in own.values())
    return squares / freedom if freedom else float("nan"), freedom


def difference(all_: Samples, one: str, other: str) -> dict | None:
    """Mean over the friction pairs of sample `one` minus sample `other`, and two p values: of a
    shift of the mean, and of any difference in any pair."""
    both = [(v, *pooled(v)) for v in all_.values() if one in v and other in v]
    if not both:
        return None
    freedom = min(f for *_, f in both)
    gaps = np.array([v[one].mean() - v[other].mean() for v, *_ in both])
    errors = np.array([(var * (1 / len(v[one]) + 1 / len(v[other]))) ** 0.5 for v, var, _ in both])
    mean, error = gaps.mean(), float(np.sqrt((errors**2).sum())) / len(gaps)
    statistic = float(((gaps / errors) ** 2).mean())
    return {
        "mean": rounded(mean, 3),
        "standard_error": rounded(error, 2),
        "by_pair": [rounded(g, 3) for g in gaps],
        "p_shift": two_sided(mean / error, freedom),
        "p_any": rounded(stats.f.sf(statistic, len(gaps), freedom), 2),
    }


def trend(all_: Samples, ratios: Iterable[float]) -> dict | None:
    """Change of the response per doubling of the ratio: of each friction pair, and their mean.

    A plateau is a range of ratios without a trend.
    """
    slopes, freedoms = {}, []
    for pair, own in all_.items():
        points = [(np.log2(r), v) for r in ratios for v in own.get(f"{r:g}", ())]
        if len({x for x, _ in points}) > 1:
            variance, freedom = pooled(own)
            x, y = np.array(points).T
            x = x - x.mean()
            slopes[name_of(pair)] = (x @ y) / (x @ x), (variance / (x @ x)) ** 0.5
            freedoms.append(freedom)
    if not slopes:
        return None
    values, errors = np.array(list(slopes.values())).T
    slope, error = values.mean(), float(np.sqrt((errors**2).sum())) / len(errors)
    return {
        "slope": rounded(slope, 3),
        "standard_error": rounded(error, 2),
        "p": two_sided(slope / error, min(freedoms)),
        "pairs": {
            n: {"slope": rounded(v, 3), "p": two_sided(v / e, f)}
            for (n, (v, e)), f in zip(slopes.items(), freedoms, strict=True)
        },
    }


def two_sided(t: float, freedom: int) -> float:
    """p value of Student's t."""
    return rounded(2 * stats.t.sf(abs(t), freedom), 2)


def name_of(pair: tuple[float, float]) -> str:
    return f"mu_r {pair[0]:g}, mu_s {pair[1]:g}"


def verdict(all_: Samples) -> dict:
    """Table of one response, its trends, and its distance from the engines."""
    table = {}
    for pair, own in all_.items():
        table[name_of(pair)] = {
            label: {
                "mean": rounded(spread(v)[0]),
                "standard_error": rounded(spread(v)[1], 2) if len(v) > 1 else None,
                "runs": len(v),
            }
            for label, v in own.items()
        }
    found = {"table": table, "per_doubling": {}}
    there = [r for r in RATIOS if any(f"{r:g}" in own for own in all_.values())]
    for low, high in ((0.5, 16.0), (0.5, 4.0), (1.0, 4.0), (2.0, 16.0), (4.0, 16.0)):
        within = [r for r in there if low <= r <= high]
        found["per_doubling"][f"{low:g} to {high:g}"] = trend(all_, within)
    for name in OTHERS:
        gaps = {f"{r:g}": difference(all_, f"{r:g}", name) for r in there}
        gaps = {r: g for r, g in gaps.items() if g}
        if gaps:
            nearest = min(gaps, key=lambda r: abs(gaps[r]["mean"]))
            agree = [r for r, g in gaps.items() if g["p_any"] > 0.05]
            found[f"YADE minus {name}"] = {**gaps, "nearest": nearest, "not_told_apart": agree}
    twins = [(f"{engine} 4", f"{engine} 1") for engine in SHEAR]
    twins += [("16", "4"), *((f"{r:g} small step", f"{r:g}") for r in CONTROL)]
    for one, other in twins:
        apart = difference(all_, one, other)
        found |= {f"{one} minus {other}": apart} if apart else {}
    return found


def counts() -> dict:
    """How many runs ended how."""
    ends: dict[str, dict[str, int]] = {}
    for r in finished():
        label = f"YADE {r.request.value('rolling_stiffness_ratio'):g} {r.request.setup}"
        ends.setdefault(label, {}).setdefault(r.status, 0)
        ends[label][r.status] += 1
    for row in engine_rows():
        label = f"{row['engine']} {float(row['ratio']):g} {row['setup']}"
        status = row["status"] if row["at_rest"] == "True" else "not at rest"
        ends.setdefault(label, {}).setdefault(status, 0)
        ends[label][status] += 1
    return dict(sorted(ends.items()))


def judge() -> None:
    """Compare what there is."""
    checks = FOLDER.path / "engines" / "one_grain"
    kinds = [("LIGGGHTS", 1.0), *((engine, r) for engine in SHEAR for r in LAMMPS_RATIOS)]
    single = [checked_on_one_grain(engine, checks, ratio) for engine, ratio in kinds]
    found = {}
    for setup, name in ((s, n) for s, names in RESPONSES.items() for n in names):
        all_ = samples(setup, name)
        if any(all_.values()):
            found[f"{setup}.{name}"] = verdict(all_)
    write("rolling_stiffness", {"one_grain": single, "ends": counts(), "responses": found})
    figure()


def figure() -> None:
    """Means with standard errors over the ratio; LIGGGHTS as bands."""
    names = [(setup, own[0]) for setup, own in RESPONSES.items()]
    fig, axes = plt.subplots(1, len(names), figsize=(4 * len(names), 3.6), layout="constrained")
    for axis, (setup, name) in zip(axes, names, strict=True):
        for i, (pair, own) in enumerate(samples(setup, name).items()):
            there = [r for r in RATIOS if f"{r:g}" in own]
            means, errors = np.array([spread(own[f"{r:g}"]) for r in there]).reshape(-1, 2).T
            axis.errorbar(there, means, errors, fmt="o-", color=f"C{i}", label=name_of(pair))
            if "LIGGGHTS" in own:
                mean, error = spread(own["LIGGGHTS"])
                axis.axhspan(mean - error, mean + error, color=f"C{i}", alpha=0.25, lw=0)
        axis.set(xscale="log", xlabel="rolling stiffness over $k_t R^2$")
        axis.set(title=setup.replace("_", " "), ylabel="equivalent angle [deg]")
        axis.set_xticks(RATIOS, [f"{r:g}" for r in RATIOS])
        axis.minorticks_off()
    axes[1].legend(frameon=False, title="bands: LIGGGHTS epsd2", fontsize="small")
    fig.savefig(RESULTS / "rolling_stiffness.png", dpi=110)


def spread(values: np.ndarray) -> tuple[float, float]:
    """Mean and its standard error; that of a single run is not known."""
    error = values.std(ddof=1) / len(values) ** 0.5 if len(values) > 1 else float("nan")
    return float(values.mean()), float(error)


def main() -> None:
    """One of the steps."""
    step, *jobs = sys.argv[1:]
    if step == "run":
        return run_yade(int(jobs[0]) if jobs else 0)
    return {"engines": run_engines, "judge": judge}[step]()


if __name__ == "__main__":
    main()
