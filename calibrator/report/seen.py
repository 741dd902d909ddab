"""What the figures of a report show, in a sentence each that states the finding.

They stand in for a figure where it cannot be seen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calibrator.case.problem import Target
from calibrator.report.findings import Findings
from calibrator.report.words import amount, key_words, listed, number, response, words
from calibrator.responses.objectives import OBJECTIVES
from calibrator.runs.setup import Curve
from calibrator.search.outcome import COMPROMISE
from calibrator.verification.outcome import Verdict

SETTLED = 0.05
"""Of its first value: a distance to the final front below that counts as none."""
RIDGE = 0.7
"""Correlation of accepted sets from which two parameters make up for each other."""


def beside(share: float) -> str:
    """A relative deviation in words.

    >>> beside(0.031), beside(-0.004), beside(1e-6)
    ('3.1 % above', '0.4 % below', 'equal to')
    """
    if abs(share) < 5e-4:
        return "equal to"
    return f"{100 * abs(share):.1f} % {'above' if share > 0 else 'below'}"


def slices_seen(findings: Findings, target: Target) -> str:
    """What becomes of a response along the parameters."""
    promised = findings.calibration.compromise.predicted[target.key].mean
    reach, quantity = findings.reach_of(target), response(target.key)
    said = (
        f"Interpolated {key_words(target.key)} at the recommended set is"
        f" {amount(promised, quantity, 4)}, {beside((promised - target.value) / target.scale)} the"
        f" measured {amount(target.value, quantity, 4)}"
    )
    if reach is None:
        return f"{said}."
    span = f"{number(reach.low)} to {number(reach.high)}"
    return f"{said}; over the whole box it goes from {span}."


def front_seen(findings: Findings) -> str:
    """How the two objectives are traded for each other."""
    names = findings.space.case.search.objectives[:2]
    front = findings.traces.objectives[:, :2]
    symbols = [OBJECTIVES[name].symbol for name in names]
    chosen = [findings.calibration.compromise.objectives[name] for name in names]
    ends = [
        ", ".join(f"{s} = {number(v, 2)}" for s, v in zip(symbols, values, strict=True))
        for values in (front[0], front[-1], chosen)
    ]
    return (
        f"{len(front)} sets on the Pareto front, from {ends[0]} to {ends[1]}; the recommended set"
        f" has {ends[2]}."
    )


def parity_seen(findings: Findings) -> str:
    """How well the interpolant predicts what it has not seen."""
    rms = findings.calibration.leave_one_out_rms
    said = [
        f"{key_words(t.key)} within {100 * value / t.scale:.1f} %"
        for t in findings.space.case.problem.targets
        if (value := rms.get(t.key)) is not None
    ]
    return f"Sets that were left out are predicted (root mean square): {listed(said)}."


def likelihood_seen(findings: Findings) -> str:
    """What the targets say about each parameter."""
    said = [
        f"{words(p.name)} {p.interval(lambda end: number(end, 3))}"
        f" ({'pinned down' if p.pinned else 'not pinned down'})"
        for p in findings.calibration.identifiability.parameters
    ]
    return f"95 % intervals that the measurements accept: {listed(said)}."


def ridge_seen(findings: Findings) -> str:
    """Which two parameters make up for each other."""
    names, found = findings.space.case.problem.names, findings.calibration.identifiability
    ties = np.triu(np.abs(np.nan_to_num(found.correlation)), 1)
    i, j = np.unravel_index(int(np.argmax(ties)), ties.shape)
    kind = "make up for each other" if ties[i, j] >= RIDGE else "are tied most, and not strongly"
    value = number(float(found.correlation[i, j]), 2)
    return (
        f"Of the accepted sets, {words(names[i])} and {words(names[j])} {kind}: correlation"
        f" {value}."
    )


def sensitivity_seen(findings: Findings) -> str:
    """Which parameter moves which response most."""
    found = findings.calibration.sensitivity
    said = []
    for key, row in zip(found.responses, np.nan_to_num(found.total), strict=True):
        most = int(np.argmax(row))
        share = number(float(row[most]), 2)
        said.append(f"{key_words(key)} by {words(found.parameters[most])} ({share} of variance)")
    return f"Moved most, with interactions: {listed(said)}."


def distance_seen(curves: Sequence[np.ndarray]) -> str:
    """From which generation on the search has settled."""
    settled = [
        int(np.flatnonzero(np.append(curve, np.inf) > SETTLED * curve[0])[-2]) + 1
        for curve in curves
        if len(curve) and curve[0] > 0
    ]
    if not settled:
        return "The first generation of every search was its final front already."
    return (
        f"The distance to the final front stays below {100 * SETTLED:.0f} % of its first value"
        f" from generation {max(settled)} on in all {len(settled)} searches."
    )


def verification_seen(outcome: Mapping[str, Verdict]) -> str:
    """How far the fresh runs of the recommended set are from the measurements."""
    said = [
        f"simulated {key_words(row.key)} {beside(row.relative_error)} the measured"
        f" ({'met' if row.passed else 'not met'})"
        for row in outcome[COMPROMISE].responses
        if row.relative_error is not None
    ]
    return f"At the recommended set: {listed(said) or 'nothing was measured'}."


def curves_seen(runs: Mapping[str, Sequence[tuple[np.ndarray, np.ndarray]]], curve: Curve) -> str:
    """Between what values the curves of the runs lie."""
    found = [pair for own in runs.values() for pair in own if len(pair[0])]
    if not found:
        return "No run left this curve."
    across = curve.scales[0] * max(float(np.max(x)) for x, _ in found)
    low = curve.scales[1] * min(float(np.min(y)) for _, y in found)
    high = curve.scales[1] * max(float(np.max(y)) for _, y in found)
    x, y = curve.labels
    return (
        f"{y} of {len(found)} runs: from {number(low, 3)} to {number(high, 3)}, over {x} up to"
        f" {number(across, 3)}."
    )
