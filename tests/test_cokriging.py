"""Co-kriging is the conditional normal that it claims to be, and finds what made the runs."""

import numpy as np
import pytest

from benchmarks.numerics.cokriging import CoKriging, Likeliest, Runs

FOUND = Likeliest(rho=1.4, size=2.0, lengths=(0.5, 1.2), delta=0.6, smooth=0.8)
CHEAP, DEAR = 0.2, 0.3  # seed noise
FLAT = 1e5  # standard deviation of what is known of the means beforehand


def drawn(seed, cheap=14, dear=6):
    """Runs of both fidelities from the model itself, and as many points more with their truth."""
    rng = np.random.default_rng(seed)
    points = rng.random((cheap + 2 * dear, 2))
    is_dear = np.arange(len(points)) >= cheap
    empty = CoKriging(
        Runs(points[:0], np.empty(0), CHEAP), Runs(points[:0], np.empty(0), DEAR), FOUND
    )
    covariance = empty.covariance(points, points, is_dear, is_dear)
    mean = np.where(is_dear, 50.0, 20.0)
    truth = rng.multivariate_normal(mean, covariance, method="eigh")
    seen = truth + np.where(is_dear, DEAR, CHEAP) * rng.normal(size=len(points))
    one, two = slice(0, cheap), slice(cheap, cheap + dear)
    runs = Runs(points[one], seen[one], CHEAP), Runs(points[two], seen[two], DEAR)
    return *runs, points[cheap + dear :], truth[cheap + dear :]


def test_predictions_are_those_of_the_joint_normal_of_all_runs():
    cheap, dear, new, _ = drawn(1)
    model = CoKriging(cheap, dear, FOUND)
    mean, error = model.predict(new)
    # the same from scratch: one normal over cheap runs, dear runs and new points, conditioned
    points = np.concatenate([cheap.points, dear.points, new])
    is_dear = np.repeat([False, True], [len(cheap.values), len(dear.values) + len(new)])
    whole = np.empty((len(points), len(points)))
    for i, a in enumerate(points):
        for j, b in enumerate(points):
            first = 2.0**2 * np.exp(-(((a - b) / (0.5, 1.2)) ** 2).sum() / 2)
            second = 0.6**2 * np.exp(-(((a - b) / 0.8) ** 2).sum() / 2)
            slopes = (1.4 if is_dear[i] else 1.0) * (1.4 if is_dear[j] else 1.0)
            alike = float(is_dear[i] == is_dear[j]) * FLAT**2  # each fidelity has a mean of its own
            whole[i, j] = slopes * first + (second if is_dear[i] and is_dear[j] else 0.0) + alike
    n = len(points) - len(new)
    noise = np.repeat([CHEAP**2, DEAR**2], [len(cheap.values), len(dear.values)])
    weights = np.linalg.solve(whole[:n, :n] + np.diag(noise), whole[:n, n:]).T
    values = np.concatenate([cheap.values, dear.values])
    assert mean == pytest.approx(weights @ values, abs=1e-3)
    variance = np.diag(whole[n:, n:] - weights @ whole[:n, n:])
    assert error == pytest.approx(np.sqrt(variance), abs=1e-3)


def test_its_errors_are_those_that_it_makes():
    scaled = []
    for seed in range(60):
        cheap, dear, new, truth = drawn(seed)
        mean, error = CoKriging(cheap, dear, FOUND).predict(new)
        scaled += list((truth - mean) / error)
    assert np.std(scaled) == pytest.approx(1.0, abs=0.12)


def test_it_finds_the_slope_between_the_fidelities():
    slopes = [CoKriging.fit(*drawn(seed, 30, 12)[:2]).found.rho for seed in range(6)]
    assert np.median(slopes) == pytest.approx(FOUND.rho, abs=0.35)


def test_cheap_runs_that_say_nothing_are_left_alone():
    cheap, dear, new, truth = drawn(3, 20, 8)
    wild = Runs(cheap.points, np.random.default_rng(1).normal(size=20) * 5, 5.0)
    own = CoKriging.fit(wild, dear)
    mean, error = own.predict(new)
    assert (np.abs(mean - truth) < 4 * error).all()
