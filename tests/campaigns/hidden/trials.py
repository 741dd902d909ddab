"""One laboratory drawn from a pool, the verdict on it, and what simpler rules would have said."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import chi2

from calibrator.case.case import Case
from calibrator.case.lab import Observable
from calibrator.case.vocabulary import RESPONSES
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.explanations import Effect, Explanation, Measured
from calibrator.diagnosis.gap import Gap
from calibrator.diagnosis.interval import interval
from calibrator.diagnosis.rivals import Rivals, rivals
from calibrator.diagnosis.rule import Rule
from calibrator.diagnosis.surfaces import Surfaces
from calibrator.diagnosis.uncertain import WIDE, uncertain
from calibrator.diagnosis.verdict import Verdict, judge
from calibrator.plan.design import sobol
from calibrator.runs.database import Database
from tests.campaigns.hidden.errors import Errors, errors_of
from tests.campaigns.hidden.laboratory import (
    OUTSIDE,
    REPLICATES,
    read_off,
    small_effects,
)
from tests.campaigns.hidden.truths import Class, true_size


@dataclass(frozen=True)
class Trial:
    """What was hidden in which pool, what was said, and by how much the gap closed.

    size : amplitude of a single effect; amplitude, ends : what is found where one is named, with
    its standard error, and its 95 % interval.

    best_chi2, naive, bic : names by simpler rules: the effect of lowest chi2 after a refit, the
    same only where chi2 rejects the model at 5 %, and the one that lowers the Bayesian information
    criterion. The last goes by -2 log L, as chi2 alone favours effects with large errors.
    """

    label: str
    strength: str
    pool: int
    hidden: tuple[str, ...]
    size: float
    withheld: bool
    verdict: Verdict
    best_chi2: str
    naive: str
    bic: str
    amplitude: tuple[float, float] | None = None
    ends: tuple[float, float] | None = None
    gaps: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Judged:
    """A library with its surfaces: the whole one, or one from which an effect is withheld.

    uncertain : fixed values that may be wrong.
    """

    effects: list[Effect]
    uncertain: list[Effect]
    surfaces: Surfaces
    used: np.ndarray
    held: np.ndarray

    def verdict(
        self, measured: Measured, rng: np.random.Generator, rule: Rule | None = None
    ) -> Verdict:
        """What is said of measurements of all observables, before fresh runs."""
        return judge(
            self.surfaces,
            measured,
            self.effects,
            self.used,
            rng,
            rule,
            self.held,
            self.uncertain,
        )


def library(case: Case, database: Database, withheld: str = "") -> Judged:
    """Surfaces of the case's diagnosis from shipped runs."""
    effects = [e for e in ex.library(case) if e.name != withheld]
    found = ex.experiments(case, case.observables)
    points = sobol(case.problem, case.diagnosis.sets)
    plain = [database.find(own) for own in ex.plain_requests(case, found, points)]
    values = uncertain(case)
    changes = [
        database.find(own)
        for own in ex.change_requests(case, found, [*ex.library(case), *values], points)
    ]
    if withheld:
        changes = [[r for r in own if withheld not in r.request.parameters] for own in changes]
    surfaces = observed.surfaces(case, found, [*effects, *values], plain, changes)
    ordered = ex.in_order(case.observables, found)
    kept, _ = observed.distinct(ordered, surfaces)
    used = np.array([i for i in kept if ordered[i].role != "held_out"])
    held = np.array([i for i, o in enumerate(ordered) if o.role == "held_out"])
    return Judged(effects, values, surfaces, used, held)


