"""Fingerprints tell what has changed, and nothing where nothing has."""

from calibrator.case.fingerprint import changed, fingerprint
from calibrator.case.problem import Target


def parts(**changes):
    target = Target("hourglass", "bulk_density", 1600.0, **changes)
    return fingerprint({"targets": (target,), "runs": [("a", "ok", {"bulk_density": 1.0})]})


def test_equal_parts_have_equal_fingerprints():
    assert changed(parts(), parts()) == []


def test_every_value_of_a_target_counts():
    for change in ({"scatter": 1.0}, {"replicates": 2}, {"weight": 2.0}, {"tolerance": 0.1}):
        assert changed(parts(), parts(**change)) == ["targets"]


def test_a_part_that_only_one_of_them_has_is_a_change():
    assert changed({}, parts()) == ["targets", "runs"] == changed(parts(), {})
