"""From a case to the runs it needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calibrator.case.case import Case
from calibrator.case.experiment import parts_of
from calibrator.case.settings import ADAPTIVE_REPLICATED, Replicates
from calibrator.case.values import Value
from calibrator.case.vocabulary import parameters_of
from calibrator.plan.design import full_grid, sobol
from calibrator.plan.seeds import in_experiment, plan_seed, substitute_seed, verification_seed
from calibrator.responses.table import experiment_of, points_of
from calibrator.runs.cost import core_seconds
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.setups import particles, steps


def design_points(case: Case) -> np.ndarray:
    """Parameter sets (n, d) of the database; those it starts with where the design is adaptive.

    Where there are cheap runs as well, those that are run in full.
    """
    if case.plan.design == "grid":
        return full_grid(case.problem)
    return sobol(case.problem, case.fidelity.dear_sets if case.fidelity else case.plan.sets)


def plan_requests(case: Case) -> list[Request]:
    """Every run of the database.

    Each experiment that has a target at each set, its replicates with seeds of their own; the cheap
    ones first, where there are such.
    """
    return [request for own in requests_by_experiment(case).values() for request in own]


def requests_by_experiment(case: Case) -> dict[str, list[Request]]:
    """The same by the name of their experiment, behind "cheap_" where they are cheap."""
    points = design_points(case)
    full = {e: _requests_of(case, e, points) for e in case.problem.experiments}
    if case.cheap is None:
        return full
    return {f"cheap_{e}": own for e, own in requests_by_experiment(case.cheap).items()} | full


def _requests_of(case: Case, experiment: str, points: np.ndarray) -> list[Request]:
    """The runs of one experiment at those of the sets (n, d) that differ in what it sees."""
    plan, replicated = case.plan, case.plan.replicated_sets
    if plan.design == "adaptive":
        replicated = replicated or ADAPTIVE_REPLICATED  # the rest where that decides
    seen = [n in case.problem.seen_by(experiment) for n in case.problem.names]
    # sets of a grid that differ in what does not vary in the experiment are the same run to it
    _, own = np.unique(points[:, seen], axis=0, return_index=True)
    first = [
        make_request(
            case, experiment, points[i], in_experiment(case, experiment, plan_seed(case, i))
        )
        for i in sorted(own.tolist())
    ]
    # what forecasts know of machines may change, and the plan that runs were made for must not
    order = np.argsort([particles(r) * steps(r) for r in first], kind="stable")
    cheapest, requests = set(order[: replicated or None].tolist()), list[Request]()
    for i, request in enumerate(first):
        count, seed = plan.replicates if i in cheapest else 1, int(request.parameters["seed"])
        requests += [request, *(request.with_seed(seed + j) for j in range(1, count))]
    return requests


def replicate_requests(
    case: Case, experiment: str, point: np.ndarray, fresh: Replicates, index: int = 0
) -> list[Request]:
    """Fresh seeds of one candidate; `index` keeps the seeds of several candidates apart."""
    seeds = (verification_seed(fresh, index, j) for j in range(fresh.replicates))
    return [
        make_request(case, experiment, point, in_experiment(case, experiment, seed))
        for seed in seeds
    ]


def make_request(
    case: Case,
    experiment: str,
    point: np.ndarray,
    seed: int,
    changed: Mapping[str, Value] | None = None,
) -> Request:
    """One run of an experiment, a set-up as it is or under a condition, at a parameter set (d,).

    changed : values that win over the case's own, such as an effect's. What the set-up does not
    know is left out.
    """
    setup, _ = parts_of(experiment)
    own = parameters_of(setup)
    calibrated = dict(zip(case.problem.names, (float(x) for x in point), strict=True))
    values = {
        **case.problem.fixed,
        **calibrated,
        **case.problem.values_of(experiment),
        **(changed or {}),
    }
    return Request.of(setup, **{**{n: v for n, v in values.items() if n in own}, "seed": seed})


def belongs(case: Case, request: Request) -> bool:
    """Whether a run is one of this case's.

    It has one of its experiments, its fixed values, and a parameter set inside its box.
    """
    experiment = experiment_of(case.problem, request)
    if experiment not in case.problem.experiments:
        return False
    point = points_of(case.problem, [request])[0]
    if ((point < case.problem.low) | (point > case.problem.high)).any():
        return False
    return make_request(case, experiment, point, int(request.parameters["seed"])) == request


def cheap_share(case: Case) -> float:
    """Predicted cost of a cheap run, as a share of a full one's, in the middle of the box.

    1 where the case has no [fidelity].
    """
    centre = case.problem.values_at(np.full((1, len(case.problem.names)), 0.5))[0]
    cheap, full = (
        core_seconds([make_request(c, e, centre, 1) for e in case.problem.experiments]).sum()
        for c in (case.cheap or case, case)
    )
    return float(cheap / full)


def substitutes(records: Sequence[Record], limit: int = 1) -> list[Request]:
    """One more run with another seed for each clogged one, `limit` times for an original at most.

    The clogged runs stay in the database and are counted: what a clogged run has no discharge time
    for, its substitute measures.
    """
    again = []
    for record in records:
        seed = substitute_seed(int(record.request.parameters["seed"]), limit)
        if record.status == "clogged" and seed is not None:
            again.append(record.request.with_seed(seed))
    return again