def disjoint(
    pool: Sequence[np.ndarray], rng: np.random.Generator, replicates: int = REPLICATES
) -> list[list[np.ndarray]]:
    """Replicates of as many measurements as a pool (runs, n) has runs for, none used twice."""
    order = [rng.permutation(len(own)) for own in pool]
    return [
        [
            own[at[i * replicates : (i + 1) * replicates]]
            for own, at in zip(pool, order, strict=True)
        ]
        for i in range(min(map(len, pool)) // replicates)
    ]


def measurements(
    case: Case,
    runs: Sequence[np.ndarray],
    judged: Judged,
    rng: np.random.Generator,
    errors: Errors,
) -> Measured:
    """What is measured on runs (replicates, n) of every experiment, with errors of metrology."""
    return reports(case, runs, judged, rng, errors)[1]


def reports(
    case: Case,
    runs: Sequence[np.ndarray],
    judged: Judged,
    rng: np.random.Generator,
    errors: Errors,
) -> tuple[list[Observable], Measured]:
    """The rows that the laboratory writes down, and what they are taken for."""
    found = ex.experiments(case, case.observables)
    ordered = ex.in_order(case.observables, found)
    values = errors.of_days(np.hstack(runs), judged.surfaces.noise, rng)
    least = [-np.inf if (low := RESPONSES[o.response].low) is None else low for o in ordered]
    values = np.maximum(values, least)  # nobody reports a negative share
    draws = errors.drawn(case.nuisances, rng)
    changes, d = [*judged.effects, *judged.uncertain], judged.surfaces.dimensions
    slopes = judged.surfaces.jacobian(np.full(d, 0.5), np.zeros(len(changes)))[:, d:]
    names = [e.nuisance or e.name for e in changes]
    nuisances = [n for n in case.nuisances if not n.effect or n.effect in names]
    reported = read_off(ordered, values, nuisances, draws, min(errors.days, len(values)))
    small = small_effects(nuisances, draws)
    sizes = {n: v / changes[names.index(n)].scale for n, v in small.items()}
    sizes |= {n.observables: draws[n.name] / WIDE for n in nuisances if n.fixed}
    shift = sum((slopes[:, names.index(n)] * size for n, size in sizes.items()), 0.0)
    day_error, surfaces = case.diagnosis.day_error, judged.surfaces
    found_errors = observed.measured_at_fit(
        reported, nuisances, surfaces, changes, day_error, judged.used
    )
    return reported, replace(found_errors, values=found_errors.values + shift)


def trial(
    case: Case,
    one: Class,
    runs: Sequence[np.ndarray],
    judged: Judged,
    withheld: bool,
    rng: np.random.Generator,
) -> Trial:
    """Judge one laboratory, and what simpler rules would have said."""
    errors = errors_of(case.nuisances, one.index)
    everything = measurements(case, runs, judged, rng, errors)
    measured = everything.only(judged.used)
    verdict = judged.verdict(everything, rng)
    found = verdict.rivals or rivals(judged.surfaces, measured, judged.effects, judged.used)
    best = min(found.single, key=lambda fit: fit.chi2)
    rejected = chi2.sf(found.none.chi2, found.none.degrees) < 0.05
    hidden = tuple(n for n in one.truth["hidden"] if n not in OUTSIDE)
    amplitude, ends, gaps = None, None, {}
    if verdict.kind == "named":
        assert verdict.best is not None
        k = [e.name for e in judged.effects].index(verdict.effects[0])
        amplitude = (float(verdict.best.amplitude[k]), float(verdict.best.amplitude_error[k]))
        index = len(verdict.best.unit)
        ends = interval(judged.surfaces, measured, judged.effects, verdict.best, judged.used, index)
        gaps = closed(judged, everything, found.none, verdict.best, found.single, rng)
    return Trial(
        one.label,
        one.strength,
        one.index,
        hidden,
        true_size(case, one),
        withheld,
        verdict,
        best.effects[0],
        best.effects[0] if rejected else "none",
        by_bic(found, len(judged.used)),
        amplitude,
        ends,
        gaps,
    )


def by_bic(found: Rivals, observables: int) -> str:
    """The effect that lowers the Bayesian information criterion most, or "none"."""
    likeliest = min(found.single, key=lambda fit: fit.deviance)
    lower = likeliest.deviance + np.log(observables) < found.none.deviance
    return likeliest.effects[0] if lower else "none"


def closed(
    judged: Judged,
    measured: Measured,
    none: Explanation,
    best: Explanation,
    single: Sequence[Explanation],
    rng: np.random.Generator,
) -> dict[str, float]:
    """Closed share of the gap, used and held out, by the named effect, the next and a ghost."""
    rank = sorted(single, key=lambda fit: fit.chi2)
    runner_up = next(fit for fit in rank if fit.effects != best.effects)
    models, found = {"none": none, "best": best, "next": runner_up}, {}
    for what, index in (("used", judged.used), ("held_out", judged.held)):
        # the same for all, or a larger error would pass for a smaller gap
        error = standard_errors(judged, measured, none, index)
        z = {name: residuals(judged, measured, fit, index) / error for name, fit in models.items()}
        floor = (
            1.0
            if what == "held_out"
            else float(np.sqrt((len(index) - judged.surfaces.dimensions) / len(index)))
        )
        before = rms(z["none"])
        found[f"{what}_before"], found[f"{what}_after"] = before, rms(z["best"])
        found[f"{what}_closed"] = Gap(before, rms(z["best"]), floor).closed
        found[f"{what}_runner_up"] = Gap(before, rms(z["next"]), floor).closed
        ghost = np.mean(
            [Gap(before, rms(ghosted(z["none"], rng)), floor).closed for _ in range(20)]
        )
        found[f"{what}_ghost"] = float(ghost)
    return found


def residuals(
    judged: Judged, measured: Measured, fit: Explanation, index: np.ndarray
) -> np.ndarray:
    """Measurements at index minus what an explanation predicts."""
    return np.asarray((measured.values - judged.surfaces.mean(fit.unit, fit.amplitude)[0])[index])


def standard_errors(
    judged: Judged, measured: Measured, fit: Explanation, index: np.ndarray
) -> np.ndarray:
    """Errors of measurements and surfaces at index."""
    return np.asarray(
        np.sqrt(np.diag(measured.covariance + judged.surfaces.error(fit.unit, fit.amplitude)))[
            index
        ]
    )


def ghosted(z: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """What is left when a random direction is fitted to the residuals by the data themselves."""
    direction = rng.standard_normal(len(z))
    direction /= np.linalg.norm(direction)
    return np.asarray(z - (z @ direction) * direction)


def rms(z: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(z**2)))
