"""A made-up world with a known answer: smooth observables, four effects, seeded scatter."""

import itertools

import numpy as np
from scipy.stats import qmc

from calibrator.diagnosis.explanations import Effect, Measured
from calibrator.diagnosis.surfaces import fit_surfaces

EXPERIMENTS = {"hourglass": 6, "ledge": 4, "conical_pile": 5}
COUNT, PARAMETERS = sum(EXPERIMENTS.values()), 2
EFFECTS = [
    Effect("adhesion", "+", 1.0),
    Effect("drag", "+", 1.0),
    Effect("tilt", "+-", 1.0),
    Effect("wall", "+-", 1.0),
]
REPLICATES = 5


class World:
    """Observables in units of their scatter; `outside` is an effect that the library lacks."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.slopes, self.bends = (
            6 * rng.normal(size=(PARAMETERS, COUNT)),
            rng.normal(size=(PARAMETERS, COUNT)),
        )
        self.effects = 2.5 * rng.normal(size=(len(EFFECTS), COUNT))
        self.outside = 4 * rng.normal(size=COUNT)
        mixed = [rng.normal(size=(n, n + 3)) for n in EXPERIMENTS.values()]
        self.roots = [np.linalg.cholesky(np.corrcoef(m)) for m in mixed]

    def run(self, unit, sizes, rng):
        """One run of every experiment."""
        x = 2 * np.asarray(unit) - 1
        mean = (
            x @ self.slopes
            + x**2 @ self.bends
            + (sizes - 0.1 * np.asarray(sizes) ** 2) @ self.effects
        )
        return mean + np.concatenate([root @ rng.normal(size=len(root)) for root in self.roots])

    def surfaces(self, rng):
        """Surfaces from 16 sets with two seeds, and 8 sets of each effect."""
        k = len(EFFECTS)
        points = qmc.Sobol(PARAMETERS, seed=1).random(16)
        units, none = np.repeat(points, 2, axis=0), np.zeros((32, k))
        plain = np.array([self.run(u, a, rng) for u, a in zip(units, none, strict=True)])
        sizes = [np.zeros((16, k))]
        for i, effect in enumerate(EFFECTS):
            own = np.zeros((8, k))
            own[:, i] = np.resize([1.0, 0.5, 1.5, 0.75], 8) * (
                1 if effect.sign == "+" else np.repeat([1, -1], 4)
            )
            sizes.append(own)
        changed, sizes = (
            np.vstack([points, *(points[i : i + 8] for i in range(k))]),
            np.vstack(sizes),
        )
        values = np.array([self.run(u, a, rng) for u, a in zip(changed, sizes, strict=True)])
        ends = np.cumsum([0, *EXPERIMENTS.values()])
        blocks = [slice(a, b) for a, b in itertools.pairwise(ends)]
        return fit_surfaces(
            [(units, plain[:, b]) for b in blocks],
            [(changed, sizes, values[:, b]) for b in blocks],
            list(EXPERIMENTS),
            {1},
            {2},
            np.array([[-0.5] * PARAMETERS, [1.5] * PARAMETERS]),
        )

    def measure(self, surfaces, rng, sizes=(0, 0, 0, 0), outside=0.0, unit=None):
        """Means over the replicates of a laboratory in which effects are hidden.

        unit : its parameters; drawn from the inner part of the box unless given.
        """
        inner = rng.uniform(0.25, 0.75, PARAMETERS)
        unit = inner if unit is None else np.asarray(unit)
        runs = [
            self.run(unit, np.array(sizes, float), rng) + outside * self.outside
            for _ in range(REPLICATES)
        ]
        return Measured(
            np.mean(runs, axis=0),
            surfaces.noise / REPLICATES,
            np.full(COUNT, REPLICATES),
            np.zeros((COUNT, 0)),
        )
