"""A curve is a few responses whose errors are those of a curve, not of its points."""

import dataclasses

import numpy as np
import pytest

from calibrator.case.curve import MeasuredCurve
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.errors import CalibratorError
from calibrator.plan.design import sobol
from calibrator.responses.curves import components
from calibrator.responses.fit import fit_responses
from calibrator.responses.targets import met
from calibrator.search.reach import unreachable
from tests.curve_world import NOISE, RADII, TRUTH, heap, photographed, scatter

PARAMETERS = (Parameter("rolling_friction", 0.05, 0.45), Parameter("sliding_friction", 0.2, 0.7))


def target_of(curve, **options):
    options = {"replicates": 5, **options}
    return Target("conical_pile", "profile_height", curve.level, curve=curve, **options)


@pytest.fixture(scope="module")
def database():
    """Sets with two seeds, and the curves of their runs."""
    rng, problem = np.random.default_rng(4), Problem(PARAMETERS, (target_of(photographed_once()),))
    points = np.repeat(sobol(problem, 24), 2, axis=0)
    return points, [np.array([RADII, heap(*point) + scatter(rng)]) for point in points]


def photographed_once(**options):
    return photographed(np.random.default_rng(5), **options)


def test_the_measured_curve_has_the_values_of_its_targets(database):
    curve = photographed_once(points=51)
    found = components(target_of(curve), *database)
    values = found.of(np.array([curve.x, curve.value]))
    assert values == pytest.approx({t.response: t.value for t in found.targets})
    names = ["profile_height_1", "profile_height_2", "profile_height_difference"]
    assert list(values) == names


def test_what_differs_in_the_root_mean_square_is_what_the_components_differ_by(database):
    found = components(target_of(photographed_once()), *database)
    assert found.shapes @ found.shapes.T / len(found.grid) == pytest.approx(np.eye(3), abs=1e-9)
    off = np.array([0.02, -0.015, 0.01]) * found.curve.curve.span
    moved = found.of(np.array([found.grid, found.value + off @ found.shapes]))
    assert [moved[t.response] - t.value for t in found.targets] == pytest.approx(off)


def test_a_curve_whose_components_are_all_met_is_within_its_tolerance(database):
    bare = dataclasses.replace(photographed_once(), scatter=(0.0,) * 60)
    found = components(target_of(bare, tolerance=0.05), *database)
    most = 0.999 * np.array([t.tolerance * t.scale for t in found.targets])
    means = np.array([t.value for t in found.targets]) + most
    assert met(found.targets, means, np.zeros(len(most)), 1).all()
    root_mean_square = np.sqrt(np.mean((most @ found.shapes) ** 2))
    assert root_mean_square == pytest.approx(0.999 * 0.05 * bare.span)


def test_its_part_of_o1_is_no_more_than_its_difference_over_its_range(database):
    found = components(target_of(photographed_once(), weight=2.0), *database)
    off = np.random.default_rng(1).normal(size=(100, len(found.targets)))
    o1 = sum(t.weight * np.abs(d) / t.scale for t, d in zip(found.targets, off.T, strict=True))
    whole = 2.0 * np.linalg.norm(off, axis=1) / found.curve.curve.span
    assert (o1 <= whole * 1.000001).all() and (o1 >= whole / 3**0.5 * 0.999999).all()


def test_reading_a_photograph_at_more_points_tells_no_more(database):
    few, many = (
        components(target_of(photographed_once(points=n)), *database).targets for n in (40, 400)
    )
    for one, other in zip(few, many, strict=True):
        assert one.standard_error == pytest.approx(other.standard_error, rel=0.1)


def test_laboratories_scatter_as_the_components_say_and_one_by_one(database):
    found = components(target_of(photographed_once(scale_error=0.02)), *database)
    rng, draws = np.random.default_rng(6), []
    for _ in range(400):
        curve = photographed(rng, scale_error=0.02)
        draws.append(list(found.of(np.array([curve.x, curve.value])).values())[:-1])
    stated = np.array([t.standard_error for t in found.targets[:-1]])
    assert np.std(draws, axis=0) == pytest.approx(stated, rel=0.3)
    assert abs(np.corrcoef(np.transpose(draws))[0, 1]) < 0.2


@pytest.mark.parametrize("shared", ["scale_error", "offset_error", "shift_error"])
def test_replicates_do_not_average_an_error_that_all_share(database, shared):
    size = {"scale_error": 0.05, "offset_error": 3e-4, "shift_error": 1e-3}[shared]
    curve = dataclasses.replace(photographed_once(), **{shared: size})
    five, many = (
        max(t.standard_error for t in components(target_of(curve, replicates=n), *database).targets)
        for n in (5, 5000)
    )
    alone = dataclasses.replace(curve, **{shared: 0.0})
    assert five > 2 * max(t.standard_error for t in components(target_of(alone), *database).targets)
    assert many > 0.5 * five


def test_a_curve_that_no_simulation_has_is_out_of_reach(database):
    points, curves = database
    for bump, reached in ((0.0, True), (0.4e-3, False)):
        found = components(target_of(photographed_once(bump=bump)), *database)
        problem = Problem(PARAMETERS, found.targets)
        values = np.array([list(found.of(one).values()) for one in curves])
        surface = fit_responses(problem, points, values, [t.key for t in found.targets])
        reach = unreachable(problem, surface)
        assert reach.all is reached
        assert reached or "conical_pile.profile_height_difference" in reach.missed


def test_runs_of_one_set_are_compared_by_their_difference_alone():
    rng, curve = np.random.default_rng(7), photographed_once(points=51)
    runs = [np.array([RADII, heap(*TRUTH.values()) + 1e-3 + scatter(rng)]) for _ in range(4)]
    found = components(target_of(curve), np.full((4, 2), 0.3), runs)
    (target,) = found.targets
    mean = np.mean([found.of(one)[target.response] for one in runs])
    rows = np.array([found.on_grid(one) for one in runs]).mean(axis=0)
    assert abs(mean - target.value) == pytest.approx(np.sqrt(np.mean((rows - found.value) ** 2)))
    assert target.standard_error == pytest.approx(NOISE / 5**0.5, rel=0.5)


def test_what_seed_noise_alone_shows_is_no_component():
    rng, points = (
        np.random.default_rng(8),
        np.repeat(np.random.default_rng(9).random((24, 2)), 2, 0),
    )
    runs = [np.array([RADII, heap(*TRUTH.values()) + scatter(rng)]) for _ in points]
    found = components(target_of(photographed_once()), points, runs)
    assert len(found.targets) == 2  # the first one in any case, and the difference


def test_a_measured_curve_longer_than_the_vessel_is_refused(database):
    points, curves = database
    curve = photographed_once()
    longer = MeasuredCurve((*curve.x, 40e-3), (*curve.value, 0.0), (*curve.scatter, NOISE))
    assert components(target_of(longer), points, curves)  # beside a heap there is the table
    ledge = Target("ledge", "profile_height", longer.level, curve=longer)
    with pytest.raises(CalibratorError, match="cut the measured curve, or correct its unit"):
        components(ledge, points, curves)


def test_a_curve_needs_scatter_or_tolerance(database):
    bare = dataclasses.replace(photographed_once(), scatter=(0.0,) * 60)
    with pytest.raises(CalibratorError, match="neither scatter nor tolerance"):
        components(target_of(bare, tolerance=0.0), *database)
