"""A parameter over decades: designs, search, distances and intervals all go by its logarithm."""

import dataclasses
import math

import numpy as np
import pytest

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.plan.adaptive import _distance
from calibrator.plan.run import run_plan
from calibrator.responses.box import refined, sample_of
from calibrator.responses.objectives import OBJECTIVES
from calibrator.search.calibrate import calibrate
from calibrator.search.nsga2 import decode, encode
from calibrator.verification.verify import verify
from tests import fake_yade
from tests.conftest import LAB, space_for
from tests.stand_in import World, put_in_place

DECADES = (
    "low = 0.5e6\nhigh = 4e6\nsamples = 2",
    'low = 2e4\nhigh = 2e8\nscale = "log"',
)
MODULUS = Problem(
    (
        Parameter("young_modulus", 1e5, 1e9, scale="log"),
        Parameter("sliding_friction", 0.2, 0.7),
    ),
    (Target("hourglass", "bulk_density", 1600.0),),
)


def softer(setup, p, seed):
    """The density falls by 60 kg/m3 with each decade of the modulus; at 1 MPa it is the usual."""
    responses = fake_yade.responses_of(setup, p)
    responses["bulk_density"] -= 35 * math.log10(p["young_modulus"] / 1e6)
    return responses


def test_shares_are_of_the_scale_and_have_their_inverse():
    points = MODULUS.values_at(np.array([[0.0, 0.0], [0.5, 0.5], [1.0, 1.0]]))
    np.testing.assert_allclose(points, [[1e5, 0.2], [1e7, 0.45], [1e9, 0.7]])
    np.testing.assert_allclose(MODULUS.shares_of(points), [[0, 0], [0.5, 0.5], [1, 1]], atol=1e-15)
    np.testing.assert_allclose(MODULUS.unscaled(MODULUS.scaled(points)), points)
    odd = Problem((Parameter("young_modulus", 5e6, 50e6, scale="log"),), MODULUS.targets)
    assert odd.unscaled(odd.scaled_bounds).tolist() == [[5e6], [50e6]]


def test_codes_samples_and_boxes_are_even_along_the_logarithm():
    bits = np.zeros((1, 16), bool)
    bits[0, 0] = True  # the most significant of eight: 128 of 255
    assert decode(MODULUS, bits)[0, 0] == pytest.approx(10 ** (5 + 4 * 128 / 255))
    np.testing.assert_array_equal(encode(MODULUS, decode(MODULUS, bits)), bits)
    rng = np.random.default_rng(1)
    assert np.median(sample_of(MODULUS, 256, rng)[:, 0]) == pytest.approx(1e7, rel=0.1)
    loss = lambda points: np.abs(np.log10(points[:, 0]) - 5.3)  # noqa: E731
    found = refined(loss, np.array([3e6, 0.5]), MODULUS, rng)
    assert np.log10(found[0]) == pytest.approx(5.3, abs=0.01)


def test_distance_and_share_of_the_cost_go_by_decades():
    points, cost = np.array([[1e6, 0.2], [1e9, 0.2]]), OBJECTIVES["time_cost"]
    np.testing.assert_allclose(_distance(MODULUS, points, np.array([1e5, 0.2])), [0.25, 1.0])
    np.testing.assert_allclose(cost(MODULUS, MODULUS.columns(points), {}), [0.25, 1.0])


def test_a_truth_that_is_many_decades_from_a_bound_is_found(write_case, tmp_path, monkeypatch):
    truth = dict(rolling_friction=0.25, sliding_friction=0.5, young_modulus=8e5)
    density = softer("hourglass", truth, 0)["bulk_density"]
    lab = LAB.replace("1605.6,5,8", f"{density:.1f},2,8")
    put_in_place(monkeypatch, World(softer, noise=0.001))
    many = ("population = 60\ngenerations = 15", "population = 200\ngenerations = 30")
    space = space_for(write_case(DECADES, ("sets = 14", "sets = 24"), many, lab=lab), tmp_path)
    run_plan(space)
    found = calibrate(space)
    assert found.reachability.all
    for profile in found.identifiability.parameters:
        wide = profile.interval_95[1] - profile.interval_95[0]
        assert abs(profile.best - truth[profile.name]) < wide and profile.share < 0.1
    assert verify(space).passed


def test_an_interval_over_half_the_decades_pins_nothing():
    from calibrator.search.parts import ParameterProfile

    none = np.zeros(2)
    wide = ParameterProfile(
        "young_modulus", 1e5, 1e9, 1e6, (3e5, 3e6), (3e5, 6e7), none, none, "log"
    )
    assert not wide.pinned and dataclasses.replace(wide, scale="linear").pinned
