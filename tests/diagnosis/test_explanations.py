"""Fits of effects to measurements of a made-up world in which the truth is known."""

import dataclasses

import numpy as np

from calibrator.diagnosis.explanations import explain
from calibrator.diagnosis.rivals import pairs
from tests.toy_world import COUNT, EFFECTS


def test_pairs_that_cannot_be_combined_are_not_tried(world, surfaces):
    rng = np.random.default_rng(1)
    measured = world.measure(surfaces, rng, sizes=(1.5, 0, -1.5, 0))
    alone = [
        dataclasses.replace(e, excludes=("tilt",) if e.name == "adhesion" else ()) for e in EFFECTS
    ]
    tried = {fit.effects for fit in pairs(surfaces, measured, alone)}
    assert ("adhesion", "tilt") not in tried and len(tried) == 5


def test_the_fit_of_the_true_model_has_the_chi2_of_its_degrees_of_freedom(world, surfaces):
    fits = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        fits.append(
            explain(surfaces, world.measure(surfaces, rng, sizes=(1.0, 0, 0, 0)), EFFECTS, (0,))
        )
    assert fits[0].degrees == COUNT - 3
    # an estimated covariance makes chi2 a little larger, the error of the surfaces is one and the
    # same in all fits
    assert 0.6 < np.mean([f.chi2 for f in fits]) / fits[0].degrees < 1.6
    p = [f.adequacy(surfaces.degrees) for f in fits]
    assert np.mean(np.array(p) > 0.02) > 0.85
