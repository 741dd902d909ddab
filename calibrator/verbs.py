"""The verbs of the command line: what each is in words, and the function that does it."""

from __future__ import annotations

import importlib
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from calibrator.terminal import ProgressBar

if TYPE_CHECKING:
    from calibrator.runs.workspace import Workspace


@dataclass(frozen=True)
class Verb:
    """A step of the workflow: what it does in words, and where the function is that does it.

    function : "module:name" below calibrator, imported only once the verb is called; makes_runs :
    what it drives YADE for, in a word; it has the folder of the results to itself then and reports
    progress. Empty where it makes none.
    """

    about: str
    function: str
    makes_runs: str = ""

    def __call__(self, space: Workspace, *more: Any) -> Any:
        """Carry the verb out; returns its outcome."""
        module, _, name = self.function.partition(":")
        verb = getattr(importlib.import_module(f"calibrator.{module}"), name)
        if not self.makes_runs:
            return verb(space, *more)
        with space.runs.alone():
            return verb(space, ProgressBar(sys.stderr, self.makes_runs), *more)


VERBS = {
    "check": Verb("find everything wrong with a case before a run is made", "check:check_case"),
    "plan": Verb("write the yade-batch tables and predict the cost", "plan.forecast:forecast"),
    "run": Verb("carry out the plan on YADE; resumes", "plan.run:run_plan", "database"),
    "collect": Verb("gather finished runs into the response database", "plan.run:collect"),
    "calibrate": Verb(
        "interpolate, search the Pareto front, choose candidates", "search.calibrate:calibrate"
    ),
    "verify": Verb(
        "run YADE afresh at the candidates", "verification.verify:verify", "verification"
    ),
    "validate": Verb(
        "predict measurements that were not used, on other set-ups",
        "verification.verify:validate",
        "validation",
    ),
    "report": Verb(
        "write one self-contained page with figures and tables", "report.page:write_report"
    ),
}
"""The verbs of a calibration in the order of the workflow."""

DIAGNOSIS = {
    "preflight": Verb(
        "what these observables could say about a missing effect, and which further experiment"
        " would help",
        "diagnosis.preflight:preflight",
        "pre-flight",
    ),
    "diagnose": Verb(
        "find the gap, name the missing effect, show the gap shrink",
        "diagnosis.diagnose:diagnose",
        "diagnosis",
    ),
}
"""The verbs of the search for a missing effect."""

HANDED_ON = {
    "export": Verb(
        "write the calibrated material as files for YADE, LIGGGHTS, LAMMPS, MercuryDPM and EDEM",
        "handover.export:export",
    ),
    "card": Verb(
        "write the card of the material: JSON and a page", "handover.write_card:write_card"
    ),
}
"""The verbs that hand a finished calibration on."""

LOOKED_AT = {
    "view": Verb(
        "make one run again with snapshots: a picture, an animation, files for ParaView",
        "view.view:view_run",
        "view",
    ),
}
"""The verb that looks into a single run."""

INIT = "make a case of your own: questions, or a file of answers, and a budget"
MEASURE = "make rows of the lab file of raw data: logs of a scale, profiles, photographs"
"""What the verbs do that need no case."""
