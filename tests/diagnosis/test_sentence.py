"""The verdict in words."""

import json

from calibrator.diagnosis.sentence import sentence

AMBIGUOUS = (
    '{"verdict": "ambiguous", "detection": {"p_effect": 0.01, "p_chi2": 0.01}, "locations": []}'
)


def test_nobody_is_told_to_measure_again_after_nothing():
    said = sentence({**json.loads(AMBIGUOUS), "effects": ["twisting_stiffness", "tilt_deg"]})
    assert "after nothing" not in said and "after levelling the set-up" in said
