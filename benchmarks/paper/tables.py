"""Blocks beside the paper's Tables 6 to 9."""

from typing import Any

import numpy as np

from benchmarks.paper.sources import Sources, table, with_error

LETTERS = "ABCD"
COUNTERPARTS = {  # our target's response -> the paper's error and response
    "bulk_density": ("density", "bulk_density"),
    "drained_equivalent_angle_deg": ("angle", "drained_angle_of_repose_deg"),
    "mass_flow_rate": ("time", "discharge_time"),
}


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
        "not measured"
        if row is None or row["simulated"] is None
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
    rows.append(
        ["O1", *cells, *("–" if o["o1"] is None else f"{o['o1']:.4f}" for o in ours.values())]
    )
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
