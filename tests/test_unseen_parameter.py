"""A set-up that does not have a calibrated parameter: its responses are interpolated without it."""

import numpy as np
import pytest

from calibrator.case.problem import Parameter, Problem, Target
from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError
from calibrator.plan.requests import belongs, design_points, make_request, plan_requests
from calibrator.plan.run import _parameter_sets, run_plan
from calibrator.report.findings import Findings
from calibrator.responses.fit import fit_responses
from calibrator.responses.table import points_of, response_table
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.search.calibrate import calibrate
from tests import fake_yade
from tests.conftest import LAB, space_for
from tests.stand_in import World, put_in_place

NECK = (
    "[parameters.young_modulus]\nlow = 0.5e6\nhigh = 4e6\nsamples = 2",
    "[parameters.neck_diameter]\nlow = 16e-3\nhigh = 20e-3\nsamples = 3",
)
WITH_LEDGE = LAB.replace(
    "ledge_equivalent_angle_deg,37.44,0.2,8,deg,held_out",
    "ledge_equivalent_angle_deg,37.44,0.2,8,deg,calibrate",
)
BOTH = Problem(
    (Parameter("sliding_friction", 0.2, 0.7), Parameter("neck_diameter", 16e-3, 20e-3)),
    (Target("hourglass", "mass_flow_rate", 0.03), Target("ledge", "bulk_density", 1600.0)),
)
KEYS = [t.key for t in BOTH.targets]


def wider_is_faster(setup, p, seed):
    responses = fake_yade.responses_of(setup, p)
    if setup == "hourglass":
        responses["mass_flow_rate"] *= (p["neck_diameter"] / 18e-3) ** 2.5
    return responses


def runs_of_both(count=12):
    """Records of both set-ups whose responses are linear."""
    records = []
    for seed, (friction, neck) in enumerate(
        BOTH.values_at(np.random.default_rng(1).random((count, 2)))
    ):
        flow = {"mass_flow_rate": 0.01 * friction + neck}
        hourglass = Request.of(
            "hourglass", sliding_friction=friction, neck_diameter=neck, seed=seed
        )
        ledge = Request.of("ledge", sliding_friction=friction, seed=seed)
        records.append(Record(hourglass, "ok", flow))
        records.append(Record(ledge, "ok", {"bulk_density": 1700 - 200 * friction}))
    return records


def test_a_run_has_no_value_of_what_its_set_up_does_not_have():
    points = points_of(BOTH, [r.request for r in runs_of_both(1)])
    assert np.isnan(points).tolist() == [[False, False], [False, True]]


def test_each_response_is_a_function_of_its_own_parameters_alone():
    points, values = response_table(BOTH, runs_of_both(), KEYS)
    model = fit_responses(BOTH, points, values, KEYS, noise=np.array([1e-6, 0.1]))
    asked = np.array([[0.3, 16e-3], [0.3, 20e-3], [0.6, 17e-3]])
    mean, error = model.predict_with_error(asked)
    np.testing.assert_allclose(mean[:, 0], 0.01 * asked[:, 0] + asked[:, 1], rtol=1e-3)
    np.testing.assert_allclose(mean[:, 1], 1700 - 200 * asked[:, 0], rtol=1e-3)
    assert mean[0, 1] == mean[1, 1] and (error < [1e-4, 2.0]).all()
    np.testing.assert_array_equal(model.predict(asked), mean)
    left_out, scatter = model.leave_one_out()
    assert left_out.shape == scatter.shape == model.values.shape == (24, 2) == model.points.shape
    there = np.isfinite(model.values)
    assert (there.sum(axis=0) == 12).all() and np.isfinite(left_out[there]).all()
    again = fit_responses(BOTH, points, values, KEYS, learnt=model.learnt)
    np.testing.assert_allclose(again.predict(asked), mean)
    assert model.learnt.kernels.shape == (2, 3) and model.noise.tolist() == [1e-6, 0.1]


def test_a_grid_runs_each_set_once_that_is_new_to_the_set_up(write_case, tmp_path, monkeypatch):
    grid = ('design = "sobol"\nsets = 14', 'design = "grid"')
    linear = ("[search]", '[interpolation]\nmethod = "multilinear"\n[search]')
    path = write_case(NECK, grid, linear, lab=WITH_LEDGE)
    requests = plan_requests(read_case(path))
    assert [sum(r.setup == s for r in requests) for s in ("hourglass", "ledge")] == [96, 32]
    put_in_place(monkeypatch, World(wider_is_faster))
    space = space_for(path, tmp_path)
    run_plan(space)
    found = calibrate(space)
    assert found.reachability.all and "ledge does not have neck_diameter" in found.lines()[1]
    row = found.sensitivity.responses.index("ledge.ledge_equivalent_angle_deg")
    assert found.sensitivity.total[row, 2] == 0 == found.sensitivity.first[row, 2]
    model = Findings.of(space).interpolant
    assert set(model.responses) <= set(found.seed_noise)


def test_runs_of_one_set_stand_in_one_row_and_belong(write_case):
    case = read_case(write_case(NECK, lab=WITH_LEDGE))
    point = design_points(case)[3]
    records = [
        Record(make_request(case, s, point, 7), "ok", {name: 1.0})
        for s, name in (("ledge", "ledge_equivalent_angle_deg"), ("hourglass", "mass_flow_rate"))
    ]
    assert all(belongs(case, r.request) for r in records)
    points, values = _parameter_sets(case, records)
    assert (points == point).all() and np.isfinite(values).sum() == 2 and len(values) == 1


def test_an_adaptive_design_confirms_with_both(write_case, tmp_path, monkeypatch):
    adaptive = (
        'design = "sobol"\nsets = 14\nreplicates = 2',
        'design = "adaptive"\nsets = 9\nreplicates = 3\nmost_runs = 90',
    )
    made = put_in_place(monkeypatch, World(wider_is_faster))
    outcome = run_plan(space_for(write_case(NECK, adaptive, lab=WITH_LEDGE), tmp_path))
    assert outcome.ended == "confirmed" and len(made.made) <= 90


def test_a_target_that_no_parameter_moves_is_refused_before_any_run(write_case):
    none = LAB.replace("calibrate", "held_out").replace(
        "37.44,0.2,8,deg,held_out", "37.44,0.2,8,deg,calibrate"
    )
    only_neck = (
        "[parameters.rolling_friction]\nlow = 0.05\nhigh = 0.45\nsamples = 4\n"
        "[parameters.sliding_friction]\nlow = 0.2\nhigh = 0.7\nsamples = 4\n",
        "",
    )
    with pytest.raises(CalibratorError, match="ledge has none of the calibrated parameters"):
        read_case(write_case(only_neck, NECK, lab=none))
    with pytest.raises(CalibratorError, match=r"neck_diameter is no parameter of ledge.*hourglass"):
        read_case(write_case(NECK, lab=none))
