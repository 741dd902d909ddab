"""Parameter sets of the surfaces as laboratories with nothing hidden, each left out in turn.

The shipped runs without effects are real runs at 32 places of the box. Taken out of the surfaces,
those of one set are a laboratory that the surfaces know nothing of: the model itself, measured with
two replicates (one, where the other run of an experiment clogged), with errors of metrology of its
own. No run has to be made for it. It is milder than a pool, whose grains are stiffer, of several
sizes and stepped finer, and harsher where a set lies in the outer margin of the box, where the
surfaces are left without a neighbour.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calibrator.case.case import Case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.rivals import rivals
from calibrator.plan.design import sobol
from calibrator.runs.database import Database
from tests.campaigns.hidden.errors import errors_of
from tests.campaigns.hidden.intervals import exact, interval, laboratories_with, upper
from tests.campaigns.hidden.rates import is_alarm
from tests.campaigns.hidden.trials import Trial, by_bic, library, measurements

TRIALS = 1  # of a set
FIRST_SEED = 20_000  # of the metrology
INNER = (0.1, 0.9)  # shares of the ranges beyond which the margin begins


@dataclass(frozen=True)
class LeftOut:
    """A set as a laboratory.

    Its place (d,) in the box, its replicates, what was said in each trial, and by BIC.
    """

    index: int
    unit: tuple[float, ...]
    replicates: int
    said: tuple[str, ...]
    bic: tuple[str, ...]

    @property
    def inner(self) -> bool:
        """Whether it lies off the margin of the box."""
        return all(INNER[0] <= u <= INNER[1] for u in self.unit)


def without(database: Database, case: Case, index: int) -> tuple[Database, list[np.ndarray]]:
    """The database without a set, and what the set's runs say (replicates, n), by experiment.

    Its runs without effects go from both families, those that the residual rests on, which are the
    laboratory, and those of the fingerprints.
    """
    found = ex.experiments(case, case.observables)
    points, replicates = sobol(case.problem, case.diagnosis.sets), case.diagnosis.replicates
    runs = [
        own[index * replicates : (index + 1) * replicates]
        for own in ex.plain_requests(case, found, points)
    ]
    # the first runs of the fingerprints are those without effects
    beside = [own[index] for own in ex.change_requests(case, found, ex.library(case), points)]
    gone = {r.run_id for own in runs for r in own} | {r.run_id for r in beside}
    values = [observed.values_of(e, database.find(own)) for e, own in zip(found, runs, strict=True)]
    return Database(r for r in database.records.values() if r.run_id not in gone), values


def left_out(
    case: Case, database: Database, trials: int = TRIALS, sets: Iterable[int] | None = None
) -> list[LeftOut]:
    """Sets as laboratories, all unless some are given; one that lacks an experiment is none."""
    units = case.problem.shares_of(sobol(case.problem, case.diagnosis.sets))
    found = []
    for index in range(len(units)) if sets is None else sets:
        rest, values = without(database, case, index)
        replicates = min(map(len, values))
        if not replicates:
            continue
        runs = [own[:replicates] for own in values]
        judged, rng = library(case, rest), np.random.default_rng(FIRST_SEED + index)
        said, bic = [], []
        for _ in range(trials):
            errors = errors_of(case.nuisances, FIRST_SEED + index)
            measured = measurements(case, runs, judged, rng, errors)
            verdict = judged.verdict(measured, rng)
            said.append(verdict.said)
            own = measured.only(judged.used)
            fits = verdict.rivals or rivals(judged.surfaces, own, judged.effects, judged.used)
            bic.append(by_bic(fits, len(judged.used)))
        unit = tuple(map(float, units[index]))
        found.append(LeftOut(index, unit, replicates, tuple(said), tuple(bic)))
    return found


def said_of_left_out(sets: Sequence[LeftOut], pools: Sequence[Trial]) -> dict[str, Any]:
    """False alarms of sets left out, alone, off the margin, and with those of the pools."""
    every = _alarms([one.said for one in sets], "no gap")
    some, number = every["false_alarm_laboratories"]
    more, further = laboratories_with([is_alarm(t) for t in pools], [t.pool for t in pools], False)
    together = some + more, number + further
    return {
        **every,
        "laboratories_with_one_replicate": sum(one.replicates == 1 for one in sets),
        "inner_sets": _alarms([one.said for one in sets if one.inner], "no gap"),
        "bic": _alarms([one.bic for one in sets], "none"),
        "with_pools": {
            "false_alarm_laboratories": together,
            "false_alarm_interval_by_pool": exact(*together),
            "false_alarm_upper95": upper(*together),
        },
        "alarms": [vars(one) for one in sets if set(one.said) != {"no gap"}],
    }


def _alarms(said: Sequence[Sequence[str]], quiet: str) -> dict[str, Any]:
    """Alarms of laboratories by what was said in each trial, and the word for none."""
    hits = [word != quiet for own in said for word in own]
    where = [i for i, own in enumerate(said) for _ in own]
    some, number = laboratories_with(hits, where, whole=False)
    return {
        "laboratories": number,
        "trials": len(hits),
        "false_alarm_rate": sum(hits) / max(len(hits), 1),
        "false_alarm_interval": interval(hits, where),
        "false_alarm_laboratories": [some, number],
        "false_alarm_interval_by_pool": exact(some, number),
        "false_alarm_upper95": upper(some, number),
    }
