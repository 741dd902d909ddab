"""Functions whose values, noise and errors can be written down, and interpolants through them."""

import itertools

import numpy as np
from scipy.stats import qmc

from calibrator.responses.gaussian_process import GaussianProcess
from calibrator.responses.multilinear import Multilinear

LOW, HIGH = np.array([0.1, 5e6]), np.array([0.5, 5e8])
BOUNDS = np.array([LOW, HIGH])
PARAMETERS = ["rolling_friction", "young_modulus"]
NOISE = np.array([0.3, 2.0])


def smooth(points):
    u, v = ((points - LOW) / (HIGH - LOW)).T
    return np.column_stack(
        [25 + 12 * np.tanh(2 * u) + 3 * u * v, 1500 - 80 * u + 30 * np.sin(2 * v)]
    )


def bilinear(points):
    u, v = ((points - LOW) / (HIGH - LOW)).T
    return np.column_stack([1 + 2 * u - 3 * v + 4 * u * v, 7 - u + u * v])


def grid(*samples):
    axes = [
        np.linspace(low, high, count) for low, high, count in zip(LOW, HIGH, samples, strict=True)
    ]
    return np.array(list(itertools.product(*axes)))


def inside(count, seed=5):
    return LOW + (HIGH - LOW) * np.random.default_rng(seed).random((count, 2))


def design(count):
    return LOW + (HIGH - LOW) * qmc.Sobol(2, scramble=False).random(2**10)[1 : count + 1]


def noisy_runs(count, replicates, seed=1):
    points = np.repeat(design(count), replicates, axis=0)
    return points, smooth(points) + NOISE * np.random.default_rng(seed).normal(
        size=(len(points), 2)
    )


def process(points, values, **options):
    return GaussianProcess.fit(points, values, ["a", "b"], BOUNDS, parameters=PARAMETERS, **options)


def multilinear(points, values, **options):
    return Multilinear.fit(points, values, ["a", "b"], parameters=PARAMETERS, **options)
