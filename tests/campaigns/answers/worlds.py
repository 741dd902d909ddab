"""Made-up laboratories: a world with known responses, and all that a user would write about it.

Everything follows from one seed. A response is a base times the exponential of a sum of bent lines
in the shares of the parameters that its set-up has, and of products of two of them. What fails does
so beyond a plane. Noise is that of one run, equal for responses that are functions of each other.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from calibrator.case.problem import Parameter
from calibrator.case.vocabulary import parameters_of
from tests.stand_in import World

# name: bounds of the searched interval, and whether they span decades
POOL: dict[str, tuple[float, float, bool]] = {
    "rolling_friction": (0.05, 0.5, False),
    "sliding_friction": (0.2, 0.8, False),
    "young_modulus": (1e5, 1e8, True),
    "particle_density": (2200.0, 3000.0, False),
    "particle_radius": (0.8e-3, 1.2e-3, False),
    "restitution": (0.6, 0.9, False),
    "cloud_fraction": (0.05, 0.35, False),
    "bond_number": (0.01, 10.0, True),
    "rolling_stiffness_ratio": (0.5, 16.0, True),
    "neck_diameter": (0.014, 0.018, False),
    "lift_speed": (0.01, 0.1, True),
}
# base value, how strongly it answers, noise relative to the world's
RESPONSES: dict[str, dict[str, tuple[float, float, float]]] = {
    "hourglass": {
        "bulk_density": (1550.0, 0.04, 0.1),
        "drained_equivalent_angle_deg": (42.0, 0.2, 1.0),
        "mass_flow_rate": (0.026, 0.25, 0.5),
        "residual_fraction": (0.4, 0.25, 1.0),
        "discharge_time": (0.9, 0.25, 1.0),
        "onset_delay": (0.02, 0.2, 1.0),
        "late_early_ratio": (0.85, 0.1, 1.0),
    },
    "ledge": {
        "bulk_density": (1540.0, 0.04, 0.1),
        "ledge_equivalent_angle_deg": (36.0, 0.2, 1.0),
        "residual_fraction": (0.5, 0.2, 1.0),
    },
    "conical_pile": {
        "bulk_density": (1545.0, 0.04, 0.1),
        "pile_equivalent_angle_deg": (24.0, 0.25, 1.0),
        "pile_apex_rounding": (1e-3, 0.3, 1.0),
    },
}
SETUPS = tuple(RESPONSES)
NEAR_ZERO = "drained_asymmetry_deg"  # scatters about something close to zero


@dataclass(frozen=True)
class Surface:
    """ln(response / base) over the shares (n, d) of all parameters; columns it lacks have slope 0.

    slopes, bends : (d,); products : (first, second, size) of pairs.
    """

    base: float
    slopes: np.ndarray
    bends: np.ndarray
    products: tuple[tuple[int, int, float], ...]
    additive: bool = False

    def __call__(self, shares: np.ndarray) -> np.ndarray:
        """True responses (n,)."""
        bent = np.tanh(self.bends * (shares - 0.5)) / np.tanh(self.bends / 2)
        total = bent @ self.slopes
        for i, j, size in self.products:
            total = total + size * (shares[:, i] - 0.5) * (shares[:, j] - 0.5)
        return np.asarray(self.base + total if self.additive else self.base * np.exp(total))


@dataclass(frozen=True)
class Failing:
    """Where runs fail: shares with direction @ share > threshold.

    kind : their status; setup : whose runs; chance : of a run there.
    """

    kind: str
    setup: str
    direction: np.ndarray
    threshold: float
    chance: float

    def __call__(self, shares: np.ndarray) -> np.ndarray:
        """Which shares (n, d) lie beyond the plane."""
        return np.asarray(shares @ self.direction > self.threshold)


@dataclass
class MadeUp:
    """A world, its parameters and its truth.

    surfaces : by setup.response; noise : relative scatter of a run by setup.response; uneven : how
    much more it is at the far end of the first parameter; truth : shares (d,) behind the lab.
    """

    parameters: tuple[Parameter, ...]
    surfaces: dict[str, Surface]
    noise: dict[str, float]
    uneven: float
    failing: Failing | None
    truth: np.ndarray
    constraint: str = ""
    allowed: Callable[[np.ndarray], np.ndarray] = field(
        default=lambda shares: np.ones(len(shares), bool)
    )

    def shares(self, p: dict[str, Any], setup: str) -> np.ndarray:
        """Shares (1, d) of a run's parameters; one half for those that its set-up lacks."""
        return np.array(
            [[float(q.shares_of(np.array(p[q.name]))) if q.name in p else 0.5
              for q in self.parameters]]
        )  # fmt: skip

    def true(self, key: str, shares: np.ndarray) -> np.ndarray:
        """Responses (n,) without noise."""
        return self.surfaces[key](shares)

    def sigma(self, key: str, shares: np.ndarray) -> np.ndarray:
        """Scatter (n,) of one run, in the response's unit."""
        size = 1.0 if self.surfaces[key].additive else np.abs(self.true(key, shares))
        return np.asarray(self.noise[key] * size * (1 + self.uneven * shares[:, 0]))

    def feasible(self, shares: np.ndarray, setups: set[str], lucky: bool = False) -> np.ndarray:
        """Which shares (n, d) are allowed, and free of failures in these set-ups.

        lucky : count as free of them where some runs succeed.
        """
        good = self.allowed(shares)
        failing = self.failing
        if failing is not None and failing.setup in setups and not (lucky and failing.chance < 1):
            good = good & ~failing(shares)
        return np.asarray(good)

    def world(self) -> World:
        """What stands in for YADE."""
        return World(self._responses, self._status, 0.0)

    def _responses(self, setup: str, p: dict[str, Any], seed: int) -> dict[str, float]:
        shares, out = self.shares(p, setup), {}
        draw = random.Random(f"{setup} {seed} {shares.tolist()}")
        for key in (k for k in self.surfaces if k.startswith(setup + ".")):
            scatter = self.sigma(key, shares)[0] * draw.gauss(0, 1)
            out[key.split(".")[1]] = float(self.true(key, shares)[0] + scatter)
        if "residual_fraction" in out:
            out["residual_mass"] = 0.016 * out["residual_fraction"]
        return out

    def _status(self, setup: str, p: dict[str, Any], seed: int) -> str:
        failing = self.failing
        if failing is None or failing.setup != setup or not failing(self.shares(p, setup))[0]:
            return "ok"
        lot = random.Random(f"fails {setup} {seed}").random()
        return failing.kind if lot < failing.chance else "ok"


