"""The differences between engines that exports print are those of the shipped runs."""

import pytest

from benchmarks.runs import rolling_stiffness
from calibrator.handover.measured import GAPS, PAIRS, sentences

DIGITS = {"deg": 0.006, "kg/s": 6e-5, "kg/m3": 0.06}  # half a unit of the last printed one, or so


def unit(response):
    return {"mass_flow_rate": "kg/s", "bulk_density": "kg/m3"}.get(response, "deg")


def test_the_friction_pairs_are_those_of_the_runs():
    assert PAIRS == rolling_stiffness.PAIRS


@pytest.mark.parametrize("gap", GAPS, ids=lambda g: f"{g.engine}-{g.ratio:g}-{g.response}")
def test_a_gap_is_that_of_the_shipped_runs(gap):
    setup, response = gap.response.split(".")
    other = "LIGGGHTS" if gap.engine == "LIGGGHTS" else f"LAMMPS {gap.ratio:g}"
    samples = rolling_stiffness.samples(setup, response)
    found = rolling_stiffness.difference(samples, f"{gap.ratio:g}", other)
    last = DIGITS[unit(response)]
    assert gap.mean == pytest.approx(found["mean"], abs=last)
    assert gap.error == pytest.approx(found["standard_error"], rel=0.05)
    assert gap.by_pair == pytest.approx(found["by_pair"], abs=last)


def test_a_ratio_that_was_not_measured_is_said_to_be_so():
    (first, *others) = sentences("LIGGGHTS", 3.0)
    assert first == "Not measured at rolling_stiffness_ratio = 3; at 4:"
    known, *there = sentences("LIGGGHTS", 4.0)
    assert known == "At rolling_stiffness_ratio = 4, as here:" and others == there
    assert sentences("LIGGGHTS", 1.0)[1:] != others and "heap" in others[0]
