"""Interpolate the raw responses that a case's targets need."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calibrator.case.case import Case
from calibrator.case.problem import Problem
from calibrator.errors import CalibratorError
from calibrator.responses.cautious import Cautious
from calibrator.responses.cokriging import CheapRuns, CoKriged
from calibrator.responses.coordinates import Changed, Coordinates
from calibrator.responses.gaussian_process import GaussianProcess
from calibrator.responses.interpolant import Interpolant, Learnt, average_replicates
from calibrator.responses.multilinear import Multilinear
from calibrator.responses.parted import Part, Parted
from calibrator.responses.success import nothing_good, require_good
from calibrator.responses.table import response_table
from calibrator.runs.record import Record


def fit_responses(
    problem: Problem,
    points: np.ndarray,
    values: np.ndarray,
    keys: Sequence[str],
    method: str = "process",
    similarity: bool = False,
    noise: np.ndarray | None = None,
    learnt: Learnt | None = None,
    cheap: CheapRuns | None = None,
) -> Interpolant:
    """Interpolate raw responses, each over those parameters that vary in its experiment.

    Parameters
    ----------
    points : (n, d) parameter sets, replicates repeated; NaN where a parameter does not vary
        in a row's experiment
    values : (n, m) responses, NaN where not measured
    keys : m names, experiment.response
    method : "process" or "multilinear"
    similarity : whether the particle density is taken out
    noise : (m,) seed noise where it is known
    learnt : what an earlier fit of the same runs found
    cheap : runs of a cheaper version of the same experiments, which these lean on

    Raises
    ------
    CalibratorError : as the interpolants do, and for a similarity without density or modulus
    """
    groups = _by_seen(problem, keys)
    if list(groups) == [tuple(problem.names)]:
        return _fit_alike(problem, points, values, keys, method, similarity, noise, learnt, cheap)
    parts = []
    for names, columns in groups.items():
        rows = np.isfinite(values[:, columns]).any(axis=1)
        seen = [problem.names.index(n) for n in names]
        inner = _fit_alike(
            problem.only(names),
            points[np.ix_(rows, seen)],
            values[np.ix_(rows, columns)],
            [keys[c] for c in columns],
            method,
            similarity,
            None if noise is None else noise[columns],
            None if learnt is None else learnt.of(columns),
            None if cheap is None else cheap.of(columns, seen),
        )
        parts.append(Part(seen, columns, inner))
    return Parted(problem, list(keys), tuple(parts))


def _by_seen(problem: Problem, keys: Sequence[str]) -> dict[tuple[str, ...], list[int]]:
    """Columns of the responses (m keys) that see the same parameters, by their names."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for column, key in enumerate(keys):
        groups.setdefault(tuple(problem.seen_by(key.split(".")[0])), []).append(column)
    return groups


def _fit_alike(
    problem: Problem,
    points: np.ndarray,
    values: np.ndarray,
    keys: Sequence[str],
    method: str,
    similarity: bool,
    noise: np.ndarray | None,
    learnt: Learnt | None,
    cheap: CheapRuns | None,
) -> Interpolant:
    """`fit_responses` of responses that all see every parameter of the problem."""
    change = Coordinates(problem, similarity)
    inward = change.inward(points)
    scaled = values / change.factors(points, keys)
    inner: Interpolant
    if method == "multilinear":
        inner = Multilinear.fit(inward, scaled, keys, noise, parameters=change.names)
        _require_reach(inner, change, keys[0].split(".")[0])
    elif cheap is not None:
        below = CheapRuns(change.inward(cheap.points), cheap.values)
        inner = CoKriged.fit(
            inward,
            scaled,
            keys,
            change.bounds,
            below,
            noise,
            parameters=change.names,
            learnt=learnt,
        )
    else:
        inner = GaussianProcess.fit(
            inward, scaled, keys, change.bounds, noise, parameters=change.names, learnt=learnt
        )
    if change.changed:
        distinct, means, _ = average_replicates(points, values)
        inner = Changed(change, inner, distinct, means)
    return Cautious.of(inner)


def _require_reach(inner: Multilinear, change: Coordinates, experiment: str) -> None:
    """Raise CalibratorError where a grid ends before the box does, as no run went well beyond."""
    low, high = change.bounds
    for i, name in enumerate(change.names):
        ends = inner.axes[i][0], inner.axes[i][-1]
        if not np.allclose(ends, (low[i], high[i]), rtol=1e-6):
            raise CalibratorError(
                f"no good run of {experiment} reaches from {name} = {low[i]:g} to {high[i]:g}, only"
                f" from {ends[0]:g} to {ends[1]:g}: narrow its bounds to these, or set"
                ' interpolation.method = "process"'
            )


def fit(
    case: Case,
    records: Sequence[Record],
    learnt: Learnt | None = None,
    cheap: Sequence[Record] = (),
) -> Interpolant:
    """Interpolate the raw responses that the targets need.

    learnt : what an earlier fit of the same records found; without it the kernels are searched for.
    cheap : runs of the case's cheaper version. Raises CalibratorError where no run is good, and as
    the interpolants do.
    """
    keys = [t.key for t in case.problem.targets]
    require_good(case.problem, records)
    points, values = response_table(case.problem, records, keys)
    if len(points) == 0:
        raise CalibratorError(
            "the database has no good run: look at the failures that the verb collect lists"
        )
    return fit_responses(
        case.problem,
        points,
        values,
        keys,
        case.interpolation.method,
        case.interpolation.similarity,
        learnt=learnt,
        cheap=cheap_runs(case, cheap),
    )


def cheap_runs(case: Case, records: Sequence[Record]) -> CheapRuns | None:
    """The targets' responses in runs of a case's cheaper version; None where it has none.

    Raises CalibratorError where no cheap run is good.
    """
    if case.cheap is None:
        return None
    keys = [t.key for t in case.problem.targets]
    found = CheapRuns(*response_table(case.cheap.problem, records, keys))
    if not len(found.points):
        why = nothing_good(case.cheap.problem, records)
        raise CalibratorError(
            f"no cheap run is good{f' ({why})' if why else ''}: choose other fidelity.values, or"
            " remove [fidelity]"
        )
    return found
