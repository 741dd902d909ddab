"""The section of a report on the model: grains, contact law, time step, and what a run costs."""

from __future__ import annotations

import datetime
from collections.abc import Iterable, Sequence
from statistics import median

from calibrator.case.experiment import ordered
from calibrator.case.physics import time_step
from calibrator.case.vocabulary import PARAMETERS
from calibrator.report.findings import Findings
from calibrator.report.html import Album, note, paragraph, section, table
from calibrator.report.words import experiment_words, in_unit, number, short, text, words
from calibrator.responses.table import experiment_of
from calibrator.runs.cost import core_seconds
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.setups import numbers, particles, steps
from calibrator.search.outcome import COMPROMISE
from calibrator.view.choice import candidate_run

GRAINS = (
    "particle_radius",
    "particle_density",
    "young_modulus",
    "poisson_ratio",
    "restitution",
    "sliding_friction",
    "rolling_friction",
    "rayleigh_fraction",
)
SPRINGS = {
    "epsd2": "{ratio} k_t R_eff^2 (k_t under five grain weights)",
    "epsd": "2.25 k_n mu_r^2 R_eff^2 (k_n under five grain weights)",
}
"""Rolling stiffness by rolling_spring, as yade_scripts/material.py has it."""


def model(findings: Findings, album: Album) -> str:
    """Grains, contact law, and the runs of each experiment at the recommended set."""
    found = requests(findings)
    first = next(iter(found.values()))
    rows = [
        [
            f"{text(words(name))}, {text(PARAMETERS[name].symbol)}" + in_unit(PARAMETERS[name]),
            number(numbers(first)[name]),
            _origin(findings, name),
        ]
        for name in GRAINS
    ]
    return section(
        "The model",
        paragraph(text(contact_law(first))),
        table("Grains and contacts", ["parameter", short(COMPROMISE), "origin"], rows),
        table("Runs of the recommended set", RUN_HEAD, _run_rows(findings, found)),
        note(
            "Medians of fresh runs, or predicted where none has been made. The cost is that of one"
            f" core. {dates(every_run(findings))}"
        ),
    )


def _predicted(findings: Findings, request: Request) -> float:
    """Core-seconds of a run, as far as those that have been made say it."""
    rate = findings.space.case.run.particle_steps_per_second
    return float(core_seconds([request], every_run(findings), rate)[0])


RUN_HEAD = ("experiment", "grains", "time step [s]", "steps", "core-seconds per run", "from")


def _run_rows(findings: Findings, found: dict[str, Request]) -> list[list[str]]:
    rows, problem = [], findings.space.case.problem
    fresh = [
        r
        for own in (findings.verified, findings.validated)
        for r in own.get(COMPROMISE, [])
        if r.status == "ok"
    ]
    for experiment, request in found.items():
        own = [r for r in fresh if experiment_of(problem, r.request) == experiment]
        spent = [_spent(r) for r in own if _spent(r) > 0]
        cost = median(spent) if spent else _predicted(findings, request)
        rows.append(
            [
                text(experiment_words(experiment)),
                number(_noted(own, "particles") or particles(request), 6),
                number(_noted(own, "time_step") or time_step(numbers(request)), 3),
                number(_noted(own, "steps") or steps(request), 6),
                number(cost, 2),
                f"{len(own)} runs" if spent else "prediction",
            ]
        )
    return rows


def _spent(record: Record) -> float:
    """Core-seconds of a run; 0 where it did not say."""
    return sum(float(record.diagnostics.get(k, 0)) for k in ("filling_cpu", "release_cpu"))


def _noted(records: Sequence[Record], key: str) -> float:
    """Median of what runs noted; 0 where none did."""
    return float(median([float(r.diagnostics.get(key, 0)) for r in records] or [0.0]))


def _origin(findings: Findings, name: str) -> str:
    case = findings.space.case
    if name in case.problem.names:
        return "calibrated"
    return "fixed by the case" if name in case.problem.fixed else "default"


def requests(findings: Findings) -> dict[str, Request]:
    """A run of the recommended set in every experiment."""
    space, problem = findings.space, findings.space.case.problem
    shown = ordered((*problem.experiments, *problem.held_out_experiments), problem.conditions)
    return {
        name: candidate_run(space, findings.calibration, COMPROMISE, name).request for name in shown
    }


def contact_law(request: Request) -> str:
    """The contact law of a run in words."""
    p, spring = numbers(request), str(request.value("rolling_spring"))
    stiffness = SPRINGS[spring].format(ratio=number(p["rolling_stiffness_ratio"]))
    step = (
        "a fixed time step"
        if p["time_step"]
        else f"a time step of at most {100 * p['rayleigh_fraction']:.0f} % of the Rayleigh time"
    )
    return (
        "Contacts in YADE: Hertz' normal force with viscous damping that gives the coefficient of"
        " restitution; Mindlin's shear stiffness without partial slip, capped by Coulomb's friction"
        " mu_s |F_n|; an elastic-plastic rolling spring without dashpot, its moment capped at mu_r"
        f" R_eff |F_n| and its stiffness {stiffness} ({spring}). Gravity is 9.81 m/s2; {step}"
        f" ({number(time_step(p), 3)} s at the recommended set)."
    )


def every_run(findings: Findings) -> list[Record]:
    """The runs of plan, verification and validation."""
    fresh = [
        r for by in (findings.verified, findings.validated) for own in by.values() for r in own
    ]
    return [*findings.records, *fresh]


def dates(records: Iterable[Record]) -> str:
    """On which days runs were started, in a sentence."""
    started = [float(r.provenance["started"]) for r in records if r.provenance.get("started")]
    if not started:
        return "Their dates are not recorded, as for runs that come with the project."
    ends = [
        datetime.datetime.fromtimestamp(at, datetime.UTC).date().isoformat()
        for at in (min(started), max(started))
    ]
    when = ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"
    return f"The {len(started)} runs that were made here are of {when} (UTC)."
