"""The verdict in words."""

from calibrator.diagnosis.gap import Detection
from calibrator.diagnosis.outcome import Diagnosis, ErrorSize
from calibrator.diagnosis.sentence import errors_that_would_do, sentence


def test_nobody_is_told_to_measure_again_after_nothing():
    said = sentence(
        Diagnosis(
            verdict="ambiguous",
            effects=("twisting_stiffness", "tilt_deg"),
            detection=Detection(chi2=30.0, degrees=9, p_chi2=0.01, p_effect=0.01),
        )
    )
    assert "after nothing" not in said and "after levelling the set-up" in said


def test_errors_that_would_do_it_are_named_from_the_likeliest_and_absurd_ones_are_not():
    def said(*errors):
        return errors_that_would_do(Diagnosis(verdict="ambiguous", effects=(), errors=errors))

    angles = ErrorSize(name="reading of angles", unit="deg", stated=0.5, needed=2.1, p=0.4)
    balance = ErrorSize(name="balance", unit="%", stated=0.3, needed=0.6, p=0.4)
    neck = ErrorSize(name="tolerance of the neck", unit="m", stated=5e-5, needed=5e-3, p=0.4)
    clock = ErrorSize(name="zero of the clock", unit="s", stated=0.005, needed=0.006, p=1e-9)
    words = said(angles, balance, neck, clock)
    assert words.index("balance off by 0.6%") < words.index("reading of angles off by 2.1 deg")
    assert "neck" not in words and "clock" not in words
    assert "below 10 times its size would do it" in said(neck, clock)
    assert said(clock) == " No single error in the table of nuisances would do it."
