"""Experiments: their names and order, and the seeds by which conditions are told apart."""

import pytest

from calibrator.case.experiment import Condition, condition_of_seed, ordered, seed_shift
from calibrator.case.problem import Parameter, Problem, Target
from calibrator.errors import CalibratorError

CONDITIONS = {
    "small": Condition("conical_pile", {"fill_height": 0.012}),
    "wide": Condition("hourglass", {"neck_diameter": 0.02, "sliding_friction": 0.3}),
}
FRICTIONS = (Parameter("rolling_friction", 0.1, 0.4), Parameter("sliding_friction", 0.2, 0.7))
FLOW = Target("hourglass", "mass_flow_rate", 0.03)


def under(condition):
    return Target("hourglass", "mass_flow_rate", 0.05, condition=condition)


def test_set_ups_come_first_and_then_conditions_as_the_case_has_them():
    wanted = ["hourglass@wide", "conical_pile", "conical_pile@small", "hourglass", "hourglass"]
    assert ordered(wanted, CONDITIONS) == [
        "hourglass",
        "conical_pile",
        "conical_pile@small",
        "hourglass@wide",
    ]


def test_a_seed_says_of_which_condition_it_is():
    for name, condition in CONDITIONS.items():
        shift = seed_shift(f"{condition.setup}@{name}", CONDITIONS)
        for seed in (0, 1_000, 99_999_999):
            assert condition_of_seed(seed + shift, CONDITIONS) == name
    assert seed_shift("hourglass", CONDITIONS) == 0
    for seed in (0, 50_000_000, 599_999_999, 800_000_000):
        assert condition_of_seed(seed, CONDITIONS) == ""


def test_a_condition_hides_what_it_fixes_and_wins_over_the_set_up():
    problem = Problem(
        FRICTIONS,
        (FLOW, under("wide")),
        setups={"hourglass": {"neck_diameter": 0.015, "fill_mass": 0.01}},
        conditions=CONDITIONS,
    )
    assert problem.experiments == ["hourglass", "hourglass@wide"]
    assert problem.seen_by("hourglass") == ["rolling_friction", "sliding_friction"]
    assert problem.seen_by("hourglass@wide") == ["rolling_friction"]
    assert problem.values_of("hourglass@wide") == {
        "neck_diameter": 0.02,
        "fill_mass": 0.01,
        "sliding_friction": 0.3,
    }
    assert problem.targets[1].key == "hourglass@wide.mass_flow_rate"


@pytest.mark.parametrize(
    ("condition", "said"),
    [
        ("wid", "unknown condition 'wid': did you mean wide"),
        ("small", "hourglass@small.mass_flow_rate: the condition belongs to conical_pile"),
    ],
)
def test_a_target_needs_a_condition_of_its_own_set_up(condition, said):
    with pytest.raises(CalibratorError, match=said):
        Problem(FRICTIONS, (under(condition),), conditions=CONDITIONS)


def test_one_response_may_be_measured_under_each_condition_once():
    with pytest.raises(CalibratorError, match=r"hourglass@wide\.mass_flow_rate is given twice"):
        Problem(FRICTIONS, (FLOW, under("wide"), under("wide")), conditions=CONDITIONS)
