"""Both interpolants: a million predictions, and the process's growth with the runs.

    python -m benchmarks.numerics.interpolant            some minutes
    python -m benchmarks.numerics.interpolant --quick    few points, prints only: a smoke test

Writes benchmarks/results/interpolant.json and interpolant.png. The responses are made up
(benchmarks/common.py). `Multilinear` interpolates a full grid of 5 samples per parameter,
`GaussianProcess` 60 sets; scipy and scikit-learn get the very same data and kernels and all points
in one call. Throughput is in predicted points per second, each with 3 responses; memory is
tracemalloc's peak in a pass of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from sklearn.gaussian_process import GaussianProcessRegressor
from threadpoolctl import threadpool_limits

from benchmarks.common import (
    ABOUT,
    NOISE,
    RESPONSES,
    RESULTS,
    asked_for_quick,
    fitted,
    paper_problem,
    peak_memory,
    power,
    rounded,
    runs,
    seconds_of,
    surface,
    write,
)
from calibrator.case.problem import Problem
from calibrator.plan.design import full_grid
from calibrator.responses import gaussian_process
from calibrator.responses.gaussian_process import GaussianProcess
from calibrator.responses.multilinear import Multilinear

# likelihood searches of a calibration with 3 responses: one start and 3 restarts for each
FITS = 3 * (1 + 3)
PATIENCE = 600.0  # seconds that a fit may take in a calibration
ALL = 10**9

Predict = Callable[[np.ndarray], Any]


def predictors(problem: Problem) -> dict[str, tuple[Predict, np.ndarray]]:
    """What predicts, by name, with the bounds (2, 5) of the points that it takes."""
    box = np.array([problem.low, problem.high])
    grid = full_grid(problem)
    linear = Multilinear.fit(grid, surface((grid - box[0]) / (box[1] - box[0])), RESPONSES)
    scipy_linear = RegularGridInterpolator(
        linear.axes, linear.values.reshape(*map(len, linear.axes), 3)
    )
    process = fitted(problem, 60)
    regressors = [one.regressor for one in process.processes]
    return {
        "Multilinear": (linear.predict, box),
        "scipy RegularGridInterpolator": (scipy_linear, box),
        "GaussianProcess": (process.predict, box),
        "GaussianProcess with error": (process.predict_with_error, box),
        "sklearn GaussianProcessRegressor": (
            partial(sklearn_predict, regressors),
            np.array([-np.ones(5), np.ones(5)]),
        ),
    }


def sklearn_predict(regressors: list[GaussianProcessRegressor], unit: np.ndarray) -> np.ndarray:
    """Standardised means (n, 3) at points of the box from -1 to 1, one call for each response."""
    return np.column_stack([regressor.predict(unit) for regressor in regressors])


def throughput(
    name: str, predict: Predict, box: np.ndarray, count: int, repeats: int = 3
) -> dict[str, Any]:
    """Fastest of some passes over count random points, and the peak memory of another."""
    points = box[0] + (box[1] - box[0]) * np.random.default_rng(0).random((count, box.shape[1]))
    seconds = min(seconds_of(partial(predict, points))[0] for _ in range(repeats))
    row = {"name": name, "points": count, "points_per_second": rounded(count / seconds, 3)}
    row["peak_megabytes"] = rounded(peak_memory(partial(predict, points)), 3)
    print(row)
    return row


def growth(problem: Problem, sets: int, count: int) -> dict[str, Any]:
    """Fit of one response through so many runs with one start, then count predictions."""
    points, values = runs(problem, sets)
    box = np.array([problem.low, problem.high])
    fit = partial(
        GaussianProcess.fit, points, values[:, :1], RESPONSES[:1], box, NOISE[:1], restarts=0
    )
    seconds, exact = seconds_of(partial(with_kernel_points, ALL, fit))
    own_seconds, process = seconds_of(fit)
    row = {
        "runs": sets,
        "fit_seconds": rounded(own_seconds, 3),
        "fit_seconds_kernel_from_all": rounded(seconds, 3),
    }
    test = box[0] + (box[1] - box[0]) * np.random.default_rng(0).random((count, len(box[0])))
    for key, predict in (
        ("predict", process.predict),
        ("predict_with_error", process.predict_with_error),
    ):
        row[f"{key}_points_per_second"] = rounded(count / seconds_of(partial(predict, test))[0], 3)
    truth = surface((test - box[0]) / (box[1] - box[0]))[:, 0]
    for key, one in (("", process), ("_kernel_from_all", exact)):
        rms = np.sqrt(np.mean((one.predict(test)[:, 0] - truth) ** 2))
        row[f"rms_error_over_seed_noise{key}"] = rounded(rms / NOISE[0], 3)
    print(row)
    return row


def with_kernel_points(count: int, fit: Callable[[], GaussianProcess]) -> GaussianProcess:
    """A fit whose search for the kernel sees so many points."""
    before, gaussian_process.KERNEL_POINTS = gaussian_process.KERNEL_POINTS, count
    try:
        return fit()
    finally:
        gaussian_process.KERNEL_POINTS = before


def verdict(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """From how many runs on a kernel from all runs keeps a calibration waiting."""
    late = rows[-3:]
    exponent = power(
        [row["runs"] for row in late], [row["fit_seconds_kernel_from_all"] for row in late]
    )
    limit = late[-1]["runs"] * (PATIENCE / (FITS * late[-1]["fit_seconds_kernel_from_all"])) ** (
        1 / exponent
    )
    return {
        "power_of_runs": rounded(exponent, 3),
        "runs_that_fit_in_10_minutes": int(rounded(limit, 2)),
        "statement": (
            f"A calibration of 3 responses with 3 restarts does {FITS} searches for a kernel. With"
            f" all runs in each they take over 10 minutes on one thread beyond about {limit:.2g}"
            f" runs. The process therefore learns its kernel from {gaussian_process.KERNEL_POINTS}"
            f" of the runs and is conditioned on all, up to {gaussian_process.MOST_POINTS}; beyond"
            " that it refuses and names the multilinear interpolant."
        ),
    }


def measure(quick: bool) -> dict[str, Any]:
    """All results; quick ones mean nothing."""
    problem = paper_problem()
    count, sizes = (2000, [50, 100, 200]) if quick else (1_000_000, [50, 100, 200, 500, 1000, 2000])
    with threadpool_limits(1):
        predictions = [throughput(name, *how, count) for name, how in predictors(problem).items()]
        rows = [growth(problem, sets, count // 100) for sets in sizes]
    return {
        "about": f"{ABOUT}; one thread; 3 responses at each point, in growth 1",
        "data": {"grid_points": 5**5, "process_sets": 60},
        "predictions": predictions,
        "growth": {"predicted_points": count // 100, "runs": rows, **verdict(rows)},
    }


def plot(results: dict[str, Any]) -> None:
    """Throughput as bars; fit and prediction time over the runs."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    rows = results["predictions"][::-1]
    bars = left.barh([row["name"] for row in rows], [row["points_per_second"] for row in rows])
    left.bar_label(bars, [f" {row['peak_megabytes']:.0f} MB" for row in rows])
    left.set(xlabel="points per second", title=f"{rows[0]['points']} points, 3 responses")
    left.margins(x=0.25)
    growing = results["growth"]["runs"]
    sets, count = [row["runs"] for row in growing], results["growth"]["predicted_points"]
    right.loglog(
        sets,
        [row["fit_seconds_kernel_from_all"] for row in growing],
        "o:",
        label="fit, kernel from all runs",
    )
    right.loglog(
        sets,
        [row["fit_seconds"] for row in growing],
        "o-",
        label=f"fit, kernel from {gaussian_process.KERNEL_POINTS}",
    )
    for key, label in (("predict", "mean"), ("predict_with_error", "mean and error")):
        right.loglog(
            sets,
            [count / row[f"{key}_points_per_second"] for row in growing],
            "s--",
            label=f"{count} points: {label}",
        )
    right.set(xlabel="runs", ylabel="time [s]", title="Gaussian process, 1 response")
    right.legend(frameon=False)
    figure.savefig(RESULTS / "interpolant.png", dpi=150)


def main() -> None:
    """Measure, write, draw."""
    quick = asked_for_quick(__doc__, "few points, nothing written")
    results = measure(quick)
    print(results["growth"]["statement"])
    if not quick:
        write("interpolant", results)
        plot(results)


if __name__ == "__main__":
    main()
