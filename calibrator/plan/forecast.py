"""The verb `plan`: tables of the whole plan, and what it will cost."""

from __future__ import annotations

from typing import Any

from calibrator.plan.requests import plan_requests
from calibrator.runs.cost import core_seconds
from calibrator.runs.request import write_table
from calibrator.runs.setups import particles, steps
from calibrator.runs.workspace import Workspace, work_left


def plan(space: Workspace) -> dict[str, Any]:
    """Write the native yade-batch tables of the whole plan, and forecast particles, steps and
    core-hours.
    """
    requests = plan_requests(space.case)
    done = space.finished(requests)
    _, hours_left = work_left(space, requests)
    per_setup = {}
    for setup in space.case.problem.calibration_setups:
        own = [r for r in requests if r.setup == setup]
        write_table(space.folder("plan") / f"{setup}.table", own)
        seconds = core_seconds(own, done)
        per_setup[setup] = {
            "runs": len(own),
            "particles": [min(map(particles, own)), max(map(particles, own))],
            "steps": [min(map(steps, own)), max(map(steps, own))],
            "core_seconds_per_run": [float(seconds.min()), float(seconds.max())],
            "core_hours": float(seconds.sum() / 3600),
        }
    return space.note(
        "plan",
        {
            "runs": len(requests),
            "finished": len(done),
            "core_hours": sum(s["core_hours"] for s in per_setup.values()),
            "core_hours_left": hours_left,
            "setups": per_setup,
        },
    )
