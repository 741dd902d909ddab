"""What does each response say of the frictions, and how much do single runs of it scatter?

    python -m benchmarks.numerics.sensitivities

From the runs of cases/missing_effect.toml without any effect (grid/missing_effect.csv: seven small
experiments, 32 sets of the two frictions, two seeds each): a quadratic surface of each response is
fitted by least squares, and its logarithmic slopes at the middle of the box are taken, beside the
scatter of a single run over the value. Writes benchmarks/results/sensitivities.json; `calibrator
init` holds the same numbers (`calibrator/first_case/sensitivities.py`), and a test compares them.
"""

from pathlib import Path

import numpy as np

from benchmarks.common import write
from calibrator.case.problem import Problem
from calibrator.case.toml import read_case
from calibrator.case.vocabulary import EFFECTS, RESPONSES
from calibrator.runs.database import Database
from calibrator.runs.record import Record

REPO = Path(__file__).resolve().parents[2]
CASE = REPO / "cases" / "missing_effect.toml"
RUNS = REPO / "grid" / "missing_effect.csv"


def sensitivities() -> dict[str, dict[str, float]]:
    """Slopes and scatter of each response by `setup.response`.

    slope_rolling, slope_sliding : d ln(response) / d ln(friction); their errors : standard errors;
    scatter : of a single run over the response's value.
    """
    problem = read_case(CASE).problem
    own = [r for r in Database.read(RUNS).records.values() if _plain(r, problem)]
    found = {}
    for setup, name in [(s, n) for n, q in RESPONSES.items() for s in q.setups]:
        runs = [r for r in own if r.request.setup == setup and name in r.responses]
        values = np.array([r.responses[name] for r in runs])
        if len(values) and (values > 0).all():
            points = np.array([[r.request.value(n) for n in problem.names] for r in runs], float)
            found[f"{setup}.{name}"] = _slopes(problem, points, values)
    return found


def _plain(record: Record, problem: Problem) -> bool:
    """Whether a run ended well, in the case's own vessel, with its fixed values and no effect."""
    request = record.request
    given = {**problem.fixed, **problem.setups[request.setup]}
    own = all(request.value(n) == v for n, v in given.items())
    return record.status == "ok" and own and not EFFECTS.keys() & request.parameters.keys()


def _slopes(problem: Problem, points: np.ndarray, values: np.ndarray) -> dict[str, float]:
    """Logarithmic slopes of values (n,) at points (n, 2), at the middle of the box."""
    middle, width = 0.5 * (problem.low + problem.high), problem.high - problem.low
    x = (points - middle) / width
    columns = np.column_stack([np.ones(len(x)), x, x**2, x[:, 0] * x[:, 1]])
    fit, *_ = np.linalg.lstsq(columns, values, rcond=None)
    left = values - columns @ fit
    spread = float(np.sqrt(left @ left / (len(values) - columns.shape[1])))
    cov = spread**2 * np.linalg.inv(columns.T @ columns)
    to_log = middle / width / fit[0]
    slopes, errors = fit[1:3] * to_log, np.sqrt(np.diag(cov)[1:3]) * np.abs(to_log)
    return {
        "slope_rolling": round(float(slopes[0]), 3),
        "slope_rolling_error": round(float(errors[0]), 3),
        "slope_sliding": round(float(slopes[1]), 3),
        "slope_sliding_error": round(float(errors[1]), 3),
        "scatter": round(spread / abs(float(fit[0])), 4),
        "runs": len(values),
    }


if __name__ == "__main__":
    write("sensitivities", {"responses": sensitivities()})
