"""The verdict in words."""

from calibrator.diagnosis.gap import Detection
from calibrator.diagnosis.outcome import Diagnosis
from calibrator.diagnosis.sentence import sentence


def test_nobody_is_told_to_measure_again_after_nothing():
    said = sentence(
        Diagnosis(
            verdict="ambiguous",
            effects=("twisting_stiffness", "tilt_deg"),
            detection=Detection(chi2=30.0, degrees=9, p_chi2=0.01, p_effect=0.01),
        )
    )
    assert "after nothing" not in said and "after levelling the set-up" in said
