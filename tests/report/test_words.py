"""Numbers as people write them."""

import pytest

from calibrator.report.words import number, percent, with_error


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.25, "0.25"),
        (1590.4, "1590"),
        (2.9e6, "2.9e6"),
        (-2e-4, "-2e-4"),
        (0, "0"),
        (12345, "12345"),
        (None, "–"),
    ],
)
def test_numbers_are_written_for_people(value, words):
    assert number(value) == words


def test_errors_decide_the_decimals_and_zero_has_no_sign():
    assert (
        with_error(1577.04, 2.87) == "1577.0 ± 2.9"
        and with_error(0.02784, 0.00066) == "0.0278 ± 0.0007"
    )
    assert (
        with_error(53.54, 0) == "53.54"
        and percent(-1e-6) == "0.00\u00a0%"
        and percent(0.0118) == "+1.18\u00a0%"
    )
