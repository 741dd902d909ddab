"""What a laboratory reports of a made-up world, and the case that a user writes about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from calibrator.case.problem import Target
from calibrator.case.vocabulary import RESPONSES as VOCABULARY
from calibrator.case.vocabulary import parameters_of
from tests.campaigns.answers.worlds import NEAR_ZERO, RESPONSES, MadeUp

KINDS = ("consistent", "unreachable", "mis-scaled")
SHARES = (0.74, 0.16, 0.1)


@dataclass(frozen=True)
class Row:
    """A line of the lab file."""

    target: Target
    role: str
    condition: str = ""


@dataclass(frozen=True)
class Laboratory:
    """Rows, and what was done to them.

    kind : one of KINDS; spoiled : key of the target that was moved.
    """

    rows: tuple[Row, ...]
    kind: str
    spoiled: str = ""

    @property
    def targets(self) -> list[Target]:
        """Those that are calibrated, in the order of the file."""
        return [r.target for r in self.rows if r.role == "calibrate"]

    def write(self, path: Path) -> None:
        """Write the lab file."""
        lines = ["setup,condition,response,value,scatter,replicates,unit,role"]
        for row in self.rows:
            t = row.target
            scatter = repr(t.scatter) if t.scatter else ""
            unit = VOCABULARY[t.response].unit
            lines.append(
                f"{t.setup},{row.condition},{t.response},{t.value!r},{scatter},{t.replicates},"
                f"{unit},{row.role}"
            )
        path.write_text("\n".join(lines) + "\n")


def measure(made: MadeUp, rng: np.random.Generator) -> Laboratory:
    """One to ten targets in one to three set-ups, some held out, each with its own error."""
    keys = [k for k in made.surfaces if not k.endswith(NEAR_ZERO)]
    setups = rng.permutation(list(RESPONSES))[: rng.integers(1, 4)]
    own = [k for k in keys if k.split(".")[0] in setups]
    count = int(min(len(own), rng.integers(1, 11)))
    used = [str(k) for k in rng.permutation(own)[:count]]
    used += _for_the_rest(made, used)
    if rng.random() < 0.15 and "hourglass" in setups:
        used.append(f"hourglass.{NEAR_ZERO}")
    for key in [k for k in used if k.endswith("residual_fraction")]:
        if rng.random() < 0.5:
            used.append(key.replace("fraction", "mass"))  # the same quantity once more
    rows = [Row(_measured(made, key, rng), "calibrate") for key in used]
    rows = _repeats_agree(rows)
    rest = [str(k) for k in rng.permutation([k for k in keys if k not in used])]
    rows += [Row(_measured(made, k, rng), "held_out") for k in rest[: rng.integers(0, 3)]]
    return _spoiled(Laboratory(tuple(rows), "consistent"), made, rng)


def _for_the_rest(made: MadeUp, used: list[str]) -> list[str]:
    """A target of a set-up that has a parameter which those used so far have not.

    A case that calibrates what no target's set-up has is refused.
    """
    more: list[str] = []
    for p in made.parameters:
        setups = {k.split(".")[0] for k in (*used, *more)}
        if not any(p.name in parameters_of(s) for s in setups):
            own = next(s for s in RESPONSES if p.name in parameters_of(s))
            more.append(f"{own}.bulk_density")
    return more


def _measured(made: MadeUp, key: str, rng: np.random.Generator) -> Target:
    """A mean over replicates, off by its own error; some do not say how much they scatter."""
    setup, response = key.split(".")
    source, factor = key, 1.0
    if response == "residual_mass":
        source, factor = f"{setup}.residual_fraction", 0.016
    value = factor * float(made.true(source, made.truth[None])[0])
    replicates = int(rng.integers(1, 11))
    if made.surfaces[source].additive:
        scatter, tolerance = float(rng.uniform(0.3, 1.0)), 0.03
        seen = value + rng.normal() * scatter / replicates**0.5
        return Target(setup, response, seen, scatter, replicates)
    known, tolerance = rng.random() > 0.15, float(rng.choice([0.03, 0.01, 0.05]))
    scatter = abs(value) * float(10 ** rng.uniform(-3, -1.3))
    error = scatter / replicates**0.5 if known else tolerance * abs(value) / 2
    seen = value + rng.normal() * error
    return Target(setup, response, seen, scatter if known else 0.0, replicates, 1.0, tolerance)


def _repeats_agree(rows: list[Row]) -> list[Row]:
    """The residual mass as the laboratory computes it from the same residual fraction."""
    fractions = {r.target.setup: r.target for r in rows if r.target.response == "residual_fraction"}
    out = []
    for row in rows:
        t = row.target
        if t.response == "residual_mass" and t.setup in fractions:
            f = fractions[t.setup]
            t = replace(
                f, response="residual_mass", value=0.016 * f.value, scatter=0.016 * f.scatter
            )
        out.append(Row(t, row.role))
    return out


def _spoiled(lab: Laboratory, made: MadeUp, rng: np.random.Generator) -> Laboratory:
    """Move one target out of the reach of the box, or to another unit, in some laboratories."""
    kind = str(rng.choice(KINDS, p=SHARES))
    able = [i for i, r in enumerate(lab.rows)
            if r.role == "calibrate" and not r.target.response.endswith((NEAR_ZERO, "mass"))
            and not any(o.target.response == "residual_mass" for o in lab.rows)]  # fmt: skip
    if kind == "consistent" or not able:
        return lab
    index = int(rng.choice(able))
    target = lab.rows[index].target
    if kind == "mis-scaled":
        value = target.value * 10.0 ** rng.choice([-3, -2, -1, 1, 2, 3])
        scatter = target.scatter * abs(value / target.value)
    else:
        values = made.true(target.key, rng.random((4000, len(made.truth))))
        step = max(target.tolerance * abs(target.value), 2 * target.standard_error)
        value = values.max() + 5 * step if rng.random() < 0.5 else values.min() - 5 * step
        value = value if value > 0.1 * values.min() else values.max() + 5 * step
        scatter = target.scatter
    moved = replace(target, value=float(value), scatter=float(scatter))
    rows = [replace(r, target=moved) if i == index else r for i, r in enumerate(lab.rows)]
    return Laboratory(tuple(rows), kind, target.key)


def case_text(made: MadeUp, lab: Laboratory, rng: np.random.Generator) -> str:
    """A case file: grid, Sobol or adaptive design, and everything else by lot."""
    dimensions = len(made.parameters)
    design = str(rng.choice(["grid", "sobol", "adaptive"], p=[0.2, 0.5, 0.3]))
    if made.constraint or dimensions > 3:
        design = "sobol" if design == "grid" else design
    lines = ['name = "made_up"', 'measured = "lab.csv"']
    if made.constraint:
        lines.append(f'constraints = ["{made.constraint}"]')
    samples = {1: 7, 2: 4, 3: 3}.get(dimensions, 3)
    for p in made.parameters:
        lines += [f"[parameters.{p.name}]", f"low = {p.low!r}", f"high = {p.high!r}",
                  f"samples = {samples}", f'scale = "{p.scale}"']  # fmt: skip
    sets = int(rng.integers(6 + 4 * dimensions, 10 + 10 * dimensions))
    replicates = int(rng.choice([1, 2, 3, 5, 10], p=[0.15, 0.45, 0.25, 0.1, 0.05]))
    plan = {"design": f'"{design}"', "sets": sets, "replicates": replicates}
    if design == "adaptive":
        setups = len({t.setup for t in lab.targets})
        plan["sets"], plan["replicates"] = 4 + 2 * dimensions, max(2, min(replicates, 4))
        plan["most_runs"] = setups * (16 + 10 * dimensions)
    elif rng.random() < 0.2:
        plan["replicated_sets"] = int(rng.integers(1, 6))
    objectives = ["error", "time_cost"] if rng.random() < 0.8 else ["time_cost", "error"]
    tables: Mapping[str, Mapping[str, object]] = {
        "plan": plan,
        "interpolation": {
            "method": '"multilinear"' if design == "grid" and rng.random() < 0.5 else '"process"'
        },
        "search": {"population": 60, "generations": 20, "repeats": 1,
                   "objectives": repr(objectives).replace("'", '"')},
        "verify": {"replicates": int(rng.integers(2, 8)), "spread_replicates": 1},
        "run": {"jobs": 1, "budget_core_hours": 1000},
    }  # fmt: skip
    for name, table in tables.items():
        lines += [f"[{name}]", *(f"{key} = {value}" for key, value in table.items())]
    for t in [r.target for r in lab.rows]:
        lines += [f'[targets."{t.key}"]', f"tolerance = {t.tolerance!r}"]
    return "\n".join(lines) + "\n"