def draw(rng: np.random.Generator) -> MadeUp:
    """A world with one to eight parameters."""
    count = int(rng.choice([1, 2, 3, 4, 5, 6, 8], p=[0.12, 0.28, 0.28, 0.14, 0.08, 0.06, 0.04]))
    names = ["rolling_friction", "sliding_friction", *rng.permutation(list(POOL)[2:])][:count]
    parameters = tuple(
        Parameter(n, low, high, scale="log" if decades else "linear")
        for n in names for low, high, decades in [POOL[n]]
    )  # fmt: skip
    surfaces, noise = {}, {}
    level = float(rng.choice([0.0, 0.002, 0.005, 0.01, 0.03, 0.1, 0.2],
                             p=[0.08, 0.17, 0.25, 0.25, 0.15, 0.06, 0.04]))  # fmt: skip
    for setup in SETUPS:
        has = np.array([p.name in parameters_of(setup) for p in parameters])
        for name, (base, strength, share) in RESPONSES[setup].items():
            surfaces[f"{setup}.{name}"] = _surface(rng, base, strength, has)
            noise[f"{setup}.{name}"] = level * share
    has = np.array([p.name in parameters_of("hourglass") for p in parameters])
    small = _surface(rng, 0.0, 0.3, has)
    surfaces[f"hourglass.{NEAR_ZERO}"] = Surface(0.0, small.slopes, small.bends, (), additive=True)
    noise[f"hourglass.{NEAR_ZERO}"] = 1.0 if level else 0.0
    truth = rng.uniform(0.08, 0.92, count)
    made = MadeUp(parameters, surfaces, noise, 0.0, None, truth)
    made.uneven = float(rng.choice([0.0, 3.0], p=[0.8, 0.2]))
    _constrain(made, rng)
    made.failing = _failing(made, rng)
    return made


def _surface(rng: np.random.Generator, base: float, strength: float, has: np.ndarray) -> Surface:
    """A response that answers mainly to a few of the parameters that its set-up has."""
    weights = rng.dirichlet(np.full(len(has), 0.6)) * has
    weights = weights / weights.sum() if weights.sum() > 1e-9 else weights
    slopes = strength * weights * rng.choice([-1, 1], len(has))
    pairs = [(i, j) for i in range(len(has)) for j in range(i) if has[i] and has[j]]
    size = strength * rng.uniform(-0.5, 0.5)
    products = tuple((*pairs[k], size) for k in rng.permutation(len(pairs))[:1])
    return Surface(base, slopes, rng.uniform(0.3, 2.5, len(has)), products)


def _failing(made: MadeUp, rng: np.random.Generator) -> Failing | None:
    """A region where runs fail: none in most worlds, a corner in some, all of the box in a few."""
    kind = str(rng.choice(["", "clogged", "crash", "not_settled"], p=[0.62, 0.2, 0.08, 0.1]))
    if not kind:
        return None
    direction = rng.dirichlet(np.ones(len(made.truth))) * rng.choice([-1, 1], len(made.truth))
    sample = rng.random((2000, len(made.truth)))
    share = float(rng.choice([0.15, 0.35, 0.6, 1.0], p=[0.4, 0.35, 0.17, 0.08]))
    edge = np.quantile(sample @ direction, 1 - share) if share < 1 else -np.inf
    setup = "hourglass" if kind == "clogged" else str(rng.choice(SETUPS))
    return Failing(kind, setup, direction, float(edge), float(rng.choice([1.0, 0.7])))


def _constrain(made: MadeUp, rng: np.random.Generator) -> None:
    """A linear inequality between the frictions, which the truth obeys."""
    if len(made.parameters) < 2 or rng.random() > 0.15:
        return
    rolling, sliding = made.parameters[:2]
    made.constraint = "rolling_friction <= sliding_friction"
    made.allowed = lambda shares: np.asarray(
        rolling.values_at(shares[:, 0]) <= sliding.values_at(shares[:, 1])
    )
    while not made.allowed(made.truth[None])[0]:
        made.truth = rng.uniform(0.08, 0.92, len(made.truth))
