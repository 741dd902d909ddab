"""The reference paper's tables beside ours: fills the marked blocks of docs/paper_case.md from what
has been measured.

    calibrator all cases/quartz_sand_reduced.toml && python -m benchmarks.paper.page        (make
    paper does both)

Everything comes from files: the case's summary and shipped database, the paper's printed numbers
(cases/reference_paper.toml), and the results of the benchmarks named in each block. A block whose
source is missing says which command makes it.
"""

import json
import re
import shutil
import tomllib
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import RESULTS
from calibrator.case.case import Case
from calibrator.case.problem import Problem
from calibrator.case.toml import read_case
from calibrator.plan.requests import design_points
from calibrator.plan.run import database_records
from calibrator.responses.coordinates import Coordinates
from calibrator.responses.fit import fit_responses
from calibrator.responses.table import response_table
from calibrator.runs.record import Record
from calibrator.runs.workspace import Workspace

REPO = Path(__file__).resolve().parents[2]
PAGE = REPO / "docs" / "paper_case.md"
PICTURES = REPO / "docs" / "figures"
CASE = REPO / "cases" / "quartz_sand_reduced.toml"
GRID = REPO / "cases" / "quartz_sand_reduced_grid.toml"
ADAPTIVE = REPO / "cases" / "quartz_sand_adaptive.toml"
LETTERS = "ABCD"
HELD = ("held_by_68", "held_by_95")
COUNTERPARTS = {  # our target's response -> the paper's error and response
    "bulk_density": ("density", "bulk_density"),
    "drained_equivalent_angle_deg": ("angle", "drained_angle_of_repose_deg"),
    "mass_flow_rate": ("time", "discharge_time"),
}
FOLDS = 8
COPIED = (
    "front_evolution",
    "generational_distance",
    "sensitivity",
    "ridge",
    "profile_likelihood",
    "parity",
)


class Sources:
    """The files that the blocks are made of."""

    def __init__(self) -> None:
        self.case: Case = read_case(CASE)
        self.space = Workspace(self.case, REPO / "results" / self.case.name)
        self.summary = self.space.summary()
        self.paper = tomllib.loads((REPO / "cases" / "reference_paper.toml").read_text())

    def measured(self, name: str) -> dict[str, Any]:
        """Results of a benchmark; FileNotFoundError where it has not been run."""
        found: dict[str, Any] = json.loads((RESULTS / f"{name}.json").read_text())
        return found


