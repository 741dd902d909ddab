"""Intervals of what was fitted, where the truth is known."""

from dataclasses import replace

import numpy as np
import pytest

from calibrator.diagnosis.explanations import explain
from calibrator.diagnosis.interval import RISE, interval, rises
from tests.toy_world import COUNT, EFFECTS, World

ALL = np.arange(COUNT)
# two parameters, as shares of their ranges, and an amplitude at which the effect hardly bends
TRUTH = (0.6, 0.4, 0.7)


@pytest.fixture(scope="module")
def fits():
    """Surfaces of their own, measurements and the fit of the right effect, of many laboratories."""
    world, found = World(3), []
    for seed in range(15):
        surfaces = world.surfaces(np.random.default_rng(100 + seed))
        measured = world.measure(
            surfaces, np.random.default_rng(seed), unit=TRUTH[:2], sizes=(TRUTH[2], 0, 0, 0)
        )
        found.append((surfaces, measured, explain(surfaces, measured, EFFECTS, (0,))))
    return found


@pytest.mark.parametrize("index", range(3))
def test_intervals_hold_the_truth_as_often_as_they_say(fits, index):
    """At 95 % of 15, 12 or fewer are one case of two hundred; no interval is the whole range."""
    ends = np.array([interval(s, m, EFFECTS, fit, ALL, index) for s, m, fit in fits])
    assert ((ends[:, 0] <= TRUTH[index]) & (TRUTH[index] <= ends[:, 1])).sum() >= 13
    assert (np.diff(ends)[:, 0] < (0.6, 0.6, 1.9)[index]).all()


def test_at_its_ends_the_deviance_has_risen_as_chi_square_says(fits):
    """And by as much more as fits to sets left out go astray."""
    surfaces, measured, best = fits[0]
    enough = rises(surfaces, measured, (0,), best, ALL)
    assert (enough >= RISE).all()
    for index, value in enumerate((*best.unit, best.amplitude[0])):
        for end in interval(surfaces, measured, EFFECTS, best, ALL, index):
            fit = explain(surfaces, measured, EFFECTS, (0,), pinned=(index, end))
            assert fit.deviance - best.deviance == pytest.approx(enough[index], abs=0.4)
            assert fit.degrees == best.degrees + 1
        assert abs(value - end) > 0


def test_an_end_beyond_the_range_is_that_of_the_range():
    world = World(3)
    surfaces = world.surfaces(np.random.default_rng(1))
    measured = world.measure(surfaces, np.random.default_rng(2), unit=(0.0, 0.5))
    best = explain(surfaces, measured, EFFECTS)
    low, high = interval(surfaces, measured, EFFECTS, best, ALL, 0)
    assert low == pytest.approx(0.0, abs=1e-3) and best.unit[0] < high < 0.5


def test_a_fit_that_is_not_found_again_at_its_own_value_ends_no_interval(fits, monkeypatch):
    """Seen in a laboratory: from its usual starts the fit at the best value ended elsewhere."""
    surfaces, measured, best = fits[1]
    usual = interval(surfaces, measured, EFFECTS, best, ALL, 0)

    def elsewhere(*args, pinned, **options):
        found = explain(*args, pinned=pinned, **options)
        return replace(found, chi2=found.chi2 + 99) if pinned[1] == best.unit[0] else found

    monkeypatch.setattr("calibrator.diagnosis.interval.explain", elsewhere)
    assert interval(surfaces, measured, EFFECTS, best, ALL, 0) == usual
