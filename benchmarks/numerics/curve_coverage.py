"""Do intervals hold the truth where the target is a curve?

    python -m benchmarks.numerics.curve_coverage     writes benchmarks/results/curve_coverage.json
    python -m benchmarks.numerics.curve_coverage --quick     4 laboratories instead of 40

The made-up heaps of tests/curve_world.py: two frictions, seed noise that is smooth along the curve.
Each laboratory has a truth of its own inside the box, photographs five heaps on one scale that is
wrong by one per cent (standard deviation), and reads 200 points; the database, 24 sets with two
seeds, is made anew for it. The 68 and 95 % intervals should hold the frictions in as many cases.
Beside it stand the same with every point taken as a measurement of its own, and what the rules say
of fresh runs at the truth, and of a heap with ripples that no simulated one has.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from benchmarks.common import asked_for_quick, write
from benchmarks.numerics.coverage import wilson
from calibrator.case.curve import MeasuredCurve
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.plan.design import sobol
from calibrator.responses.curves import Components, components
from calibrator.responses.fit import fit_responses
from calibrator.responses.interpolant import Interpolant, seed_noise
from calibrator.responses.targets import met
from calibrator.search.identifiability import identify
from calibrator.search.reach import unreachable
from tests.curve_world import RADII, heap, photographed, scatter

SETS, SEEDS, POINTS, FRESH = 24, 2, 200, 5
SCALE_ERROR, RIPPLES = 0.01, 0.4e-3
WITHOUT_SURFACES = 10  # times as many laboratories, of which only fresh runs at the truth are asked
SAMPLES, POSITIONS = 2**12, 21  # of `identify`: a quarter of what a calibration uses
PARAMETERS = (Parameter("rolling_friction", 0.05, 0.45), Parameter("sliding_friction", 0.2, 0.7))


def problem_of(curve: MeasuredCurve) -> Problem:
    """The two frictions against a measured curve."""
    target = Target("conical_pile", "profile_height", curve.level, replicates=5, curve=curve)
    return Problem(PARAMETERS, (target,))


def run(point: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The curve (2, n) of one run at a set (d,)."""
    return np.array([RADII, heap(*point) + scatter(rng)])


def calibrated(
    problem: Problem, points: np.ndarray, curves: list[np.ndarray]
) -> tuple[Problem, Interpolant, Components]:
    """The problem with the components of its curve, and their interpolant."""
    (curve,) = problem.targets
    found = components(curve, points, curves)
    values = np.array([list(found.of(one).values()) for one in curves])
    own = dataclasses.replace(problem, targets=found.targets)
    return own, fit_responses(own, points, values, [t.key for t in found.targets]), found


def as_independent(found: Components, problem: Problem) -> Problem:
    """The problem with the errors that a component has where every point is one measurement."""
    curve = found.curve.curve
    assert curve is not None
    error = np.mean(curve.scatter) / np.sqrt(POINTS)
    targets = tuple(dataclasses.replace(t, scatter=float(error)) for t in problem.targets)
    return dataclasses.replace(problem, targets=targets)


def held(problem: Problem, interpolant: Interpolant, truth: np.ndarray) -> np.ndarray:
    """Whether the 68 and 95 % intervals hold the truth (2, d), and their widths' shares."""
    found = identify(problem, interpolant, samples=SAMPLES, positions=POSITIONS).parameters
    inside = [
        [low <= t <= high for t, (low, high) in zip(truth, own, strict=True)]
        for own in ([p.interval_68 for p in found], [p.interval_95 for p in found])
    ]
    return np.array([*inside, [p.share for p in found]], float)


@dataclass(frozen=True)
class Laboratory:
    """A truth (d,), the database's sets (n, d) and curves, and two photographs of the truth."""

    truth: np.ndarray
    points: np.ndarray
    curves: list[np.ndarray]
    seen: Problem
    rippled: Problem
    fresh: list[np.ndarray]

    @classmethod
    def of(cls, seed: int) -> "Laboratory":
        """The laboratory of a seed."""
        rng = np.random.default_rng(seed)
        bare = problem_of(photographed(rng))
        truth = bare.values_at(rng.uniform(0.2, 0.8, (1, 2)))[0]
        points = np.repeat(sobol(bare, SETS), SEEDS, axis=0)
        curves = [run(point, rng) for point in points]
        shown = dict(zip(bare.names, truth, strict=True))
        options = {"scale_error": SCALE_ERROR, "points": POINTS, "truth": shown}
        seen = problem_of(photographed(rng, **options))
        fresh = [run(truth, rng) for _ in range(FRESH)]
        rippled = problem_of(photographed(rng, bump=RIPPLES, **options))
        return cls(truth, points, curves, seen, rippled, fresh)

    @property
    def truth_met(self) -> bool:
        """Whether fresh runs at the truth meet the curve."""
        found = components(self.seen.targets[0], self.points, self.curves)
        values, fresh = (
            np.array([list(found.of(one).values()) for one in own])
            for own in (self.curves, self.fresh)
        )
        noise, _ = seed_noise(self.points, values)
        return bool(met(found.targets, fresh.mean(axis=0), noise, FRESH).all())


def asked_of(one: Laboratory) -> dict[str, np.ndarray | float]:
    """What a calibration of one laboratory says."""
    problem, interpolant, found = calibrated(one.seen, one.points, one.curves)
    alien, surface, _ = calibrated(one.rippled, one.points, one.curves)
    return {
        "components": float(len(found.targets)),
        "curve": held(problem, interpolant, one.truth),
        "independent": held(as_independent(found, problem), interpolant, one.truth),
        "out_of_reach": float(not unreachable(problem, interpolant).all),
        "ripples_out_of_reach": float(not unreachable(alien, surface).all),
    }


def summary(found: np.ndarray) -> dict[str, object]:
    """Coverage of each parameter over the laboratories (n, 3, d), and mean shares of the range."""
    trials = len(found)
    return {
        p.name: {
            "held_by_68": wilson(int(found[:, 0, i].sum()), trials),
            "held_by_95": wilson(int(found[:, 1, i].sum()), trials),
            "width_95_share": float(found[:, 2, i].mean()),
        }
        for i, p in enumerate(PARAMETERS)
    }


def main() -> None:
    """Calibrate, count."""
    trials = 4 if asked_for_quick(__doc__, "4 laboratories instead of 40") else 40
    all_found = [asked_of(Laboratory.of(seed)) for seed in range(trials)]
    truths_met = [Laboratory.of(seed).truth_met for seed in range(WITHOUT_SURFACES * trials)]
    columns = {key: np.array([one[key] for one in all_found]) for key in all_found[0]}
    write(
        "curve_coverage",
        {
            "about": f"{trials} made-up laboratories with a heap's profile as their only target",
            "trials": trials,
            "components": float(columns["components"].mean()),
            "curve": summary(columns["curve"]),
            "points_as_independent": summary(columns["independent"]),
            "truth_met": {
                **wilson(sum(truths_met), len(truths_met)),
                "trials": len(truths_met),
            },
            "false_out_of_reach": wilson(int(columns["out_of_reach"].sum()), trials),
            "ripples_out_of_reach": wilson(int(columns["ripples_out_of_reach"].sum()), trials),
        },
    )


if __name__ == "__main__":
    main()
