"""The examples in the package's docstrings give what they say."""

import doctest
import importlib
import pkgutil

import pytest

import calibrator

MODULES = sorted(
    found.name for found in pkgutil.walk_packages(calibrator.__path__, prefix="calibrator.")
)
WITH_EXAMPLES = {
    "calibrator.case.codec",
    "calibrator.case.problem",
    "calibrator.report.words",
    "calibrator.responses.objectives",
    "calibrator.responses.targets",
}


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_of_a_module_hold(name):
    found = doctest.testmod(importlib.import_module(name))
    assert found.failed == 0, "the differences are in the captured output"
    assert found.attempted > 0 or name not in WITH_EXAMPLES, "its examples are not seen"
