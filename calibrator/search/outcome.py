"""What a calibration found."""

from __future__ import annotations

from typing import Any

import numpy as np

from calibrator.case.case import Case
from calibrator.case.problem import Problem
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.objectives import evaluation
from calibrator.search.identifiability import identify
from calibrator.search.reach import Reachability

# parameter sets of the accepted region that the summary keeps, for the picture of the ridge
ACCEPTED = 1000


def candidates_of(
    case: Case, interpolant: Interpolant, points: dict[str, np.ndarray]
) -> dict[str, dict[str, Any]]:
    """Parameters, objectives and promised responses of each labelled set (d,)."""
    sets = np.array(list(points.values()))
    objectives = evaluation(case.problem, interpolant, case.search.objectives)(sets)
    mean, error = interpolant.predict_with_error(sets)
    return {
        label: {
            "parameters": dict(zip(case.problem.names, map(float, sets[i]), strict=True)),
            "objectives": dict(zip(case.search.objectives, map(float, objectives[i]), strict=True)),
            "predicted": {
                k: {"mean": float(m), "error": float(e)}
                for k, m, e in zip(interpolant.responses, mean[i], error[i], strict=True)
            },
        }
        for i, label in enumerate(points)
    }


def reached(reach: Reachability) -> dict[str, Any]:
    return {
        "all": reach.joint.reachable and all(t.reachable for t in reach.targets),
        "sentences": [t.sentence for t in reach.targets] + [reach.joint.sentence],
        "missed": [t.key for t in reach.targets if not t.reachable],
    }


def identified(
    problem: Problem, interpolant: Interpolant, truth: dict[str, float]
) -> dict[str, Any]:
    """Profile intervals per parameter, with the known truth where the lab is synthetic."""
    found = identify(problem, interpolant)
    profiles = [
        {
            "name": p.name,
            "best": p.best,
            "interval_68": list(p.interval_68),
            "interval_95": list(p.interval_95),
            "pinned": p.pinned,
            "sentence": p.sentence,
            "truth": truth.get(p.name),
            "positions": p.positions.tolist(),
            "chi2": p.chi2.tolist(),
        }
        for p in found.parameters
    ]
    return {
        "chi2": found.chi2,
        "parameters": profiles,
        "correlation": found.correlation.tolist(),
        "accepted": found.accepted[:: max(1, len(found.accepted) // ACCEPTED)].tolist(),
        "assumed": list(found.assumed),
    }
