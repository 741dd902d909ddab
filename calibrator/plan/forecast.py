"""The verb `plan`: tables of the whole plan, and what it will cost."""

from __future__ import annotations

from collections.abc import Sequence

from calibrator.plan.outcome import Forecast, SetupForecast, rests_on
from calibrator.plan.requests import requests_by_experiment
from calibrator.runs.cost import core_seconds
from calibrator.runs.record import Record
from calibrator.runs.request import Request, write_table
from calibrator.runs.setups import particles, steps
from calibrator.runs.workspace import Workspace, work_left


def forecast(space: Workspace) -> Forecast:
    """Write the native yade-batch tables of the whole plan, and forecast its cost."""
    by_experiment = requests_by_experiment(space.case)
    requests = [request for own in by_experiment.values() for request in own]
    done = space.finished(requests)
    _, hours_left = work_left(space, requests)
    setups = {}
    for experiment, own in by_experiment.items():
        write_table(space.folder("plan") / f"{experiment}.table", own)
        setups[experiment] = _of_setup(own, done, space.case.run.particle_steps_per_second)
    outcome = Forecast(
        runs=len(requests),
        finished=len(done),
        core_hours=sum(s.core_hours for s in setups.values()),
        core_hours_left=hours_left,
        setups=setups,
        fingerprint=rests_on(space.case, done),
    )
    return space.note("plan", outcome)


def _of_setup(requests: Sequence[Request], done: Sequence[Record], rate: float) -> SetupForecast:
    """What the runs of one experiment will take; done : finished runs, whose times are known.

    rate : particle-steps a second and core.
    """
    seconds = core_seconds(requests, done, rate)
    return SetupForecast(
        runs=len(requests),
        particles=(min(map(particles, requests)), max(map(particles, requests))),
        steps=(min(map(steps, requests)), max(map(steps, requests))),
        core_seconds_per_run=(float(seconds.min()), float(seconds.max())),
        core_hours=float(seconds.sum() / 3600),
    )
