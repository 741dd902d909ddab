"""Calibrations of made-up runs, finished or not, for the tests of their pages."""

import json
import random

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.diagnosis.diagnose import diagnose
from calibrator.plan.requests import plan_requests
from calibrator.plan.run import collect
from calibrator.report.diagnosis import write_diagnosis
from calibrator.runs.workspace import Workspace
from calibrator.search.calibrate import calibrate
from calibrator.search.outcome import current_calibration
from calibrator.verification.verify import (
    validate,
    validation_requests,
    verification_requests,
    verify,
)
from tests.conftest import CASE, LAB
from tests.fake_yade import responses_of
from tests.stand_in import World, put_in_place
from tests.toy_laboratory import NUISANCES, SMALL, lab

CASE = CASE.replace("population = 60", "population = 40").replace(
    "generations = 15", "generations = 8"
)


def workspace(folder, *changes, lab=LAB):
    text = CASE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "lab.csv").write_text(lab)
    (folder / "toy.toml").write_text(text)
    return Workspace(read_case(folder / "toy.toml"), folder / "results")


def believe(space, requests, clogged=(), curves=True):
    """Write the record and the curves of every request, as the scripts would."""
    folder = space.path / "records"
    folder.mkdir(parents=True, exist_ok=True)
    for count, request in enumerate(requests):
        scatter = random.Random(request.run_id)
        responses = {
            n: v * scatter.gauss(1, 0.004)
            for n, v in responses_of(request.setup, request.parameters).items()
        }
        status = "clogged" if count in clogged else "ok"
        kept = {"bulk_density": responses["bulk_density"]} if status == "clogged" else responses
        record = dict(
            schema=1, setup=request.setup, run_id=request.run_id, parameters=request.parameters,
            status=status, responses=kept, error=None, diagnostics=dict(particles=9, steps=10,
            filling_cpu=1.0, release_cpu=2.0), provenance=dict(yade="2023.02a", scripts="abc123",
            host="here", wall_time=3.0),
        )  # fmt: skip
        (folder / f"{request.run_id}.json").write_text(json.dumps(record))
        if curves:
            np.savez(folder / f"{request.run_id}.npz", **some_curves(request.setup))


def some_curves(setup):
    grains = np.random.default_rng(3).random((30, 3)) * 0.02 - [0.01, 0.01, 0]
    at = np.linspace(0, 0.01, 9)
    found = {
        "filled": grains,
        "final": grains[:20],
        "profile_height": at,
        "profile_x" if setup == "ledge" else "profile_radius": at,
    }
    return (
        {**found, "time": np.linspace(0, 1, 20), "passed_mass": np.linspace(0, 0.01, 20)}
        if setup == "hourglass"
        else found
    )


def calibrated(space, **kwargs):
    believe(space, plan_requests(space.case), **kwargs)
    collect(space)
    calibrate(space)
    return space


def diagnosed(folder, *changes, **hidden):
    """A finished diagnosis of a laboratory that has these effects: workspace and outcome.

    The runs are a stand-in's.
    """
    (folder / "nuisances.csv").write_text(NUISANCES)
    space = workspace(folder, SMALL, *changes, lab=lab(**hidden))
    with pytest.MonkeyPatch.context() as patch:
        put_in_place(patch, World())
        found = diagnose(space)
    write_diagnosis(space, found)
    return space, found


def finished(space):
    calibrated(space)
    calibration = current_calibration(space)
    believe(space, [r for own in verification_requests(space, calibration).values() for r in own])
    verify(space)
    believe(space, [r for own in validation_requests(space, calibration).values() for r in own])
    validate(space)
    return space
