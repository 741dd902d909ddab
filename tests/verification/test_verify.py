"""What is verified belongs to the case as it is now."""

import pytest

from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError
from calibrator.runs import workspace
from calibrator.verification.verify import verification_requests


def test_a_case_that_changed_since_calibrate_is_told_so(write_case, tmp_path):
    space = workspace.Workspace(read_case(write_case()), tmp_path / "toy")
    parameters = {"rolling_friction": 0.2, "sliding_friction": 0.5, "young_modulus": 1e6}
    predicted = {t.key: {"mean": 1.0, "error": 0.0} for t in space.case.problem.targets}
    space.note(
        "calibrate",
        {"candidates": {"compromise": {"parameters": parameters, "predicted": predicted}}},
    )
    assert len(verification_requests(space)["compromise"]) == 4
    for change in (
        ("[parameters.sliding_friction]\nlow = 0.2\nhigh = 0.7\nsamples = 4\n", ""),
        ("low = 0.2", "low = 0.6"),
    ):
        other = workspace.Workspace(read_case(write_case(change)), tmp_path / "toy")
        with pytest.raises(
            CalibratorError, match="has changed since calibrate: run `calibrator calibrate"
        ):
            verification_requests(other)
