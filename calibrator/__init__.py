"""Calibrate the particle parameters of a discrete element model with YADE.

The workflow, from Python (the command `calibrator` has the same verbs):

    import calibrator
    case = calibrator.read_case("cases/coarse_sand.toml")
    space = calibrator.Workspace(case, "results/coarse_sand")
    found = calibrator.calibrate(space)
    print(found.compromise.parameters, found.compromise_reason)

Rooms, from the ground; a room imports only from those above it in this list:

    errors, files, threads  what everything may use
    case                    what is asked: case file, lab file, vocabulary
    laboratory              raw data of a laboratory made rows of the lab file: measure
    runs                    YADE, driven and believed: requests, records, engines
    responses               interpolated responses, targets, objectives
    plan                    phase 1, the database: plan, run, collect
    search                  phase 2, the optimisation: calibrate
    diagnosis               the missing effect: preflight, diagnose
    verification            phase 3: verify, validate
    view                    one run to be seen: view
    foresight               what can be known to be wrong, or odd, before a run is made
    first_case              a case of somebody's own: init
    check, report, terminal what is said, before and after
    handover                the material for other scenes and engines
    demo                    the case that comes with the project
    cli, summary            the command line, and the schema of what it notes
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from calibrator.case.toml import read_case as read_case
    from calibrator.check import check_case as check_case
    from calibrator.diagnosis.diagnose import diagnose as diagnose
    from calibrator.diagnosis.preflight import preflight as preflight
    from calibrator.errors import CalibratorError as CalibratorError
    from calibrator.handover.export import export as export
    from calibrator.handover.write_card import write_card as write_card
    from calibrator.plan.forecast import forecast as forecast
    from calibrator.plan.run import collect as collect
    from calibrator.plan.run import run_plan as run_plan
    from calibrator.report.page import write_report as write_report
    from calibrator.runs.workspace import Workspace as Workspace
    from calibrator.search.calibrate import calibrate as calibrate
    from calibrator.verification.verify import validate as validate
    from calibrator.verification.verify import verify as verify
    from calibrator.view.view import view_run as view_run

_HOMES = {
    "CalibratorError": "errors",
    "read_case": "case.toml",
    "Workspace": "runs.workspace",
    "check_case": "check",
    "forecast": "plan.forecast",
    "run_plan": "plan.run",
    "collect": "plan.run",
    "calibrate": "search.calibrate",
    "verify": "verification.verify",
    "validate": "verification.verify",
    "write_report": "report.page",
    "preflight": "diagnosis.preflight",
    "diagnose": "diagnosis.diagnose",
    "view_run": "view.view",
    "export": "handover.export",
    "write_card": "handover.write_card",
}

__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: the search's libraries take seconds."""
    if name not in _HOMES:
        raise AttributeError(f"module calibrator has no attribute {name!r}")
    return getattr(importlib.import_module(f"calibrator.{_HOMES[name]}"), name)
