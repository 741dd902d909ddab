"""What full and cheap runs say of each response, side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calibrator.case.case import Case
from calibrator.errors import CalibratorError
from calibrator.plan.requests import cheap_share
from calibrator.responses.cokriging import CheapRuns
from calibrator.responses.fidelities import both_ways, links_of
from calibrator.responses.fit import cheap_runs, fit
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.table import response_table
from calibrator.runs.record import Record
from calibrator.search.two_kinds import TwoKinds


def compared(
    case: Case, interpolant: Interpolant, records: Sequence[Record], cheap: Sequence[Record]
) -> tuple[TwoKinds, ...]:
    """A comparison for each response; empty where the case has no [fidelity].

    records, cheap : full runs, which the interpolant was fitted to, and cheap ones.
    """
    runs = cheap_runs(case, cheap)
    if runs is None or case.cheap is None:
        return ()
    links, keys, share = links_of(interpolant), interpolant.responses, cheap_share(case)
    points, values = response_table(case.problem, records, keys)
    differences = _differences((points, values), runs)
    left_out, alone = left_out_errors(interpolant), _errors_alone(case, records)
    found = []
    for i, key in enumerate(keys):
        link, scale = links[key]
        found.append(
            TwoKinds(
                key,
                int(np.isfinite(values[:, i]).sum()),
                int(np.isfinite(runs.values[:, i]).sum()),
                link.rho,
                link.size * scale,
                differences[i],
                left_out.get(key),
                alone.get(key),
                share,
            )
        )
    return tuple(found)


def left_out_errors(interpolant: Interpolant) -> dict[str, float | None]:
    """Root mean square error at sets left out, by response; None where no set can be left out."""
    predicted, _ = interpolant.leave_one_out()
    squares = (predicted - interpolant.values) ** 2
    return {
        key: float(np.sqrt(np.nanmean(column))) if np.isfinite(column).any() else None
        for key, column in zip(interpolant.responses, squares.T, strict=True)
    }


def _errors_alone(case: Case, records: Sequence[Record]) -> dict[str, float | None]:
    """The same of an interpolant without cheap runs; empty where the full ones are too few."""
    try:
        return left_out_errors(fit(case.without_fidelity(), records))
    except CalibratorError:
        return {}


def _differences(full: tuple[np.ndarray, np.ndarray], cheap: CheapRuns) -> list[float | None]:
    """Mean of full less cheap responses at the sets run both ways; None where none was."""
    low, high = both_ways(*full, cheap.points, cheap.values)
    found = []
    for column in (high - low).T:
        there = column[np.isfinite(column)]
        found.append(float(there.mean()) if len(there) else None)
    return found
