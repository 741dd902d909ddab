"""What fresh runs say of a target: met, missed, or too uncertain to tell."""

import dataclasses

import numpy as np
import pytest

from calibrator.case.problem import Target
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.verification.comparison import compare, error_o1
from calibrator.verification.outcome import all_passed

FLOW = Target("hourglass", "mass_flow_rate", 1.0, scatter=0.02, replicates=4)  # band 3 %


def runs(*values, response="mass_flow_rate"):
    """Runs of the hourglass with these values, by experiment."""
    return {
        "hourglass": [
            Record(Request.of("hourglass", seed=i), "ok", {response: value})
            for i, value in enumerate(values)
        ]
    }


def one(*values, noise=None, target=FLOW):
    known = None if noise is None else {target.key: noise}
    return compare([target], runs(*values), noise=known)[0]


def test_the_band_does_not_grow_with_the_scatter_of_the_runs_that_it_judges():
    calm, wild = one(1.01, 1.02, 1.03), one(0.82, 1.02, 1.22)
    assert calm.passed and calm.band == wild.band
    assert not wild.passed and wild.undecided and "CANNOT TELL" in wild.line
    assert "more replicates" in wild.line


def test_verification_and_validation_judge_alike():
    """A database that knows the noise changes the band by that noise, not by the runs'."""
    for noise in (None, 0.002):
        assert one(0.82, 1.02, 1.22, noise=noise).undecided
        assert one(1.20, 1.21, 1.22, noise=noise).undecided is False


def test_no_error_is_below_the_fresh_runs_own_scatter():
    quiet = one(20.5, 19.6, 19.1, noise=0.037, target=dataclasses.replace(FLOW, value=19.7))
    assert quiet.standard_error == pytest.approx(np.std([20.5, 19.6, 19.1], ddof=1) / np.sqrt(3))
    assert one(1.0, 1.0001, noise=0.05).standard_error == pytest.approx(0.05 / np.sqrt(2))


def test_the_error_of_few_runs_of_unknown_noise_is_student_s():
    found = one(1.00, 1.01)
    assert found.standard_error == pytest.approx(0.00707 / np.sqrt(2) * 12.706 / 1.96, rel=1e-2)


def test_a_single_run_of_unknown_noise_has_no_error_and_passes_nothing():
    found = one(1.0)
    assert (found.scatter, found.standard_error) == (None, None)
    assert not found.passed and found.undecided and "+- unknown" in found.line
    assert one(1.0, noise=0.01).passed and one(1.4).line.endswith("MISSED")


def test_a_target_of_weight_zero_is_reported_and_rules_nothing():
    idle = dataclasses.replace(FLOW, response="late_early_ratio", weight=0.0)
    mixed = [
        dataclasses.replace(r, responses={**r.responses, "late_early_ratio": 5.0})
        for r in runs(1.0, 1.001, 1.002)["hourglass"]
    ]
    found = compare([FLOW, idle], {"hourglass": mixed})
    assert all_passed(found, 0.5) and all_passed(found[1:], 0.5) is None
    assert "reported only" in found[1].line and np.isfinite(found[1].band)
    assert error_o1([FLOW, idle], found) == pytest.approx(0.001)
    assert error_o1([FLOW, idle], compare([FLOW, idle], runs(1.0, 1.0))) == 0