def table(head: list[str], rows: list[list[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def with_error(value: float, error: float | None, digits: int = 4) -> str:
    """A value and its error, the latter with two digits."""
    return f"{value:.{digits}g}" + (f" ± {error:.2g}" if error else "")


# Set-up and database


def scale_block(sources: Sources) -> str:
    """Full against reduced hourglass, and what the narrow neck does."""
    names = {
        "bulk_density": "density [kg/m³]",
        "drained_equivalent_angle_deg": "equivalent angle [°]",
    }
    names |= {
        "drained_angle_of_repose_deg": "fitted angle [°]",
        "mass_flow_rate": "steady rate [g/s]",
    }
    rows = []
    for label, scales in sources.measured("hourglass_scale")["sets"].items():
        for scale, own in scales.items():
            cells = [f"{label} friction, {scale}", f"{own['runs']} ({own['clogged']} clogged)"]
            for name in names:
                unit = 1e3 if name == "mass_flow_rate" else 1.0
                value = own.get(name)
                cells.append(
                    "–"
                    if value is None
                    else with_error(unit * value["mean"], unit * (value["scatter"] or 0))
                )
            rows.append(cells)
    return table(["set", "runs", *names.values()], rows) + "\n\n± is the scatter of single runs."


def targets_block(sources: Sources) -> str:
    """The targets of the reduced case."""
    rows = [[t.key, f"{t.value:.5g}", f"{t.tolerance:.0%}"] for t in sources.case.problem.targets]
    return table(["target", "value", "tolerance"], rows)


def workspace(path: Path) -> Workspace:
    """Another case with its results."""
    case = read_case(path)
    return Workspace(case, REPO / "results" / case.name)


def database_block(sources: Sources) -> str:
    """Sets, replicates, outcomes."""
    head = ["database", "parameter sets", "with 3 or more runs", "runs", "by outcome"]
    rows = [("Sobol", database_records(sources.space)), ("grid", database_records(workspace(GRID)))]
    return table(
        head, [[name, *_counted(records, sources.case.problem.names)] for name, records in rows]
    )


def _counted(records: list[Record], names: list[str]) -> list[str]:
    sets = Counter(tuple(r.request.value(n) for n in names) for r in records)
    outcomes = Counter(r.status for r in records)
    replicated = sum(n >= 3 for n in sets.values())
    return [
        str(len(sets)),
        str(replicated),
        str(len(records)),
        ", ".join(f"{v} {k}" for k, v in sorted(outcomes.items())),
    ]


# The paper's tables


def candidates(sources: Sources) -> dict[str, dict[str, Any]]:
    """Our four spread individuals and the compromise, as `calibrate` left them."""
    found: dict[str, dict[str, Any]] = sources.summary["calibrate"]["candidates"]
    return {
        k.removeprefix("individual "): v
        for k, v in sorted(found.items(), key=lambda item: item[0] == "compromise")
    }


def table6_block(sources: Sources) -> str:
    """Predicted: parameters, errors, objectives."""
    ours, paper = candidates(sources), sources.paper["individual"]
    head = ["", *(f"paper {x}" for x in LETTERS), *(f"ours {x}" for x in ours)]
    rows = []
    for name in sources.case.problem.names:
        values = [paper[x]["parameters"][name] for x in LETTERS] + [
            c["parameters"][name] for c in ours.values()
        ]
        rows.append([name.replace("_", " "), *(f"{v:.4g}" for v in values)])
    for target in sources.case.problem.targets:
        short = COUNTERPARTS[target.response][0]
        own = [abs(c["predicted"][target.key]["mean"] / target.value - 1) for c in ours.values()]
        errors = [c["predicted"][target.key]["error"] / target.value for c in ours.values()]
        cells = [f"{paper[x]['predicted'][short]:.4f}" for x in LETTERS]
        rows.append(
            [
                f"error of {short}",
                *cells,
                *(f"{v:.4f} ± {e:.4f}" for v, e in zip(own, errors, strict=True)),
            ]
        )
    for short, name in (("o1", "error"), ("o2", "time_cost")):
        cells = [f"{paper[x]['predicted'][short]:.4f}" for x in LETTERS]
        rows.append(
            [short.upper(), *cells, *(f"{c['objectives'][name]:.4f}" for c in ours.values())]
        )
    return table(head, rows)


def verified(sources: Sources, verb: str) -> dict[str, dict[str, Any]]:
    """Outcome of verify or validate per candidate, in the order of `candidates`."""
    outcome = sources.summary[verb]
    own = (
        outcome["candidates"]
        if verb == "verify"
        else {"compromise": outcome, **outcome["candidates"]}
    )
    return {
        x: own[k] for x in candidates(sources) for k in own if k.removeprefix("individual ") == x
    }


def cell(row: dict[str, Any] | None) -> str:
    """Simulated mean with its standard error and its relative error."""
    return (
        "no good run"
        if row is None
        else f"{with_error(row['simulated'], row['standard_error'])} ({row['relative_error']:+.1%})"
    )


def table7_block(sources: Sources) -> str:
    """Verified with fresh runs."""
    ours, paper = verified(sources, "verify"), sources.paper
    head = ["", *(f"paper {x}" for x in LETTERS), *(f"ours {x}" for x in ours)]
    rows = []
    for target in sources.case.problem.targets:
        name = COUNTERPARTS[target.response][1]
        measured = paper["measured"][name]
        printed = [paper["individual"][x]["verified"][name] for x in LETTERS]
        own = [{r["key"]: r for r in o["responses"]}.get(target.key) for o in ours.values()]
        rows.append(
            [
                f"{name} / {target.response}",
                *(f"{v:.4g} ({v / measured - 1:+.1%})" for v in printed),
                *(cell(r) for r in own),
            ]
        )
    cells = [f"{paper['individual'][x]['verified']['o1']:.4f}" for x in LETTERS]
    rows.append(["O1", *cells, *(f"{o['o1']:.4f}" for o in ours.values())])
    runs = [", ".join(f"{n} {k}" for k, n in o["statuses"].items()) for o in ours.values()]
    rows.append(["runs", *(["1"] * 4), *runs])
    noise = sources.summary["calibrate"]["seed_noise"]
    said = ", ".join(
        f"{k.split('.')[1]} {v / t.value:.1%}"
        for t in sources.case.problem.targets
        for k, v in noise.items()
        if k == t.key
    )
    return table(head, rows) + f"\n\nSeed noise of one run: {said}."


def table89_block(sources: Sources) -> str:
    """Validation on ledge and pile."""
    ours, rows = verified(sources, "validate"), []
    for target in sources.case.problem.held_out:
        printed = [sources.paper["individual"][x][target.response] for x in LETTERS]
        own = [{r["key"]: r for r in o["responses"]}.get(target.key) for o in ours.values()]
        rows.append(
            [
                target.response,
                f"{target.value:g}",
                *(f"{v:g}" for v in printed),
                *(cell(r) for r in own),
            ]
        )
    return table(
        ["", "measured", *(f"paper {x}" for x in LETTERS), *(f"ours {x}" for x in ours)], rows
    )


def table8_full_block(sources: Sources) -> str:
    """The paper's own individuals in the full-scale ledge."""
    found = sources.measured("ledge_full_scale")
    rows = []
    for x in LETTERS:
        own = found[x]
        error = np.std(own["fitted"], ddof=1) / np.sqrt(len(own["fitted"]))
        seeds = ", ".join(f"{v:.1f}" for v in own["fitted"])
        cells = [
            f"{own['paper']:g}",
            with_error(own["fitted_mean"], error, 3),
            seeds,
            f"{own['equivalent_mean']:.1f}",
        ]
        rows.append([x, *cells, f"{own['fitted_mean'] - own['paper']:+.1f}"])
    head = [
        "individual",
        "paper",
        "YADE, fitted slope",
        "its seeds",
        "YADE, from the volume",
        "YADE − paper",
    ]
    return (
        table(head, rows)
        + f"\n\nMeasured: {found['measured']}°. Angles in degrees; ± is the standard error of three"
        " seeds."
    )


def pile_block(sources: Sources) -> str:
    """The paper's individual D in piles of several sizes."""
    found = sources.measured("pile_scale")
    rows = []
    for size, own in found["sizes"].items():
        keys = ("pile_angle_of_repose_deg", "pile_equivalent_angle_deg")
        cells = [with_error(own[k]["mean"], own[k]["standard_error"]) for k in keys]
        rows.append([size, str(own["grains"]), str(own["runs"]), *cells])
    paper = found["paper"]
    rows.append(
        [
            f"{paper['diameter'] * 1e3:g} mm, the paper's",
            "",
            "1",
            f"{paper['pile_angle_of_repose_deg']:g}",
            "",
        ]
    )
    sizes = [1 / float(size.split()[0]) for size in found["sizes"]]
    angles = [own["pile_angle_of_repose_deg"]["mean"] for own in found["sizes"].values()]
    at_paper = np.polyval(np.polyfit(sizes, angles, 1), 1e-3 / paper["diameter"])
    words = (
        f"A line through the fitted angles over one over the diameter ends at {at_paper:.1f}° for"
        " the paper's cylinder."
    )
    return (
        table(["cylinder", "grains", "runs", "fitted angle [°]", "equivalent angle [°]"], rows)
        + "\n\n"
        + words
    )


# Statistics


def cross_validated(sources: Sources) -> dict[str, dict[str, float]]:
    """{method: {response: rms error over the response's standard deviation}}, always on runs that
    the fit has not seen.

    The grid is at the mean density of the box: with similarity it speaks for all densities, up to
    the moduli that it covers. A grid point whose runs all clogged has no rate: runs in the cells
    around it are left out of the comparison.
    """
    problem, keys = sources.case.problem, [t.key for t in sources.case.problem.targets]
    records = database_records(workspace(GRID))
    grid_points, grid_values = response_table(problem, records, keys)
    asked = np.unique([[float(r.request.value(n)) for n in problem.names] for r in records], axis=0)
    if len(asked) < len(design_points(read_case(GRID))):
        raise FileNotFoundError(f"{GRID.name} has not been run to its end")
    holes = np.array([one for one in asked if not (grid_points == one).all(axis=1).any()]).reshape(
        -1, len(problem.names)
    )
    points, values = response_table(problem, database_records(sources.space), keys)
    stiffness = Coordinates(problem, collapsed=True).inward(points)[:, -1]
    covered = Coordinates(problem, collapsed=True).inward(grid_points)[:, -1]
    within = (stiffness >= covered.min()) & (stiffness <= covered.max())
    full_points = np.vstack([grid_points, holes])
    is_hole = (np.arange(len(full_points)) >= len(grid_points)).astype(float)[:, None]
    near_hole = fit_responses(
        problem, full_points, is_hole, keys[:1], "multilinear", similarity=True
    )
    points, values = points[within], values[within]
    apart = near_hole.predict(points)[:, 0] == 0
    points, values = points[apart], values[apart]
    # nothing asks there
    filled_in = np.vstack(
        [grid_values, np.repeat(grid_values.mean(axis=0)[None], len(holes), axis=0)]
    )
    found = {}
    for method, words in (("multilinear", "multilinear"), ("process", "Gaussian process")):
        runs = (full_points, filled_in) if method == "multilinear" else (grid_points, grid_values)
        model = fit_responses(problem, *runs, keys, method, similarity=True)
        found[f"{words} on the grid's {len(grid_points)} runs"] = model.predict(points)
    found[f"Gaussian process on {FOLDS - 1} of {FOLDS} parts of the Sobol runs"] = _by_folds(
        problem, points, values, keys
    )
    return {name: _rms(values, predicted, keys) for name, predicted in found.items()}


def _by_folds(
    problem: Problem, points: np.ndarray, values: np.ndarray, keys: list[str]
) -> np.ndarray:
    """Prediction of each run by a process without its part of the sets."""
    _, group = np.unique(points, axis=0, return_inverse=True)
    predicted = np.full_like(values, np.nan)
    for fold in range(FOLDS):
        out = group % FOLDS == fold
        predicted[out] = fit_responses(
            problem, points[~out], values[~out], keys, similarity=True
        ).predict(points[out])
    return predicted


def _rms(values: np.ndarray, predicted: np.ndarray, keys: list[str]) -> dict[str, float]:
    scatter = np.nanstd(values, axis=0)
    return dict(
        zip(
            keys,
            (np.sqrt(np.nanmean((predicted - values) ** 2, axis=0)) / scatter).tolist(),
            strict=True,
        )
    )


def interpolation_block(sources: Sources) -> str:
    """Multilinear against Gaussian process."""
    found = cross_validated(sources)
    keys = [t.key for t in sources.case.problem.targets]
    noise, records = sources.summary["calibrate"]["seed_noise"], database_records(sources.space)
    _, values = response_table(sources.case.problem, records, keys)
    found["seed noise of one run, the least that can be left"] = {
        k: noise[k] / float(np.nanstd(values[:, i])) for i, k in enumerate(keys)
    }
    rows = [[name, *(f"{own[k]:.0%}" for k in keys)] for name, own in found.items()]
    head = [
        "rms error of a run, over the scatter of all runs",
        *(k.split(".")[1].replace("_", " ") for k in keys),
    ]
    return table(head, rows)


def coverage_block(sources: Sources) -> str:
    """How often the intervals hold the truth, and how often they pin a parameter."""
    found = sources.measured("coverage")
    rows = [
        [
            name.replace("_", " "),
            *(
                f"{own[k]['share']:.0%}"
                f" ({own[k]['interval_95'][0]:.0%}-{own[k]['interval_95'][1]:.0%})"
                for k in HELD
            ),
            f"{own['pinned']:.0%}",
        ]
        for name, own in found["parameters"].items()
    ]
    head = ["parameter", "held by 68 % intervals", "held by 95 % intervals", "pinned down"]
    return (
        table(head, rows)
        + f"\n\n{found['trials']} synthetic truths; in brackets the 95 % interval of the share."
    )


def sensitivity_block(sources: Sources) -> str:
    """Total Sobol indices."""
    found = sources.summary["calibrate"]["sensitivity"]
    rows = [
        [
            name.replace("_", " "),
            *(
                f"{found['total'][i][j]:.2f} ± {found['total_error'][i][j]:.2f}"
                for i in range(len(found["responses"]))
            ),
        ]
        for j, name in enumerate(found["parameters"])
    ]
    return table(
        ["total Sobol index", *(k.split(".")[1].replace("_", " ") for k in found["responses"])],
        rows,
    )


def similarity_block(sources: Sources) -> str:
    """Pairs that similarity calls the same."""
    measured = sources.measured("similarity")

    def differences(own: dict[str, Any]) -> list[str]:
        return [f"{d['difference']:+.1%} ± {d['standard_error']:.1%}" for d in own.values()]

    rows = [
        [label, "every bit" if own["exact"] else "NO", *differences(own["in_use"])]
        for label, own in measured["sets"].items()
    ]
    rows.append(["mean", "", *differences(measured["in_use_mean"])])
    head = ["friction", "all doubled: equal", "density", "equivalent angle", "rate"]
    return table(head, rows)


def runs_block(sources: Sources) -> str:
    """Runs that each method needs, peers counted in three ways."""
    rows = []
    found = sources.measured("runs_needed")
    for parameters in ("2", "5"):
        for name, own in found[parameters].items():
            peer = "by_itself" in own
            ways = [
                own["verified"] if peer else own,
                own.get("by_itself"),
                own if peer else own.get("oracle"),
            ]
            error = f"{own['worst_relative_error_median']:.1%}"
            rows.append(
                [
                    parameters,
                    name,
                    *(_needed(way, own["seeds"]) if way else "" for way in ways),
                    error,
                ]
            )
    head = [
        "parameters",
        "method",
        "verified: runs, median (failures)",
        "by its own rule",
        "by an oracle",
        "worst error, median",
    ]
    return table(head, rows)


def adaptive_block(sources: Sources) -> str:
    """The adaptive design on YADE itself: targets, and the runs that confirm its set."""
    space = workspace(ADAPTIVE)
    outcome, records = space.summary()["run"], database_records(space)
    at = [
        r
        for r in records
        if all(r.request.value(n) == v for n, v in outcome["recommended"].items())
    ]
    rows = []
    for target in space.case.problem.targets:
        values = np.array([r.responses[target.response] for r in at])
        error = values.std(ddof=1) / np.sqrt(len(values))
        cells = [
            f"{target.value:.4g}",
            with_error(values.mean(), error),
            f"{values.mean() / target.value - 1:+.1%}",
        ]
        rows.append([target.response.replace("_", " "), *cells])
    found = ", ".join(f"{n.replace('_', ' ')} {v:.4g}" for n, v in outcome["recommended"].items())
    head = ["response", "target", f"mean of {len(at)} fresh runs", "difference"]
    return f"{outcome['runs']} runs in all; {outcome['sentence']}: {found}.\n\n{table(head, rows)}"


def _needed(own: dict[str, Any], seeds: int) -> str:
    median = own["median_runs"]
    return f"{'never' if median is None else format(median, 'g')} ({own['failures']} of {seeds})"


def unreachable_block(sources: Sources) -> str:
    """What each method says of a density 7 % beyond the box."""
    rows = []
    for parameters, methods in sources.measured("runs_needed")["unreachable"].items():
        for name, own in methods.items():
            said = " ".join(re.sub("={4,}", "", own["said"]).split()).replace("|", "/")
            flagged = f"{own['flagged']} of {own['seeds']}"
            cells = [
                f"{own['median_runs']:g}",
                f"{own['worst_relative_error_median']:.1%}",
                said[:230],
            ]
            rows.append([parameters, name, flagged, *cells])
    return table(["parameters", "method", "says so", "runs", "worst error", "last words"], rows)


BLOCKS: dict[str, tuple[Callable[[Sources], str], str]] = {
    "scale": (scale_block, "python -m benchmarks.runs.hourglass_scale"),
    "targets": (targets_block, "make paper"),
    "database": (database_block, "make paper"),
    "table 6": (table6_block, "make paper"),
    "table 7": (table7_block, "make paper"),
    "tables 8 and 9": (table89_block, "make paper"),
    "pile": (pile_block, "python -m benchmarks.runs.pile_scale"),
    "table 8 at full scale": (table8_full_block, "python -m benchmarks.runs.ledge_full_scale"),
    "sensitivity": (sensitivity_block, "make paper"),
    "coverage": (coverage_block, "python -m benchmarks.numerics.coverage"),
    "interpolation": (interpolation_block, "calibrator run cases/quartz_sand_reduced_grid.toml"),
    "similarity": (similarity_block, "python -m benchmarks.runs.similarity"),
    "runs needed": (runs_block, "python -m benchmarks.peers.runs_needed"),
    "adaptive": (adaptive_block, "calibrator run cases/quartz_sand_adaptive.toml"),
    "out of reach": (unreachable_block, "python -m benchmarks.peers.runs_needed"),
}


def filled(page: str, sources: Sources) -> str:
    """The page with every marked block made anew; ValueError names a block that does not exist."""

    def block(match: re.Match[str]) -> str:
        name = match[1]
        make, command = BLOCKS[name]
        try:
            body = make(sources)
        except (FileNotFoundError, KeyError):
            body = f"*Not measured yet: run `{command}`.*"
        return f"<!-- {name} -->\n{body}\n<!-- end -->"

    names = re.findall(r"<!-- (?!end)(.*?) -->", page)
    if set(names) != set(BLOCKS):
        raise ValueError(
            f"blocks of the page and of this script differ: {set(names) ^ set(BLOCKS)}"
        )
    return re.sub(r"<!-- (?!end)(.*?) -->\n.*?<!-- end -->", block, page, flags=re.DOTALL)


def main() -> None:
    """Fill the page, copy the figures, and keep the numbers."""
    sources = Sources()
    page = filled(PAGE.read_text(), sources)
    PAGE.write_text(page)
    PICTURES.mkdir(exist_ok=True)
    for name in COPIED:
        shutil.copy(sources.space.path / "figures" / f"{name}.png", PICTURES / f"paper_{name}.png")
    print(
        f"{PAGE.relative_to(REPO)}: {len(BLOCKS)} blocks, {page.count('Not measured yet')} not"
        " measured yet"
    )


if __name__ == "__main__":
    main()
