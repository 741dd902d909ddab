"""What fresh runs at an explanation say for it, and against it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from calibrator.case.lab import Observable
from calibrator.diagnosis.confirm import (
    _fresh_probability,
    _has_moved,
    _refitted,
    _unsteady,
)
from calibrator.diagnosis.explanations import explain
from calibrator.diagnosis.observed import Averages
from tests.toy_world import COUNT, EFFECTS, REPLICATES

ALL, RUNS = np.arange(COUNT), 5


@pytest.fixture(scope="module")
def scene(world, surfaces):
    """A laboratory with adhesion, and the explanation by it."""
    rng = np.random.default_rng(7)
    measured = world.measure(surfaces, rng, sizes=(1.5, 0, 0, 0))
    seen = Observable(
        "conical_pile", "pile_equivalent_angle_deg", 20.0, 1.0, REPLICATES, "diagnose"
    )
    found = SimpleNamespace(
        surfaces=surfaces,
        measured=measured,
        observables=[seen] * COUNT,
        effects=EFFECTS,
        used=ALL,
        held=ALL[:0],
    )
    return found, explain(surfaces, measured, EFFECTS, (0,))


def test_runs_of_which_some_stand_and_others_fall_are_unsteady_and_others_are_not(scene):
    found, one = scene
    steady = Averages(np.zeros(COUNT), np.full(COUNT, RUNS), np.full(COUNT, 1.3))
    assert _unsteady(found, one, steady)[1] > 0.2
    standing = steady.scatter.copy()
    standing[4] = 13.0
    assert _unsteady(found, one, replace(steady, scatter=standing))[1] < 1e-3


def test_fresh_runs_that_scatter_much_do_not_excuse_that_they_miss(scene):
    found, best = scene
    at = found.surfaces.mean(best.unit, best.amplitude)[0]
    count, usual = np.full(COUNT, RUNS), np.ones(COUNT)
    hit = _fresh_probability(found, best, Averages(at, count, usual))
    off = at + 4.0 * np.eye(COUNT)[4]
    missed = _fresh_probability(found, best, Averages(off, count, usual))
    excused = _fresh_probability(found, best, Averages(off, count, usual + 12 * np.eye(COUNT)[4]))
    assert hit > 0.02 > missed
    assert excused < 0.02


def test_a_size_is_fitted_once_more_with_what_fresh_runs_say(scene):
    found, best = scene
    plain = found.surfaces.mean(best.unit, 0 * best.amplitude)[0]
    # the effect is half as large again as its surfaces say, as where it bends
    fresh = plain + 1.5 * (found.surfaces.mean(best.unit, best.amplitude)[0] - plain)
    refit, ((low, high),) = _refitted(
        found, best, Averages(fresh, np.full(COUNT, 50), np.ones(COUNT))
    )
    assert low < refit.amplitude[0] < high < best.amplitude[0]
    assert _has_moved(best, refit)
    assert refit.amplitude[0] < best.amplitude[0] - 0.3
    assert refit.deviance == best.deviance  # which compares it with what was not run again

    same = Averages(
        found.surfaces.mean(best.unit, best.amplitude)[0], np.full(COUNT, RUNS), np.ones(COUNT)
    )
    assert not _has_moved(best, _refitted(found, best, same)[0])


def test_surfaces_follow_many_fresh_runs_and_hardly_a_single_one(scene):
    found, best = scene
    before = found.surfaces.mean(best.unit, best.amplitude)[0]
    for error, share in ((1e-6, 1.0), (1e6, 0.0)):
        own = found.surfaces.corrected(best.unit, best.amplitude, before + 1, error * np.eye(COUNT))
        moved = own.mean(best.unit, best.amplitude)[0] - before
        np.testing.assert_allclose(moved, share, atol=1e-3)
        left = own.error(best.unit, best.amplitude)
        whole = found.surfaces.error(best.unit, best.amplitude)
        np.testing.assert_allclose(np.diag(left), (1 - share) * np.diag(whole), atol=1e-3)
