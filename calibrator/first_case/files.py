"""The two files: a case with comments that say why, and a lab file of what the case simulates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from calibrator.case.lab import COLUMNS, Observable
from calibrator.case.problem import USUAL_TOLERANCE
from calibrator.case.vocabulary import RESPONSES, SETUPS
from calibrator.first_case.answers import EVEN_SPREAD, Answers
from calibrator.first_case.grains import SHAPES, SOFTNESS, open_parameters, stiffness
from calibrator.first_case.sizing import Design
from calibrator.first_case.vessels import Kept, Lost, carried, smaller, softened
from calibrator.runs.request import Request
from calibrator.runs.setups import NOMINAL_FRACTION, SETUP_ENTRIES, numbers

ONE_OF_TWO = (
    ("drained_equivalent_angle_deg", "residual_fraction", "residual_mass"),
    ("ledge_equivalent_angle_deg", "residual_fraction", "residual_mass"),
    ("mass_flow_rate", "emptying_time", "discharge_time"),
    ("pile_equivalent_angle_deg", "pile_angle_of_repose_deg"),
    ("ledge_equivalent_angle_deg", "ledge_angle_of_repose_deg"),
    ("drained_equivalent_angle_deg", "drained_angle_of_repose_deg"),
    ("drum_angle_deg", "drum_central_angle_deg", "drum_height_centre"),
    ("drum_upper_angle_deg", "drum_height_upper_06", "drum_height_upper_03"),
    ("drum_lower_angle_deg", "drum_height_lower_06", "drum_height_lower_03"),
)
"""Responses of a set-up that say much the same; the first of them that was measured is fitted, the
others are held out.
"""
GIVEN = ("drum_filled_share",)
"""Responses that the filling decides and no parameter."""
ENOUGH = 3
"""Targets that are left when a set-up is held out: one more than the two frictions."""
SPARED_FIRST = ("ledge", "conical_pile", "rotating_drum", "hourglass")
LONGEST_TIME = 5.0


@dataclass(frozen=True)
class Draft:
    """A case before it is written.

    Attributes
    ----------
    vessels : that are simulated, by set-up [SI].
    rows : of the lab file, as the simulated vessels would show them; steps : what became of each on
        the way from the laboratory's vessel, by its key; lost : why others say nothing there.
    bounds, fixed : of the parameters; tolerances : of targets whose step is less sure than theirs.
    softness : pressure at the bottom over the largest Young's modulus.
    """

    vessels: dict[str, dict[str, float]]
    rows: tuple[Observable, ...]
    steps: dict[str, Kept]
    lost: dict[str, str]
    bounds: dict[str, tuple[float, float]]
    fixed: dict[str, float]
    tolerances: dict[str, float]
    softness: float

    @property
    def targets(self) -> list[Observable]:
        """Rows that are calibrated on."""
        return [r for r in self.rows if r.role == "calibrate"]

    @property
    def experiments(self) -> int:
        """Set-ups that are calibrated on."""
        return len({r.setup for r in self.targets})


def draft(answers: Answers, across: float, softness: float = SOFTNESS[0]) -> Draft:
    """The case of these answers in vessels of at most so many grain diameters across.

    softness : of the grains, one of SOFTNESS.
    """
    vessels, rows, lost = {}, list[Observable](), dict[str, str]()
    steps = dict[str, Kept]()
    for setup in answers.vessels:
        own, lab = [r for r in answers.rows if r.setup == setup], laboratory(answers, setup)
        new = smaller(setup, lab, across, [r.response for r in own])
        for row in own:
            step = carried(setup, row.response, row.value, lab, new)
            if isinstance(step, Kept) and step.error and _is_near_zero(row):
                step = Lost("it is near zero, where no tolerance has room for what its vessel does")
            if isinstance(step, Lost):
                lost[row.key] = step.words
            else:
                steps[row.key] = step
                rows.append(replace(row, value=step.value))
        if any(r.setup == setup for r in rows):
            vessels[setup] = new
    rows = _with_roles(rows)
    targets = [r.response for r in rows if r.role == "calibrate"]
    density = answers.particle_density
    highest = max((fill_height(v) for v in vessels.values()), default=0.0)
    young = [stiffness(density, highest, s) for s in (SOFTNESS[-1], softness)]
    bounds, fixed = open_parameters(answers.shape, targets, density, *young)
    if "young_modulus" in fixed:
        steps = {r.key: softened(r.response, steps[r.key], softness) for r in rows}
        rows = [replace(r, value=steps[r.key].value) for r in rows]
    tolerances = {
        r.key: math.ceil(100 * 2 * steps[r.key].error / abs(r.value)) / 100
        for r in rows
        if r.role != "diagnose" and 2 * steps[r.key].error > USUAL_TOLERANCE * abs(r.value) > 0
    }
    return Draft(vessels, tuple(rows), steps, lost, bounds, fixed, tolerances, softness)


def _is_near_zero(row: Observable) -> bool:
    """Whether its tolerance is two of its standard errors, and nothing else: `Target.scale`."""
    target = row.target()
    return target.scale != abs(target.value)


def laboratory(answers: Answers, setup: str) -> dict[str, float]:
    """The laboratory's vessel with radius and density of its grains."""
    grains = {"particle_radius": answers.grain / 2, "particle_density": answers.particle_density}
    return {**answers.vessels[setup], **grains}


