"""Do the interpolants' 95 % intervals hold the response between the runs as often as they claim?

    python -m benchmarks.numerics.claims             writes benchmarks/results/claims.json
    python -m benchmarks.numerics.claims --quick     2 functions instead of 30 for each number

Made-up responses, a bend and a wave along random directions of the box, at the first points of a
Sobol sequence with seed noise of 0 to 20 %, and asked at random places.
"""

import numpy as np

from benchmarks.common import asked_for_quick, write
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.plan.design import sobol
from calibrator.responses.fit import fit_responses

NAMES = (
    "rolling_friction",
    "sliding_friction",
    "size_spread",
    "poisson_ratio",
    "wall_friction_ratio",
    "bond_number",
    "tilt_deg",
    "bed_viscosity",
)
HIGH = 0.4  # of every parameter; the low end is 0
KEY = "hourglass.onset_delay"
ASKED = 300


def made_up(dimensions: int, rng: np.random.Generator) -> object:
    """A function of points (n, d) of the box, (n, 1), of about 10."""
    bend, wave = 1.2 * rng.normal(size=dimensions), 1.5 * rng.normal(size=dimensions)
    phase, size = rng.uniform(), rng.uniform(0.1, 0.5)

    def response(points: np.ndarray) -> np.ndarray:
        half = 2 * points / HIGH - 1
        return (10 + 10 * size * (np.tanh(half @ bend) + 0.3 * np.sin(half @ wave + phase)))[
            :, None
        ]

    return response


def share_held(dimensions: int, rng: np.random.Generator) -> tuple[float, float]:
    """Share of the places whose interval holds the response, and the error over its scatter."""
    parameters = tuple(Parameter(n, 0.0, HIGH) for n in NAMES[:dimensions])
    problem = Problem(parameters, (Target(*KEY.split("."), 10.0),))
    sets, replicates = int(rng.choice([16, 24, 32])), int(rng.choice([1, 2, 3, 5]))
    noise, response = float(rng.choice([0, 0.002, 0.01, 0.03, 0.1, 0.2])), made_up(dimensions, rng)
    points = np.repeat(sobol(problem, sets), replicates, axis=0)
    values = response(points) * (1 + noise * rng.normal(size=(len(points), 1)))
    asked = HIGH * rng.uniform(size=(ASKED, dimensions))
    mean, error = fit_responses(problem, points, values, [KEY]).predict_with_error(asked)
    off = mean - response(asked)
    return float((np.abs(off) <= 1.96 * error).mean()), float(off.std() / response(asked).std())


def main() -> None:
    """Draw, fit, count."""
    functions = 2 if asked_for_quick(__doc__, "2 functions instead of 30") else 30
    rng, found = np.random.default_rng(1), {}
    for dimensions in range(1, len(NAMES) + 1):
        each = np.array([share_held(dimensions, rng) for _ in range(functions)])
        held, error = each[:, 0].mean(), np.median(each[:, 1])
        found[str(dimensions)] = {"held_by_95": float(held), "relative_error": float(error)}
    about = f"{functions} made-up responses for each number of parameters"
    write("claims", {"about": about, "parameters": found})


if __name__ == "__main__":
    main()
