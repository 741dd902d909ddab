"""Every figure once, of made-up arrays, and every way in which one can be empty."""

import numpy as np

from calibrator.report.figures import calibration, grains, search
from calibrator.report.figures.runs import Deviation, run_curves, verification
from calibrator.runs.setups import HOURGLASS, LEDGE

RNG = np.random.default_rng(7)
AT = np.linspace(0.1, 0.4, 21)
TIME = np.linspace(0, 1, 30)


DECADE = dict(
    positions=AT * 1e7, runs_at=AT[:6] * 1e7, failed_at=AT[-2:] * 1e7, chosen=2e6, log=True
)


def some_slice(label="rolling friction", **changes):
    runs = RNG.random(6)
    given = dict(
        label=label, chosen=0.2, positions=AT, mean=30 + AT, std=np.full(21, 0.5),
        runs_at=0.1 + 0.3 * runs, runs_mean=30 + runs, runs_error=np.full(6, 0.1), nearness=runs,
        failed_at=AT[-2:], runs_fail=AT > 0.38,
    )  # fmt: skip
    return calibration.Slice(**{**given, **changes})


def some_scene(count=40, **changes):
    return grains.Scene(
        "filled",
        RNG.random((count, 3)) * 0.02,
        (np.array([[0, 0.02], [0, 0], [0.02, 0]]),),
        **changes,
    )


def some_profile(truth=0.23):
    return calibration.Profile(
        "rolling friction", AT, (AT - 0.25) ** 2 * 1e3 + 1.0, (0.19, 0.31), 0.24, truth
    )


CURVES = {"individual A": [(TIME, TIME**2)], "compromise": [(TIME, TIME), (TIME, 0.9 * TIME)]}
ROWS = [
    Deviation(c, "bulk density", 0.01, 0.004, p, 0.03)
    for c, p in (("compromise", 0.008), ("individual A", None))
]
FIGURES = {
    "packing": lambda: grains.packing(
        [some_scene(), some_scene(surface=np.array([[0, 0.01], [0.02, 0.0]]))], 1e-3, cut=True
    ),
    "slices": lambda: calibration.slices(
        [some_slice(), some_slice("young modulus [Pa]", **DECADE)],
        "angle [°]",
        30.2,
        0.3,
    ),
    "parity": lambda: calibration.parity(
        *RNG.random((3, 9, 2)), ["bulk density [kg/m³]", "angle [°]"]
    ),
    "front_evolution": lambda: search.front_evolution(
        {t: RNG.random((30, 2)) for t in (0, 1, 2, 3, 20, 60)},
        np.array([[0.0, 1.0], [0.1, 0.0]]),
        ["O1", "O2"],
        {"individual A": [0.0, 1.0], "compromise": [0.1, 0.0]},
    ),
    "generational_distance": lambda: search.generational_distance(
        [np.geomspace(1, 1e-4, 20), np.zeros(20)]
    ),
    "profile_likelihood": lambda: calibration.profile_likelihood(
        [some_profile(), some_profile(None)]
    ),
    "ridge": lambda: calibration.ridge(
        RNG.random((50, 3)),
        np.array([[0.01] * 3, [1.0] * 3]),
        ["a", "b", "c"],
        np.full(3, 0.5),
        np.array([[0.1, 0.2, np.nan]]),
        [False, True, False],
    ),
    "sensitivity": lambda: calibration.sensitivity(
        {"alone": (RNG.random((2, 3)), np.full((2, 3), 0.1))}, ["x", "y"], ["a", "b", "c"]
    ),
    "mass_time": lambda: run_curves(CURVES, HOURGLASS.history),
    "profiles": lambda: run_curves(CURVES, LEDGE.profile),
    "verification": lambda: verification(ROWS),
}
EMPTY = {
    "packing": lambda: grains.packing([], 1e-3),
    "packing without grains": lambda: grains.packing(
        [grains.Scene("filled", np.empty((0, 3)))], 1e-3
    ),
    "slices": lambda: calibration.slices([], "angle [°]", 30, 1),
    "parity": lambda: calibration.parity(*np.empty((3, 0, 1)), ["angle [°]"]),
    "parity without predictions": lambda: calibration.parity(
        *np.full((3, 4, 1), np.nan), ["angle [°]"]
    ),
    "front_evolution": lambda: search.front_evolution({}, np.ones((1, 2)), ["O1", "O2"]),
    "front_evolution without front": lambda: search.front_evolution(
        {0: np.ones((3, 2))}, np.empty((0, 2)), ["O1", "O2"]
    ),
    "generational_distance": lambda: search.generational_distance([]),
    "profile_likelihood": lambda: calibration.profile_likelihood([]),
    "ridge": lambda: calibration.ridge(
        np.empty((0, 2)),
        np.array([[0.0] * 2, [1.0] * 2]),
        ["a", "b"],
        np.zeros(2),
        np.empty((0, 2)),
        [False] * 2,
    ),
    "ridge of one parameter": lambda: calibration.ridge(
        np.ones((9, 1)), np.array([[0.0], [1.0]]), ["a"], np.zeros(1), np.empty((0, 1)), [False]
    ),
    "sensitivity": lambda: calibration.sensitivity({}, [], ["a"]),
    "mass_time": lambda: run_curves({}, HOURGLASS.history),
    "mass_time without runs": lambda: run_curves({"compromise": []}, HOURGLASS.history),
    "profiles": lambda: run_curves({}, LEDGE.profile),
    "verification": lambda: verification([]),
}
