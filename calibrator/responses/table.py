"""From records to arrays: parameter points and raw responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calibrator.case.experiment import condition_of_seed, experiment_name, parts_of
from calibrator.case.problem import Problem
from calibrator.case.vocabulary import PARAMETERS
from calibrator.runs.record import Record
from calibrator.runs.request import Request


def response_table(
    problem: Problem, records: Sequence[Record], keys: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Parameter points (n, d) and raw responses (n, m) of good runs; keys are experiment.response.

    Runs of different experiments are different rows. What a row does not have is NaN: the responses
    of other experiments, and the parameters that do not vary in its own.
    """
    good = [r for r in records if r.status == "ok"]
    points = points_of(problem, [r.request for r in good])
    where = [experiment_of(problem, r.request) for r in good]
    parted = [k.split(".") for k in keys]
    rows = [
        [r.responses.get(name, np.nan) if own == experiment else np.nan for own, name in parted]
        for r, experiment in zip(good, where, strict=True)
    ]
    return points, np.array(rows, float).reshape(-1, len(keys))


def points_of(problem: Problem, requests: Sequence[Request]) -> np.ndarray:
    """Parameter points (n, d) of runs; NaN where a parameter does not vary in their experiment."""
    rows = []
    for r in requests:
        experiment = experiment_of(problem, r)
        seen = problem.seen_by(experiment) if experiment else []
        rows.append([r.value(n) if n in seen else np.nan for n in problem.names])
    return np.array(rows, float).reshape(-1, len(problem.names))


def by_experiment(problem: Problem, records: Sequence[Record]) -> dict[str, list[Record]]:
    """The runs of each experiment that has any, in the order given."""
    found: dict[str, list[Record]] = {}
    for record in records:
        found.setdefault(experiment_of(problem, record.request), []).append(record)
    return found


def experiment_of(problem: Problem, request: Request) -> str:
    """The experiment of the problem that a run is one of; "" where it has the values of none.

    It is told by what the run holds of the parameters that conditions set. A run can hold the
    values of two: where a condition fixes what is calibrated, a set may have just that value. Then
    the range of its seed says for which of them the run was made.
    """
    rows = (*problem.targets, *problem.held_out)
    conditions = {t.condition for t in rows if t.condition and t.setup == request.setup}
    if not conditions:
        return request.setup
    varied = {name for c in conditions for name in problem.conditions[c].values}
    experiments = [experiment_name(request.setup, c) for c in ("", *sorted(conditions))]
    found = [e for e in experiments if _has_values(problem, e, request, varied)]
    if len(found) > 1:
        made_for = condition_of_seed(int(request.parameters["seed"]), problem.conditions)
        return next((e for e in found if parts_of(e)[1] == made_for), found[0])
    return found[0] if found else ""


def _has_values(problem: Problem, experiment: str, request: Request, names: set[str]) -> bool:
    """Whether a run holds of these parameters what an experiment has, where it does not vary."""
    given, seen = {**problem.fixed, **problem.values_of(experiment)}, problem.seen_by(experiment)
    return all(
        request.value(n) == given.get(n, PARAMETERS[n].default) for n in names if n not in seen
    )
