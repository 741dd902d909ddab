"""Blocks on what was run: the scale of the hourglass, the targets, the databases."""

from collections import Counter

from benchmarks.paper.sources import GRID, Sources, table, with_error, workspace
from calibrator.plan.run import database_records
from calibrator.runs.record import Record


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
