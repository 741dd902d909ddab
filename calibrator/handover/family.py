"""Parameter sets that the targets cannot tell from the chosen one, a few that span them all."""

from __future__ import annotations

import numpy as np

from calibrator.case.problem import Problem
from calibrator.handover.card import Member
from calibrator.search.outcome import Calibration
from calibrator.verification.outcome import Verdict

ACCEPTED = 8  # sets of the accepted region on a card: enough to see where it reaches
RELATED = 0.7  # a correlation from which two parameters are said to hang together
DIGITS = 5


def family(
    problem: Problem, calibration: Calibration, label: str, verdicts: dict[str, Verdict]
) -> tuple[Member, ...]:
    """The candidates of the front, the card's own first, then sets of the accepted region.

    verdicts : of the verification, by candidate, where it counts. Where no set agrees with the
    targets there is no such region, and the candidates stand alone.
    """
    found = calibration.ordered
    order = [label, *(name for name in found if name != label)]
    members = [
        Member(
            name,
            {n: found[name].parameters[n] for n in problem.names},
            verdicts[name].passed if name in verdicts else None,
        )
        for name in order
    ]
    if not calibration.identifiability.refused:
        start = found[label].point(problem.names)
        points = spread(problem, calibration.identifiability.accepted, start, ACCEPTED)
        members += [
            Member(f"accepted {i}", dict(zip(problem.names, map(_rounded, p), strict=True)), None)
            for i, p in enumerate(points, 1)
        ]
    return tuple(members)


def spread(problem: Problem, points: np.ndarray, start: np.ndarray, count: int) -> np.ndarray:
    """Of these points (n, d) the ones (count, d) that lie far from a start (d,) and each other.

    One after the other the point is taken that is farthest from all before it, in shares of the
    box, so that the same points give the same sets.
    """
    unit, taken = problem.shares_of(points), []
    away = np.linalg.norm(unit - problem.shares_of(start[None]), axis=1)
    for _ in range(min(count, len(points))):
        farthest = int(np.argmax(away))
        taken.append(farthest)
        away = np.minimum(away, np.linalg.norm(unit - unit[farthest], axis=1))
    return points[taken]


def note(problem: Problem, calibration: Calibration) -> str:
    """What the family is, and which of its parameters hang together."""
    known = calibration.identifiability
    if known.refused:
        return (
            "No parameter set agrees with all targets within the errors of the measurements: there"
            " is no family, and the candidates are compromises."
        )
    said = [
        "Candidates are members of the Pareto front between error and cost. Accepted sets are drawn"
        " in proportion to exp(-chi2/2) from all that agree with the targets, spread out; none of"
        " them was run."
    ]
    names = problem.names
    for i in range(len(names)):
        for j in range(i):
            if abs(known.correlation[i, j]) >= RELATED:
                said.append(
                    f"{names[j]} and {names[i]} hang together (correlation"
                    f" {known.correlation[i, j]:+.2f}): change one and the other must follow."
                )
    return " ".join(said)


def _rounded(value: float) -> float:
    """A number that is not known better than that."""
    return float(f"{value:.{DIGITS}g}")
