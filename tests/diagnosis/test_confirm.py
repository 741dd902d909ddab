"""What fresh runs at an explanation say for it, and against it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from calibrator.case.lab import Observable
from calibrator.diagnosis.confirm import _fresh_probability, _unsteady
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
