"""What a pre-flight and a diagnosis are computed from, as fingerprints.

A verb notes the fingerprint of the case and of the records that it has in its hands. A reader of
what was noted makes the same fingerprint of the case and the records as they are now, and believes
the outcome where the two agree: `space.current("diagnose", Diagnosis, diagnosis_now(space))`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from calibrator.case.case import Case
from calibrator.case.fingerprint import Fingerprint, fingerprint
from calibrator.case.lab import Observable
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.gap import FEWEST_DEGREES
from calibrator.diagnosis.runs import asked
from calibrator.runs.database import Database
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.workspace import Workspace, contents, for_new_seeds

CONFIRMED = "diagnosis_confirmed.csv"  # fresh runs of the explanations, in the results folder


def diagnosis_basis(case: Case, records: Iterable[Record]) -> Fingerprint:
    """Fingerprint of a diagnosis that these records were used in."""
    return _basis(case, case.observables, records)


def preflight_basis(case: Case, records: Iterable[Record]) -> Fingerprint:
    """Fingerprint of a pre-flight that these records were used in; measured values play no part."""
    return _basis(case, [replace(o, value=1.0) for o in case.observables], records)


def _basis(case: Case, observables: Sequence[Observable], records: Iterable[Record]) -> Fingerprint:
    # neither where shipped runs and nuisances lie nor what may be spent changes any number
    settings = replace(case.diagnosis, shipped="", nuisances="", budget_core_hours=0.0)
    return fingerprint(
        {
            "parameters": case.problem.parameters,
            "constraints": case.problem.constraints,
            "fixed values": case.problem.fixed,
            "set-ups": case.problem.setups,
            "conditions": case.conditions,
            "measurements": observables,
            "nuisances": case.nuisances,
            "diagnosis settings": settings,
            "records": contents(list({r.run_id: r for r in records}.values())),
        }
    )


def diagnosis_now(space: Workspace) -> Fingerprint:
    """Fingerprint that a diagnosis of the case and the runs as they are now would have.

    Raises CalibratorError where the list of the confirming runs is damaged.
    """
    case = space.case
    if ex.degrees_left(case) < FEWEST_DEGREES:  # said before any run is looked at
        return diagnosis_basis(case, [])
    requests = [*asked(case, case.observables).requests, *_confirming(space)]
    return diagnosis_basis(case, for_new_seeds(space, case.diagnosis).finished(requests))


def preflight_now(space: Workspace) -> Fingerprint:
    """Fingerprint that a pre-flight of the case and the runs as they are now would have."""
    case = space.case
    requests = asked(case, [*case.observables, *ex.further(case)]).requests
    return preflight_basis(case, for_new_seeds(space, case.diagnosis).finished(requests))


def _confirming(space: Workspace) -> list[Request]:
    """The confirming runs of the last diagnosis, which follow from a fit and not from the case."""
    path = space.path / CONFIRMED
    return [r.request for r in Database.read(path).records.values()] if path.exists() else []