def fill_height(vessel: dict[str, float]) -> float:
    """Height [m] of the fill of a vessel."""
    if "fill_height" in vessel:
        return vessel["fill_height"]
    if "drum_diameter" in vessel:
        return vessel["drum_diameter"] / 2
    base = math.pi / 4 * vessel["cylinder_diameter"] ** 2
    return vessel["fill_mass"] / (NOMINAL_FRACTION * vessel["particle_density"] * base)


def _with_roles(rows: Sequence[Observable]) -> list[Observable]:
    """The rows, some of them held out.

    Of several that say the same all but the first; and a whole set-up, the one with the fewest
    targets, where the others have enough without it.
    """
    demoted = set()
    for group in ONE_OF_TWO:
        for setup in {r.setup for r in rows}:
            own = [f"{setup}.{n}" for n in group]
            have = [r.key for r in rows if r.key in own and r.role == "calibrate"]
            demoted |= set(sorted(have, key=own.index)[1:])
    used = [r for r in rows if r.role == "calibrate" and r.response not in GIVEN]
    left = [r for r in used if r.key not in demoted]
    count = {setup: sum(r.setup == setup for r in left) for setup in SETUPS}
    spare = [s for s in SPARED_FIRST if 0 < count[s] <= len(left) - ENOUGH]
    if spare and not any(r.role == "held_out" for r in rows):
        fewest = min(spare, key=count.__getitem__)
        demoted |= {r.key for r in left if r.setup == fewest}
    rows = [replace(r, role="diagnose") if r.response in GIVEN else r for r in rows]
    return [replace(r, role="held_out") if r.key in demoted else r for r in rows]


def lab_text(answers: Answers, own: Draft) -> str:
    """The lab file."""
    lines = [f"# {answers.name}: what was measured, as the vessels of {answers.name}.toml show it"]
    measured = {r.key: r for r in answers.rows}
    for key, step in own.steps.items():
        if step.words:
            value = measured[key].value
            lines.append(f"# {key}: measured {value:.6g}; {step.words}")
    lines += [
        f"# {key}: measured {measured[key].value:.6g}; left out: {why}"
        for key, why in own.lost.items()
    ]
    lines += [f"# converted: {words}" for words in answers.converted]
    lines.append(",".join(COLUMNS))
    for r in own.rows:
        scatter = f"{r.scatter:.4g}" if r.scatter else ""
        unit = RESPONSES[r.response].unit
        lines.append(
            f"{r.setup},{r.response},{r.value:.7g},{scatter},{r.replicates},{unit},{r.role}"
        )
    return "\n".join(lines) + "\n"


