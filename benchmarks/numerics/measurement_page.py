"""Fills the marked tables of docs/own_measurement.md.

    python -m benchmarks.numerics.measurement_page

They come from benchmarks/results/smallest_vessels.json and fixed_values.json, and from the table
that `check` warns by, calibrator/foresight/smallest.py.
"""

import json
import re
from collections.abc import Callable
from typing import Any

from benchmarks.common import RESULTS
from benchmarks.paper.sources import REPO, table
from calibrator.foresight.smallest import LEAST

PAGE = REPO / "docs" / "own_measurement.md"
NAMES = {
    "bulk_density": "density [%]",
    "mass_flow_rate": "rate [%]",
    "pile_equivalent_angle_deg": "heap, equivalent [°]",
    "pile_angle_of_repose_deg": "heap, fitted [°]",
    "ledge_equivalent_angle_deg": "ledge, equivalent [°]",
    "ledge_angle_of_repose_deg": "ledge, fitted [°]",
    "drained_equivalent_angle_deg": "crater, equivalent [°]",
}
Results = dict[str, Any]


def least_block(_: Results) -> str:
    """The table of `check`."""
    rows = [
        [
            one.what,
            f"{one.least:g} {one.unit}",
            ", ".join(f"`{n}`" for n in one.responses),
            one.seen,
        ]
        for one in LEAST.values()
    ]
    return table(["what", "limit", "for", "on the other side, in our runs"], rows)


def span(low: float, high: float) -> str:
    """Two numbers, or one where they are the same."""
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def angles(sizes: Results, label: str) -> list[list[str]]:
    """Rows of fitted beside equivalent angles."""
    return [
        [
            label,
            span(one["from"], one["to"]),
            span(*one["grains"]),
            str(one["runs"]),
            f"{one['fitted_minus_equivalent']:+.1f}",
            f"{one['lowest']:+.1f} to {one['highest']:+.1f}",
            *(
                "" if one[n] is None else f"{one[n]:.1f}"
                for n in ("scatter_fitted", "scatter_equivalent")
            ),
        ]
        for one in sizes.values()
    ]


def angles_block(found: Results) -> str:
    """Fitted beside equivalent angles, by size."""
    head = [
        "",
        "size [d]",
        "grains",
        "runs",
        "fitted less equivalent [°]",
        "single runs [°]",
        "scatter, fitted [°]",
        "equivalent [°]",
    ]
    sizes = (("heaps", "heap, high"), ("ledges", "ledge, long"), ("craters", "crater, slope"))
    return table(head, [row for key, label in sizes for row in angles(found[key], label)])


def mean(one: Results, digits: int = 1) -> str:
    """A mean and its standard error."""
    error = one["standard_error"]
    return f"{one['mean']:.{digits}f}" + ("" if error is None else f" ± {error:.{digits}f}")


def lifts_block(found: Results) -> str:
    """The same grains in larger heaps and from slower lifts."""
    rows = []
    for name, one in found["heap_sizes"].items():
        rolling, sliding, grains, speed = name.split(", ")
        rows.append(
            [
                f"{rolling}, {sliding}",
                grains.removesuffix(" grains"),
                f"{speed}, {one['speed_over_root_gd']:.2g}",
                f"{one['height']:.1f}",
                str(one["runs"]),
                mean(one["pile_angle_of_repose_deg"]),
                mean(one["pile_equivalent_angle_deg"]),
            ]
        )
    head = [
        "mu_r, mu_s",
        "grains",
        "lift, over sqrt(g d)",
        "height [d]",
        "runs",
        "fitted [°]",
        "equivalent [°]",
    ]
    return table(head, rows)


def necks_block(found: Results) -> str:
    """How many runs clogged."""
    rows = []
    for name, one in found["necks"].items():
        low, high = one["interval"]
        rows.append(
            [
                span(one["from"], one["to"]),
                "rough" if name.endswith("rough") else "others",
                f"{one['clogged']} of {one['runs']}",
                f"{100 * low:.2g} to {100 * high:.2g} %",
            ]
        )
    return table(["neck [d]", "grains", "clogged", "95 % interval"], rows)


def times_block(found: Results) -> str:
    """Scatter of what a scale measures."""
    rows = [
        [
            name,
            *(
                f"{100 * one[n]:.2g} %"
                for n in ("mass_flow_rate", "emptying_time", "discharge_time")
            ),
            f"{1e3 * one['onset_delay_s']:.2g} ms",
            f"{100 * one['bulk_density']:.1g} %",
        ]
        for name, one in found["times"].items()
    ]
    head = ["hourglass", "rate", "emptying time", "time to rest", "onset", "filled density"]
    return table(head, rows)


