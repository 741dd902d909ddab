"""The verb `check`: everything that can be wrong before a run is made."""

from __future__ import annotations

from typing import Any

import numpy as np

from calibrator.case.physics import rayleigh_time, time_step_warning
from calibrator.case.problem import known
from calibrator.case.vocabulary import SETUPS
from calibrator.diagnosis.experiments import unmeasured
from calibrator.errors import CalibratorError
from calibrator.plan.requests import design_points, plan_requests
from calibrator.plan.seeds import overlapping
from calibrator.responses.objectives import OBJECTIVES
from calibrator.runs.engines import ENGINES
from calibrator.runs.setups import geometry_warnings
from calibrator.runs.workspace import Workspace


def check_case(space: Workspace) -> dict[str, Any]:
    """Everything that can be wrong before a run: time steps, geometry, a missing YADE."""
    case, warnings = space.case, []
    for name in case.search.objectives:
        known(name, OBJECTIVES, "objective")
    if meeting := overlapping(case):
        raise CalibratorError("; ".join(meeting[:3]))
    requests = plan_requests(case)
    for setup in SETUPS:
        probe = next((r for r in requests if r.setup == setup), None)
        if probe is not None:
            warnings += geometry_warnings(probe)
    columns = case.problem.columns(design_points(case))
    fraction, fixed_step = (
        float(np.max(columns["rayleigh_fraction"])),
        float(np.max(columns["time_step"])),
    )
    shortest = float(np.min(rayleigh_time(columns)))
    step = fixed_step or fraction * shortest
    warnings += [w for w in [time_step_warning(step * (1 - 1e-9), columns)] if w]
    if step > 0.2 * shortest * (1 + 1e-9) and np.min(columns["restitution"]) < 0.6:
        warnings.append(
            "impacts with a restitution below 0.6 lose too much speed at a time step of"
            f" {step / shortest:.0%} of the Rayleigh time: set rayleigh_fraction = 0.2 (or a"
            " smaller time_step) under [fixed]"
        )
    ENGINES[space.engine](case).require()
    warnings += unmeasured(case)
    return space.note(
        "check",
        {
            "runs": len(requests),
            "targets": [t.key for t in case.problem.targets],
            "warnings": warnings,
        },
    )