def case_text(answers: Answers, own: Draft, design: Design) -> str:
    """The case file."""
    about = answers.about or f"{answers.name}: {SHAPES[answers.shape].about}"
    lines = [
        f"# {answers.name}, written by `calibrator init`. docs/case_file.md explains every key.",
        f'name = "{answers.name}"',
        f"about = {_quoted(about)}",
        f'measured = "{answers.name}_lab.csv"',
        "",
        *_parameters(own),
        *_fixed(answers, own),
        *_vessels(answers, own),
        *(
            line
            for key, tolerance in own.tolerances.items()
            for line in (
                f'[targets."{key}"]',
                f"tolerance = {tolerance:g}  # {own.steps[key].words}",
                "",
            )
        ),
        *_plan(own, design),
        "",
        "[run]",
        f"budget_core_hours = {answers.budget:g}  # of one command",
    ]
    if answers.rate:
        lines.append(f"particle_steps_per_second = {answers.rate:.2g}  # up to a thousand grains")
    return "\n".join(lines) + "\n"


_WHY = {
    "rolling_friction": "stands for the shape of the grains",
    "sliding_friction": "between grains, and at walls",
    "particle_density": "effective: the solid's, give or take other packings than spheres have",
    "young_modulus": "from too soft to as stiff as the fill needs; the softest usable is cheapest",
}


def _parameters(own: Draft) -> list[str]:
    lines = []
    for name, (low, high) in own.bounds.items():
        lines += [f"[parameters.{name}]  # {_WHY[name]}", f"low = {low:g}", f"high = {high:g}"]
        if low > 0 and high / low >= 10:
            lines.append('scale = "log"')
        lines.append("")
    return lines


def _fixed(answers: Answers, own: Draft) -> list[str]:
    lines = ["[fixed]", f"particle_radius = {answers.grain / 2:.6g}"]
    if answers.spread > EVEN_SPREAD:
        lines.append(f"size_spread = {min(answers.spread, 0.4):.3g}  # of the sieve fraction")
    for name, value in own.fixed.items():
        why = {
            "young_modulus": "  # soft enough to be cheap: grains overlap by some"
            f" {100 * own.softness ** (2 / 3):.1g} %",
            "particle_density": "",
        }.get(name, f"  # typical of {answers.shape} grains; the data do not say")
        lines.append(f"{name} = {value:g}{why}")
    lines.append("poisson_ratio = 0.3")
    if answers.restitution is None:
        typical = SHAPES[answers.shape].restitution
        lines.append(f"restitution = {typical:g}  # typical of {answers.shape} grains")
    else:
        lines.append(f"restitution = {answers.restitution:g}")
    longest = max(_seconds(*item) for item in own.vessels.items())
    if longest > LONGEST_TIME:
        lines.append(f"longest_time = {longest}")
    return [*lines, ""]


def _seconds(setup: str, vessel: dict[str, float]) -> int:
    """A time [s] that the release of a run takes twice, and two more to settle."""
    p = numbers(Request.of(setup, **vessel, seed=1))
    return math.ceil(2 * SETUP_ENTRIES[setup].release(p) + 2)


def _vessels(answers: Answers, own: Draft) -> list[str]:
    lines = []
    for setup, vessel in own.vessels.items():
        lab = laboratory(answers, setup)
        lines.append(f"[setups.{setup}]")
        for name, value in vessel.items():
            if name in ("particle_radius", "particle_density") and value == lab[name]:
                continue
            note = ""
            if name in lab and not math.isclose(lab[name], value, rel_tol=1e-3):
                note = f"  # {lab[name]:g} in the laboratory"
            lines.append(f"{name} = {value:g}{note}")
        lines.append("")
    return lines


def _plan(own: Draft, design: Design) -> list[str]:
    lines = ["[plan]", f'design = "{design.kind}"', f"sets = {design.sets}"]
    lines.append(f"replicates = {design.replicates}")
    if design.kind == "adaptive":
        lines.append(f"most_runs = {design.most_runs}")
    if {"particle_density", "young_modulus"} <= own.bounds.keys():
        lines += ["", "[interpolation]", "similarity = true  # only E over density matters"]
    objectives = '"error", "time_cost"' if "young_modulus" in own.bounds else '"error"'
    lines += [
        "",
        "[search]",
        f"objectives = [{objectives}]",
        "population = 500",
        "generations = 60",
    ]
    return [*lines, "", "[verify]", "replicates = 5", "spread_replicates = 1"]


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
