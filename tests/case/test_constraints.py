"""Linear inequalities between parameters: read, and kept by all that chooses sets."""

import dataclasses

import numpy as np
import pytest

from calibrator.case.constraints import read_constraint
from calibrator.case.fingerprint import changed
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError
from calibrator.plan.design import full_grid, sobol
from calibrator.plan.run import run_plan
from calibrator.responses.box import corners, refined, sample_of
from calibrator.search.calibrate import calibrate
from calibrator.search.nsga2 import Settings, search
from tests.conftest import space_for
from tests.stand_in import World, put_in_place

NAMES = ["rolling_friction", "sliding_friction"]
BOX = Problem(
    (Parameter("rolling_friction", 0.1, 0.5), Parameter("sliding_friction", 0.2, 0.7)),
    (Target("hourglass", "bulk_density", 1600.0),),
)
FIRST_KEY = 'measured = "lab.csv"'


def constrained(*texts):
    return dataclasses.replace(
        BOX, constraints=tuple(c for t in texts for c in read_constraint(t, NAMES, {}))
    )


ROLLING_BELOW = constrained("rolling_friction <= sliding_friction")


@pytest.mark.parametrize(
    ("text", "factors", "bound"),
    [
        ("rolling_friction <= sliding_friction", {NAMES[0]: 1, NAMES[1]: -1}, 0),
        ("2*rolling_friction + sliding_friction/2 < 1", {NAMES[0]: 2, NAMES[1]: 0.5}, 1),
        ("1 >= -(rolling_friction - 3) * 2e0", {NAMES[0]: -2}, -5),
        ("rolling_friction <= restitution - 0.5", {NAMES[0]: 1}, 0.4),
    ],
)
def test_a_linear_inequality_is_read(text, factors, bound):
    (found,) = read_constraint(text, NAMES, {"restitution": 0.9})
    assert dict(zip(found.names, found.factors, strict=True)) == factors
    assert found.bound == pytest.approx(bound)


def test_a_chain_is_two_inequalities():
    found = read_constraint("0.2 <= rolling_friction <= sliding_friction", NAMES, {})
    assert [c.names for c in found] == [(NAMES[0],), tuple(NAMES)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("rolling_friction * sliding_friction <= 1", "not linear"),
        ("rolling_friction**2 <= 1", "not linear"),
        ("1 / rolling_friction <= 3", "not linear"),
        ("abs(rolling_friction) <= 3", "not linear"),
        ("__import__('os').system('true') <= 3", "not linear"),
        ("rolling_friction == sliding_friction", "does not compare with <= or >="),
        ("rolling_friction", "no inequality"),
        ("rolling_friction <= ", "cannot be read"),
        ("(" * 400, "cannot be read"),
        ("x" * 2000, "cannot be read"),
        ("1 <= 2", "names no calibrated parameter"),
        ("rolling_friction <= rolling_friction", "names no calibrated parameter"),
        ("rolling_frction <= 1", "'rolling_frction' is neither calibrated nor"),
        ("rolling_friction <= 1e300 * 1e300", "not finite"),
        ("rolling_friction <= True", "not linear"),
    ],
)
def test_anything_else_is_refused_in_words(text, said):
    with pytest.raises(CalibratorError, match=said):
        read_constraint(text, NAMES, {})


def test_constraints_that_leave_next_to_nothing_are_refused():
    with pytest.raises(CalibratorError, match="leave nothing of the box"):
        constrained("rolling_friction >= sliding_friction + 0.4")
    with pytest.raises(CalibratorError, match="leave almost nothing of the box"):
        constrained("rolling_friction >= sliding_friction + 0.291")


def test_designs_samples_and_corners_keep_to_them():
    assert len(sobol(ROLLING_BELOW, 30)) == 30
    for points in (
        sobol(ROLLING_BELOW, 30),
        full_grid(ROLLING_BELOW),
        corners(ROLLING_BELOW),
        sample_of(ROLLING_BELOW, 100, np.random.default_rng(1)),
    ):
        assert len(points) and (points[:, 0] <= points[:, 1]).all()
    np.testing.assert_array_equal(sobol(ROLLING_BELOW, 30)[:12], sobol(ROLLING_BELOW, 12))
    near = refined(
        lambda p: np.abs(p - [0.5, 0.2]).sum(axis=1), np.array([0.3, 0.45]), ROLLING_BELOW,
        np.random.default_rng(1),
    )  # fmt: skip
    assert near[0] <= near[1]


def test_the_search_ranks_what_is_not_allowed_behind_what_is():
    def evaluate(points):
        return np.column_stack([np.abs(points[:, 0] - 0.5), points[:, 1]])

    found = search(ROLLING_BELOW, evaluate, Settings(60, 20), excess=ROLLING_BELOW.excess)
    assert (found.points[:, 0] <= found.points[:, 1]).all()
    assert found.points[0, 0] == pytest.approx(0.5, abs=0.01)
    with pytest.raises(CalibratorError, match="no parameter set"):
        search(BOX, evaluate, Settings(20, 2), excess=lambda points: np.ones(len(points)))


def test_a_log_scale_is_left_by_shares_of_its_decades():
    wide = Problem((Parameter("young_modulus", 1e5, 1e9, scale="log"),), BOX.targets)
    own = tuple(read_constraint("young_modulus <= 1e6", ["young_modulus"], {}))
    wide = dataclasses.replace(wide, constraints=own)
    assert wide.excess(np.array([[1.1e6]]))[0] == pytest.approx(np.log(1.1) / np.log(1e4), rel=0.1)


def test_a_case_keeps_its_constraints_from_design_to_intervals(write_case, tmp_path, monkeypatch):
    lines = f'{FIRST_KEY}\nconstraints = ["2 * rolling_friction <= sliding_friction - 0.05"]'
    path = write_case((FIRST_KEY, lines))
    put_in_place(monkeypatch, World())
    space = space_for(path, tmp_path)
    run_plan(space)
    found = calibrate(space)
    sets = [c.point(space.case.problem.names) for c in found.candidates.values()]
    for points in (np.array(sets), found.identifiability.accepted):
        # the truth, 0.25 and 0.5, lies outside
        assert (2 * points[:, 0] <= points[:, 1] - 0.05 + 0.01).all()
    assert (2 * np.array(sets)[:, 0] <= np.array(sets)[:, 1] - 0.05 + 1e-9).all()


def test_a_grid_with_holes_is_no_multilinear_one(write_case):
    changes = (
        (FIRST_KEY, f'{FIRST_KEY}\nconstraints = ["rolling_friction <= sliding_friction"]'),
        ('design = "sobol"\nsets = 14', 'design = "grid"'),
    )
    assert read_case(write_case(*changes)).problem.constraints
    linear = ("[search]", '[interpolation]\nmethod = "multilinear"\n[search]')
    with pytest.raises(CalibratorError, match=r"multilinear.*every set of the grid"):
        read_case(write_case(*changes, linear))


def test_outcomes_rest_on_the_constraints(write_case):
    from calibrator.plan.outcome import rests_on as plan_rests_on
    from calibrator.search.outcome import rests_on

    line = f'{FIRST_KEY}\nconstraints = ["rolling_friction <= sliding_friction"]'
    without, constrained_case = read_case(write_case()), read_case(write_case((FIRST_KEY, line)))
    for of in (rests_on, plan_rests_on):
        assert changed(of(without, []), of(constrained_case, [])) == ["constraints"]
