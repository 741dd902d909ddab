"""What is left of a name once YADE has run it afresh, as `diagnose` does.

The surfaces of a wrong effect can explain the measurements where its runs do not. Only the named
explanation and the model as it is are run, as the others cannot take a name back.
"""

from dataclasses import replace

from calibrator.case.case import Case
from calibrator.case.lab import Observable
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.confirm import confirm
from calibrator.diagnosis.diagnose import confirmed
from calibrator.diagnosis.explanations import Measured
from calibrator.diagnosis.runs import Scene
from calibrator.diagnosis.verdict import Verdict
from calibrator.errors import CalibratorError, DryRun
from calibrator.runs.database import Database
from calibrator.runs.record import Record
from calibrator.runs.workspace import Workspace, silent
from tests.campaigns.foreign.truths import REPO
from tests.campaigns.hidden.trials import Judged

TABLE = REPO / "grid" / "foreign_confirmed.csv"
COMMAND = "python -m tests.campaigns.foreign confirm"
FOLDER = REPO / "results" / "foreign_confirmed"


def outlived(
    case: Case,
    judged: Judged,
    reported: list[Observable],
    measured: Measured,
    verdict: Verdict,
    dry: bool,
) -> tuple[str, tuple[str, ...], list[Record]] | None:
    """Kind and effects of a verdict after its fresh runs, and these.

    dry : make no run that is not there; the result is None where one is missing.
    """
    if verdict.best is None or verdict.rivals is None:
        return verdict.kind, verdict.effects, []
    alone = replace(verdict, rivals=replace(verdict.rivals, single=(verdict.best,)))
    shipped = f"../grid/{TABLE.name}" if TABLE.exists() else ""
    own = replace(case, diagnosis=replace(case.diagnosis, shipped=shipped))
    scene = Scene(
        judged.effects,
        judged.uncertain,
        ex.experiments(case, case.observables),
        reported,
        judged.surfaces,
        measured,
        judged.used,
        judged.held,
        [],
        [],
    )
    try:
        runs = confirm(Workspace(own, FOLDER, dry_run=dry), scene, alone, True, silent)
    except DryRun:
        return None
    except CalibratorError as error:
        return f"no verdict: {error}", (), []
    kind, effects = confirmed(alone, runs.explanations)
    return kind, effects, list(runs.records)


def keep(records: list[Record]) -> None:
    """Add records to the shipped table."""
    there = Database.read(TABLE).records.values() if TABLE.exists() else ()
    Database({r.run_id: r for r in [*there, *records]}.values()).write(TABLE, COMMAND)
