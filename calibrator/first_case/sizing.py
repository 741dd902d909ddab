"""The largest vessels, and the design, that a budget pays for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from calibrator.case.case import Case
from calibrator.errors import CalibratorError
from calibrator.first_case.grains import SOFTNESS
from calibrator.plan.requests import make_request, plan_requests
from calibrator.runs.cost import core_seconds
from calibrator.runs.setups import particles

ACROSS = (1e9, 80.0, 60.0, 50.0, 40.0, 35.0, 30.0, 25.0, 20.0, 17.0, 15.0, 12.0)
"""Grain diameters across the widest vessel, from the laboratory's own down."""
GOOD = 20.0
"""Below it a plan of fewer runs in a wider vessel comes first."""
CANDIDATES = 4
"""Members of the front that are verified beside the compromise, at most."""
MARGIN = 1.25
"""Runs that clog and are made again, and what the forecast may be off by."""


@dataclass(frozen=True)
class Design:
    """Of the database: kind, sets, replicates, and the most runs of an adaptive one."""

    kind: str
    sets: int
    replicates: int
    most_runs: int = 100


@dataclass(frozen=True)
class Sized:
    """A case that fits a budget: across : grain diameters that its vessels have at most.

    softness : pressure at the bottom over Young's modulus, one of grains.SOFTNESS.
    hours : core-hours of everything, predicted; runs : of the plan, at most.
    """

    case: Case
    across: float
    softness: float
    hours: float
    runs: int


Build = Callable[[float, float, str, bool], Case]
"""The case at a number of grain diameters across and a softness, with a kind of design.

The last says whether all that was measured has to be kept. CalibratorError where there is none.
"""


def design_of(kind: str, parameters: int, experiments: int) -> Design:
    """A Sobol sequence for so many parameters, or an adaptive design of half its runs."""
    if kind == "sobol":
        return Design(kind, 8 * parameters, 2)
    start, confirming = parameters + 3, 3
    return Design(kind, start, confirming, experiments * (start + 2 * (confirming - 1) + 8))


def fit(build: Build, budget: float) -> Sized:
    """The largest vessels that the budget [core-hours] pays for, with the design that fits.

    Raises CalibratorError where none does, with what the smallest would cost.
    """
    last, least = None, float("inf")
    for across, softness, kind, keep in _trials():
        try:
            case = build(across, softness, kind, keep)
        except CalibratorError as error:
            last = error
            continue
        hours = forecast(case)
        if hours <= budget:
            planned = len(plan_requests(case))
            return Sized(
                case,
                across,
                softness,
                hours,
                case.plan.most_runs if kind == "adaptive" else planned,
            )
        least = min(least, hours)
    if least == float("inf"):
        raise last or CalibratorError("no case can be made of these answers; correct them")
    why = f"; in smaller vessels {last.messages[0]}" if last else ""
    raise CalibratorError(
        f"the smallest plan takes {least:.2g} core-hours, more than budget = {budget:g}{why}; raise"
        " the budget, or measure in smaller vessels, such as a neck of 10 grain diameters"
    )


def _trials() -> Iterator[tuple[float, float, str, bool]]:
    """What is tried, in order.

    All that was measured, in wide vessels, with either design; then in narrow ones, where fewer
    runs come before a narrower vessel; then the same without what such vessels say nothing of. Each
    with softer grains before anything else is given up.
    """
    wide = [a for a in ACROSS if a >= GOOD]
    narrow = [a for a in ACROSS if a < GOOD]
    kinds = ("sobol", "adaptive")
    for keep in (True, False):
        yield from ((a, s, kind, keep) for kind in kinds for a in wide for s in SOFTNESS)
        yield from ((a, s, kind, keep) for a in narrow for kind in kinds for s in SOFTNESS)


def forecast(case: Case) -> float:
    """Core-hours of the plan, the verification and the validation.

    An adaptive plan counts with the most runs that it may make.
    """
    planned = plan_requests(case)
    seconds = float(core_seconds(planned, rate=case.run.particle_steps_per_second).sum())
    if case.plan.design == "adaptive":
        seconds *= max(case.plan.most_runs / len(planned), 1.0)
    spread = case.verify.replicates + CANDIDATES * case.verify.spread_replicates
    for experiments, count in (
        (case.problem.experiments, spread),
        (case.problem.held_out_experiments, case.validate.replicates),
    ):
        for experiment in experiments:
            seconds += count * per_run(case, experiment)
    return MARGIN * seconds / 3600


def per_run(case: Case, experiment: str) -> float:
    """Core-seconds of a run at the dear end of the box."""
    dear = make_request(case, experiment, case.problem.high, 1)
    return float(core_seconds([dear], rate=case.run.particle_steps_per_second)[0])


def grains_of(case: Case, experiment: str) -> int:
    """Grains of a run."""
    return particles(make_request(case, experiment, case.problem.high, 1))