def fills_block(found: Results) -> str:
    """The same hourglass with more in it."""
    rows = []
    for name, one in found["fills"].items():
        rate = one.get("mass_flow_rate")
        flow = (
            [
                mean({n: v and 1e3 * v for n, v in rate.items()}),
                mean(one["late_early_ratio"], 2),
                mean(one["drained_equivalent_angle_deg"]),
            ]
            if rate
            else ["clogged", "", ""]
        )
        height = f"{one['height_over_neck']:.2g}"
        rows.append([name, height, str(one["runs"]), mean(one["bulk_density"], 0), *flow])
    head = ["fill", "height over neck", "runs", "density [kg/m³]", "rate [g/s]"]
    return table([*head, "late over early rate", "equivalent angle [°]"], rows)


def change(one: Results) -> str:
    """A change and its standard error."""
    return f"{one['change']:+.1f} ± {one['standard_error']:.1f}"


def fixed_block(found: Results) -> str:
    """What restitution and walls change."""
    rows = [
        [
            f"{key.split('.')[0]}: {NAMES[key.split('.')[1]]}",
            change(one),
            change(found["wall_friction_ratio"][key]),
        ]
        for key, one in found["restitution"].items()
    ]
    return table(["", "restitution 0.6 instead of 0.9", "walls half as rough as the grains"], rows)


def stiffness_block(found: Results) -> str:
    """What stiffer grains change."""
    rows = []
    for label, one in (
        ("a doubling, coarse sand", found["doubled_stiffness"]["coarse sand"]),
        ("1 to 5 MPa, grains of 0.8 mm", found["1 to 5 MPa"]),
        ("a doubling, quartz sand", found["doubled_stiffness"]["quartz sand"]),
    ):
        rows.append(
            [
                label,
                f"{one['stiffness'][0]:,.0f} to {one['stiffness'][1]:,.0f}",
                *(
                    change(one[n])
                    for n in ("bulk_density", "drained_equivalent_angle_deg", "mass_flow_rate")
                ),
            ]
        )
    return table(["", "E / (rho g d)", "density [%]", "equivalent angle [°]", "rate [%]"], rows)


def worth_block(found: Results) -> str:
    """What a tenth more of a friction changes."""
    rows = [
        [f"{key.split('.')[0]}: {NAMES[key.split('.')[1]]}"]
        + [f"{at[n]:+.1f}" for n in ("rolling_friction", "sliding_friction") for at in one.values()]
        for key, one in found["worth"].items()
    ]
    at = ("0.15, 0.3", "0.2, 0.45", "0.3, 0.55")
    head = ["at mu_r, mu_s =", *(f"mu_r, {x}" for x in at), *(f"mu_s, {x}" for x in at)]
    return table(head, rows)


def glass_block(found: Results) -> str:
    """What a small heap says of glass beads."""
    names = ("pile_angle_of_repose_deg", "pile_equivalent_angle_deg")
    fitted, equivalent = (found["glass"][n] for n in names)
    smooth = "at_a_rolling_friction_of_0.1"
    return (
        "A heap of 684 grains that is lifted at 40 mm/s stands at"
        f" {found['glass']['angle']:g} degrees only with a rolling friction of"
        f" {fitted['rolling_friction']:g} and a sliding one of {fitted['sliding_friction']:g} or"
        f" more (fitted angle), or {equivalent['sliding_friction']:g} (equivalent). At a rolling"
        f" friction of 0.1 it never gets beyond {fitted[smooth]:.1f} or {equivalent[smooth]:.1f}"
        " degrees, with any sliding friction up to 0.65."
    )


def beads_block(found: Results) -> str:
    """What frictions a small heap gives back for smooth grains."""
    rows = []
    for name, one in found["beads"].items():
        lift, _, targets = name.partition(": ")
        for long, short in (("pile_angle_of_repose_deg", "fitted angle"),
                            ("pile_equivalent_angle_deg", "equivalent angle"),
                            ("bulk_density", "filled density")):  # fmt: skip
            targets = targets.replace(long, short)
        frictions = (one["sliding_friction"], one["rolling_friction"])
        rows.append(
            [lift, targets, *(f"{b:g} ({low:g} to {high:g})" for b, low, high in frictions)]
        )
    head = ["lift of the laboratory", "targets", "sliding friction", "rolling friction"]
    return table(head, rows)


BLOCKS: dict[str, Callable[[Results], str]] = {
    "least": least_block,
    "glass": glass_block,
    "beads": beads_block,
    "lifts": lifts_block,
    "angles": angles_block,
    "necks": necks_block,
    "times": times_block,
    "fills": fills_block,
    "worth": worth_block,
    "stiffness": stiffness_block,
    "fixed": fixed_block,
}


def filled(page: str) -> str:
    """The page with every marked block made anew; KeyError names a block that does not exist."""
    found: Results = {}
    for name in ("smallest_vessels", "fixed_values"):
        found |= json.loads((RESULTS / f"{name}.json").read_text())

    def block(match: re.Match[str]) -> str:
        return f"<!-- {match[1]} -->\n{BLOCKS[match[1]](found)}\n<!-- end -->"

    return re.sub(r"<!-- (?!end)(.*?) -->\n.*?<!-- end -->", block, page, flags=re.DOTALL)


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text()))
