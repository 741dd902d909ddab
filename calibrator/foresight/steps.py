"""Doubts about the time steps of a case."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calibrator.case.case import Case
from calibrator.case.physics import (
    LARGEST_SHARE,
    Columns,
    damped_steps,
    floored,
    rayleigh_time,
    time_step_warning,
)
from calibrator.foresight.values import Values
from calibrator.plan.requests import design_points


def step_doubts(case: Case, values: Mapping[str, Values]) -> list[str]:
    """What a time step does that is longer than the reference paper's, or than contacts bear.

    values : see `values.resolved`. A sentence for every set-up and condition whose own values
    change it, each once.
    """
    points = design_points(case)
    found = dict.fromkeys(_doubts(case.problem.columns(points)), "")
    for experiment in values:
        own = case.problem.values_of(experiment)
        numbers = {n: v for n, v in own.items() if not isinstance(v, str)}
        for doubt in _doubts({**case.problem.columns(points), **numbers}):
            found.setdefault(doubt, f"{experiment}: ")
    return [where + doubt for doubt, where in found.items()]


def _doubts(columns: Columns) -> list[str]:
    """The sentences for runs with these values."""
    fraction = float(np.max(columns["rayleigh_fraction"]))
    fixed_step = float(np.max(columns["time_step"]))
    crossing, damped = rayleigh_time(columns), damped_steps(columns)
    shortest = float(np.min(crossing))
    step = fixed_step or fraction * shortest
    share = damped / crossing
    worst = int(np.argmin(damped if fixed_step else share))
    restitution = float(np.broadcast_to(columns["restitution"], damped.shape)[worst])
    warnings = [w for w in [time_step_warning(step * (1 - 1e-9), columns)] if w]
    if fixed_step > damped[worst] * (1 + 1e-9):
        bound = floored(min(float(damped[worst]), LARGEST_SHARE * shortest))
        return [
            f"time_step = {fixed_step:.3g} s is unstable for a restitution of {restitution:g}:"
            f" lower it to {bound} s, or set time_step = 0 and let each run take its own"
        ]
    if not fixed_step and fraction > share[worst] * (1 + 1e-9):
        warnings = [
            f"rayleigh_fraction = {fraction:g} would be unstable for a restitution of"
            f" {restitution:g}: its runs take at most {floored(float(share[worst]))} of the"
            " Rayleigh time instead, which the forecast knows"
        ]
    taken = (
        np.full(crossing.shape, fixed_step)
        if fixed_step
        else np.minimum(fraction * crossing, damped)
    )
    coarse = (taken > 0.2 * crossing * (1 + 1e-9)) & (columns["restitution"] < 0.6)
    if np.any(coarse):
        warnings.append(
            "impacts with a restitution below 0.6 lose too much speed at a time step of"
            f" {np.max((taken / crossing)[coarse]):.0%} of the Rayleigh time: set rayleigh_fraction"
            " = 0.2 (or a smaller time_step) under [fixed]"
        )
    return warnings
