"""What outcomes rest on: they are believed while that stays as it is."""

import dataclasses

import pytest

from calibrator.diagnosis.basis import diagnosis_now, preflight_now
from calibrator.diagnosis.diagnose import diagnose
from calibrator.diagnosis.outcome import Diagnosis, Preflight
from calibrator.diagnosis.preflight import preflight
from calibrator.errors import CalibratorError
from calibrator.runs.database import Database
from calibrator.runs.workspace import Workspace


def test_an_outcome_is_believed_while_the_case_and_the_runs_are_those_it_was_computed_from(
    space, fake_yade, tmp_path
):
    here = space(bond_number=0.6)
    noted, seen = diagnose(here), preflight(here)
    assert here.current("diagnose", Diagnosis, diagnosis_now(here)) == noted
    assert here.current("preflight", Preflight, preflight_now(here)) == seen
    case = here.case

    def stale(**changes):
        return Workspace(dataclasses.replace(case, **changes), here.path)

    corrected = dataclasses.replace(case.observables[0], value=1500.0)
    lab_changed = stale(observables=(corrected, *case.observables[1:]))
    with pytest.raises(CalibratorError, match=r"^measurements changed since diagnose: run"):
        lab_changed.current("diagnose", Diagnosis, diagnosis_now(lab_changed))
    # the values play no part in a pre-flight
    lab_changed.current("preflight", Preflight, preflight_now(lab_changed))
    surer = stale(nuisances=case.nuisances[1:])
    for verb, kind, now in (
        ("diagnose", Diagnosis, diagnosis_now(surer)),
        ("preflight", Preflight, preflight_now(surer)),
    ):
        with pytest.raises(CalibratorError, match=f"^nuisances changed since {verb}: run"):
            surer.current(verb, kind, now)
    richer = stale(diagnosis=dataclasses.replace(case.diagnosis, budget_core_hours=9.0))
    richer.current("diagnose", Diagnosis, diagnosis_now(richer))
    confirming = Database.read(here.path / "diagnosis_confirmed.csv").records
    here.runs.record(next(iter(confirming.values())).request).unlink()
    with pytest.raises(CalibratorError, match=r"^records changed since diagnose: run"):
        here.current("diagnose", Diagnosis, diagnosis_now(here))
    here.current("preflight", Preflight, preflight_now(here))  # it has used no such run
