"""Size distributions: the same texts pass on both sides of the contract, and stay as they are."""

import ast

import pytest

from calibrator.case.values import checked_value
from calibrator.errors import CalibratorError
from calibrator.runs.request import Request, cell
from calibrator.runs.setups import impossible, numbers
from tests.fake_yade import contract

NAME = "size_distribution"
GOOD = ["", "1:1", "1.05:0.2|1.1:0.5|1.2:0.3", "1.05e-3:2|1.1e-3:7", "1:0.5|10:0.5"]
BAD = [
    "1", "1:", ":1", "1:1|", "|1:1", "1:1,2:1", "1:0", "0:1", "1:1|1:1", "2:1|1:1", "1:1|11:1",
    "1:-1", "-1:1", "nan:1", "1:inf", "1:1e999", "1 : 1", "1:1;import os", "__import__('os'):1",
    1.0, None, True, [], "|".join(f"1.{i:02d}:1" for i in range(51)),
]  # fmt: skip


@pytest.mark.parametrize("text", GOOD)
def test_a_distribution_passes_on_both_sides_and_in_a_table(text):
    assert checked_value(NAME, text) == text
    assert contract.checked("ledge", {NAME: text})[NAME] == text
    assert ast.literal_eval(cell(NAME, text)) == text and " " not in cell(NAME, text)


@pytest.mark.parametrize("value", BAD)
def test_what_is_no_distribution_is_refused_on_both_sides(value):
    with pytest.raises(CalibratorError, match="give up to 50 rising diameters"):
        checked_value(NAME, value)
    with pytest.raises(contract.BadInput, match="give up to 50 rising diameters"):
        contract.checked("ledge", {NAME: value})


def test_a_run_of_one_size_is_the_run_that_it_was():
    plain, mixed = Request.of("ledge"), Request.of("ledge", size_distribution="1:0.5|2:0.5")
    assert Request.of("ledge", size_distribution="").run_id == plain.run_id != mixed.run_id
    assert NAME not in plain.parameters


@pytest.mark.parametrize("effect", ["size_spread", "clump_aspect"])
def test_a_distribution_is_refused_beside_other_shapes_and_sizes(effect):
    value = {"size_spread": 0.1, "clump_aspect": 1.3}[effect]
    request = Request.of("ledge", **{NAME: "1:0.5|2:0.5", effect: value})
    found = impossible("ledge", numbers(request), {NAME})
    assert found == [f"{effect} and {NAME} cannot be combined: set one of them to its default"]
