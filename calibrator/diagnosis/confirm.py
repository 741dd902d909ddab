"""Fresh YADE runs at the explanations of a gap: whether it goes away.

The surfaces of a wrong effect can bend where no run has been made, so that it explains what they
see of the data, and yet not the data. Runs at its best parameters, with new seeds, tell.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import stats

from calibrator.case.codec import finite
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.basis import CONFIRMED
from calibrator.diagnosis.explanations import Explanation, explain, tail
from calibrator.diagnosis.interval import interval
from calibrator.diagnosis.outcome import Amplitude, ExplanationRun, ObservableRow
from calibrator.diagnosis.runs import Scene, by_experiment, carried_out
from calibrator.diagnosis.verdict import Verdict
from calibrator.errors import CalibratorError
from calibrator.plan.seeds import confirm_seed
from calibrator.runs.database import Database
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.workspace import Report, Workspace, made_by

SHORTLIST = 3  # explanations that are run on YADE beside the model as it is
MOVED = 0.5  # of its standard error: from there on a fit with fresh runs is run once more

Ends = tuple[tuple[float, float], ...]  # of the amplitudes' intervals, in plausible sizes


@dataclass(frozen=True, eq=False)
class Confirmation:
    """Explanations that could be run, the model as it is first.

    Attributes
    ----------
    explanations : each of them, with what its runs say.
    best : the named one, fitted once more with what its runs say; None where none is named.
    rows : all n observables with their fresh runs.
    notes : sentences on runs and explanations left out.
    records : the finished runs.
    """

    explanations: tuple[ExplanationRun, ...]
    best: Explanation | None
    rows: tuple[ObservableRow, ...]
    notes: tuple[str, ...]
    records: tuple[Record, ...]


def confirm(
    space: Workspace, scene: Scene, verdict: Verdict, yes: bool, report: Report
) -> Confirmation:
    """Run the explanations worth it on YADE, with new seeds.

    An effect all of whose runs of an experiment fail, as by clogging where the laboratory's grains
    flowed, is left out and said so. What is named is fitted once more with what its runs say, and
    run again where that moves it: its size by the surfaces alone may be one at which heaps stand
    that were to fall. Raises CalibratorError where all runs of the model as it is fail, without
    which there is nothing to show, and where the runs are beyond the budget unless `yes`.
    """
    tried, best = _shortlist(verdict), verdict.best
    made = _Runs(space, scene, yes, report)
    first = made.of(tried, 0)
    pairs = [(one, own) for one, own in zip(tried, first, strict=True) if own is not None]
    index, ends = next((i for i, (one, _) in enumerate(pairs) if one is best), None), None
    if best is not None and index is not None:
        refit, own = _refitted(scene, best, pairs[index][1])
        if _has_moved(best, refit):
            made.notes.append(_moved_to(scene, best, refit))
            (again,) = made.of([refit], len(tried))
            if again is not None:
                best, ends, pairs[index] = refit, own, (refit, again)
        else:
            best, ends = refit, own
            pairs[index] = (refit, pairs[index][1])
    return Confirmation(
        tuple(_explanation(scene, one, own, ends if one is best else None) for one, own in pairs),
        best,
        _rows(scene, [own for _, own in pairs]),
        tuple(made.notes),
        tuple(made.records.values()),
    )


@dataclass(eq=False)
class _Runs:
    """Fresh runs of explanations, carried out and kept as they are asked for."""

    space: Workspace
    scene: Scene
    yes: bool
    report: Report
    records: dict[str, Record] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def of(self, tried: Sequence[Explanation], first: int) -> list[observed.Averages | None]:
        """What their runs say, None where all runs of an experiment failed, which is noted.

        first : index of the first of them among all, which keeps seeds apart. Raises
        CalibratorError where they are those of the model as it is.
        """
        space, found = self.space, self.scene.experiments
        requests = [_fresh(space, self.scene, one, first + i) for i, one in enumerate(tried)]
        asked = [r for one in requests for own in one for r in own]
        self.records |= carried_out(space, asked, self.yes, self.report)
        Database(self.records.values()).write(
            space.folder() / CONFIRMED, made_by(space, "diagnose")
        )
        said: list[observed.Averages | None] = []
        for one, own in zip(tried, requests, strict=True):
            runs = by_experiment(self.records, own)
            for e, r in zip(found, runs, strict=True):
                self.notes += observed.left_out(e, r)
            try:
                said.append(observed.averages(found, runs))
            except CalibratorError as error:
                if not one.effects:
                    raise
                said.append(None)
                names = " and ".join(one.effects)
                self.notes.append(f"{names} could not be run at its best parameters: {error}")
        return said


def _refitted(scene: Scene, best: Explanation, runs: observed.Averages) -> tuple[Explanation, Ends]:
    """What is named, with the size and the place that surfaces corrected by its fresh runs give.

    How well it fits, beside the others, stays what the surfaces say of all of them. Returns the
    ends of its amplitudes' 95 % intervals as well.
    """
    noise = scene.surfaces.noise_at(best.unit) / np.sqrt(np.outer(runs.count, runs.count))
    noise = noise + np.diag(scene.surfaces.extra_scatter(best.amplitude) / runs.count)
    corrected = scene.surfaces.corrected(best.unit, best.amplitude, runs.mean, noise)
    added = tuple(i for i, e in enumerate(scene.effects) if e.name in best.effects)
    measured = scene.measured.only(scene.used)
    found = explain(corrected, measured, scene.effects, added, scene.used)
    ends = tuple(
        interval(corrected, measured, scene.effects, found, scene.used, len(best.unit) + i)
        for i in range(len(added))
    )
    refit = replace(
        best,
        unit=found.unit,
        amplitude=found.amplitude,
        amplitude_error=found.amplitude_error,
        spread=found.spread,
    )
    return refit, ends


def _has_moved(before: Explanation, after: Explanation) -> bool:
    """Whether a fit is away from another by more than MOVED of its errors."""
    added = ~np.isnan(after.amplitude_error)
    step = np.concatenate([after.unit - before.unit, (after.amplitude - before.amplitude)[added]])
    return bool((np.abs(step) > MOVED * np.sqrt(np.diag(after.spread))).any())


def _moved_to(scene: Scene, before: Explanation, after: Explanation) -> str:
    """A sentence on the sizes of what was fitted once more."""
    sizes = [
        f"{e.name} = {ex.column_value(e, b):.3g} -> {ex.column_value(e, a):.3g}"
        for e, b, a in zip(scene.effects, before.amplitude, after.amplitude, strict=True)
        if e.name in after.effects
    ]
    return f"fitted once more with its fresh runs, and run again: {', '.join(sizes)}"


def _shortlist(verdict: Verdict) -> list[Explanation]:
    """The model as it is, and the explanations worth running.

    The named ones come first, then the most probable.
    """
    if verdict.rivals is None:
        return [verdict.picture.none]
    ranked = sorted(verdict.rivals.single, key=lambda one: one.log_evidence, reverse=True)
    best = [verdict.best] if verdict.best is not None else []
    others = [one for one in ranked if not best or one.effects != best[0].effects]
    return [verdict.picture.none, *best, *others][: 1 + SHORTLIST]


def _fresh(space: Workspace, scene: Scene, one: Explanation, index: int) -> list[list[Request]]:
    """Runs of an explanation with new seeds, a list per experiment; index keeps several apart."""
    case, at = space.case, ex.point(space.case, one.unit)
    sizes = zip(scene.effects, one.amplitude, strict=True)
    added = {
        effect.name: ex.column_value(effect, size)
        for effect, size in sizes
        if effect.name in one.effects
    }
    return [
        [
            ex.request(case, e, at, confirm_seed(case, i, index, j), added)
            for j in range(case.diagnosis.verify_replicates)
        ]
        for i, e in enumerate(scene.experiments)
    ]


def _standardised(scene: Scene, runs: observed.Averages) -> np.ndarray:
    """Residuals (n,) of fresh runs over standard errors that are the same for all explanations.

    Larger errors of one explanation would pass for a smaller gap.
    """
    error = np.sqrt(np.diag(scene.measured.covariance) + np.diag(scene.surfaces.noise) / runs.count)
    return np.asarray((scene.measured.values - runs.mean) / error)


def _fresh_probability(scene: Scene, one: Explanation, runs: observed.Averages) -> float:
    """Probability that fresh runs miss the measurements, used and held out, by as much as these.

    Errors are those of the measurements, the seeds of the fresh runs, and of the place in the box
    where the fit put them. Fresh runs that scatter more than the laboratory's replicates and runs
    without effects do are no better for it: their scatter is taken to be the laboratory's.
    """
    seed_noise = scene.surfaces.noise_at(one.unit)
    plain = np.sqrt(np.diag(seed_noise))
    usual = np.maximum(plain, _laboratory_scatter(scene))
    error = np.minimum(observed.pooled_scatter(runs.scatter, runs.count, plain), usual)
    error = error / np.sqrt(runs.count)
    noise = seed_noise / np.outer(plain, plain) * np.outer(error, error)
    added = [len(one.unit) + i for i, e in enumerate(scene.effects) if e.name in one.effects]
    slopes = scene.surfaces.jacobian(one.unit, one.amplitude)[:, [*range(len(one.unit)), *added]]
    index = np.concatenate([scene.used, scene.held])
    covariance = (scene.measured.covariance + noise + slopes @ one.spread @ slopes.T)[
        np.ix_(index, index)
    ]
    residual = (scene.measured.values - runs.mean)[index]
    return tail(
        float(residual @ np.linalg.solve(covariance, residual)), len(index), scene.surfaces.degrees
    )


def _laboratory_scatter(scene: Scene) -> np.ndarray:
    """Scatter (n,) of one replicate in the laboratory; 0 where it is not known."""
    return np.array([o.scatter for o in scene.observables])


def _unsteady(scene: Scene, one: Explanation, runs: observed.Averages) -> tuple[str, float]:
    """The observable whose fresh runs scatter too much for the laboratory, and how probably so.

    Where one heap stands and the next falls, runs differ by far more than replicates do. Variances
    are compared by Fisher's F, that of the laboratory pooled with that of runs without effects, and
    the probability allows for looking at all observables (Bonferroni).
    """
    own, plain = _laboratory_scatter(scene), np.sqrt(np.diag(scene.surfaces.noise_at(one.unit)))
    replicates = np.array([o.replicates for o in scene.observables])
    usual = observed.pooled_scatter(own, replicates, plain)
    degrees = np.where(own > 0, replicates - 1, 0) + observed.PRIOR_DEGREES
    p = stats.f.sf((runs.scatter / usual) ** 2, np.maximum(runs.count - 1, 1), degrees)
    worst = int(np.argmin(p))
    return scene.observables[worst].key, float(min(1.0, p[worst] * len(p)))


def _rows(scene: Scene, runs: Sequence[observed.Averages]) -> tuple[ObservableRow, ...]:
    z = [_standardised(scene, one) for one in runs]
    errors = np.sqrt(np.diag(scene.measured.covariance))
    used = set(scene.used.tolist())
    return tuple(
        ObservableRow(
            key=o.key,
            experiment=o.experiment,
            role=o.role,
            used=i in used,
            measured=float(scene.measured.values[i]),
            error=float(errors[i]),
            simulated=tuple(float(own.mean[i]) for own in runs),
            z=tuple(float(own[i]) for own in z),
        )
        for i, o in enumerate(scene.observables)
    )


def _explanation(
    scene: Scene, one: Explanation, runs: observed.Averages, ends: Ends | None
) -> ExplanationRun:
    """What is noted of it; ends : of the 95 % intervals of its amplitudes, where there are any."""
    z = _standardised(scene, runs)
    free, used = len(one.unit) + len(one.effects), z[scene.used]
    unsteady, p_scatter = _unsteady(scene, one, runs)
    return ExplanationRun(
        effects=one.effects,
        parameters_unit=tuple(float(u) for u in one.unit),
        amplitudes=_amplitudes(scene, one, ends),
        chi2=one.chi2,
        deviance=one.deviance,
        degrees=one.degrees,
        adequacy=one.adequacy(scene.surfaces.degrees),
        fresh_probability=_fresh_probability(scene, one, runs),
        most_scattered=unsteady,
        scatter_probability=p_scatter,
        gap_used=_rms(used),
        floor_used=math.sqrt(max(len(used) - free, 1) / len(used)),
        gap_held_out=_rms(z[scene.held]) if len(scene.held) else None,
        floor_held_out=1.0,
    )


def _amplitudes(scene: Scene, one: Explanation, ends: Ends | None) -> dict[str, Amplitude]:
    """Its amplitudes by column, in the columns' units."""
    added = [i for i, e in enumerate(scene.effects) if e.name in one.effects]
    found = {}
    for j, i in enumerate(added):
        effect = scene.effects[i]
        low, high = sorted(ex.column_value(effect, end) for end in ends[j]) if ends else (None,) * 2
        value = ex.column_value(effect, one.amplitude[i])
        error = finite(one.amplitude_error[i] * abs(effect.scale))
        found[effect.name] = Amplitude(value, error, low, high)
    return found


def _rms(z: np.ndarray) -> float:
    return float(np.sqrt(np.mean(z**2)))
