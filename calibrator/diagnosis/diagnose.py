"""The verb `diagnose`: is there a gap, where, which missing effect explains it, and does it go
away?
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from calibrator.case.vocabulary import effect_of
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.explanations import Explanation, tail
from calibrator.diagnosis.gap import FEWEST_DEGREES, Location, ghost_shares, localise
from calibrator.diagnosis.new_case import write_new_case
from calibrator.diagnosis.preflight import powers
from calibrator.diagnosis.runs import Scene, by_experiment, carried_out, finite, prepare
from calibrator.diagnosis.sentence import cannot_tell, sentence
from calibrator.diagnosis.verdict import Linear, Rule, Verdict, judge
from calibrator.errors import CalibratorError
from calibrator.plan.seeds import confirm_seed
from calibrator.runs.database import Database
from calibrator.runs.request import Request
from calibrator.runs.workspace import Report, Workspace, made_by, silent
from calibrator.threads import on_one_thread

SHORTLIST = 3  # explanations that are run on YADE beside the model as it is


@on_one_thread
def diagnose(space: Workspace, report: Report = silent, yes: bool = False) -> dict[str, Any]:
    """Find the gap, name the missing effect, run it on YADE, and say by how much the gap shrinks."""
    case = space.case
    used = [o for o in case.observables if o.role != "held_out"]
    if len(used) - len(case.problem.names) < FEWEST_DEGREES:
        return space.note("diagnose", cannot_tell(len(used), len(case.problem.names)))
    scene = prepare(space, case.observables, yes, report)
    rng = np.random.default_rng(case.diagnosis.seed)
    verdict = judge(scene.surfaces, scene.measured, scene.effects, scene.used, rng, held=scene.held)
    if verdict.kind == "cannot tell":  # some observables repeat others
        return space.note(
            "diagnose", cannot_tell(len(scene.used), len(case.problem.names), scene.notes)
        )
    picture = verdict.picture
    tried, runs, notes = _confirming(space, scene, _shortlist(verdict), yes, report)
    explanations = [_explanation(scene, one, own) for one, own in zip(tried, runs, strict=True)]
    kind, names = _confirmed(verdict, explanations)
    outcome = {
        "verdict": kind,
        "effects": list(names),
        "detection": dict(vars(verdict.detection)),
        "ghost_probability": finite(verdict.ghost),
        "held_out_probability": finite(verdict.held_out),
        "posterior": verdict.posterior,
        "adequacy": verdict.adequacy,
        "observables": _rows(scene, tried, runs),
        "locations": [vars(one) for one in _locations(scene, picture)],
        "explanations": explanations,
        "fingerprints": {
            "effects": [e.name for e in scene.effects],
            "shifts": _shifts(scene, picture),
            "confusability": [[float(c) for c in row] for row in picture.prints.confusability],
            "amplitudes": [finite(x) for x in picture.prints.amplitudes(picture.residual)],
            "likelihood_ratios": [
                float(x) for x in picture.prints.likelihood_ratios(picture.residual)
            ],
        },
        "ghosts": _ghosts(picture, rng),
        "powers": powers(scene.effects, picture),
        "notes": [*scene.notes, *_refutation(verdict, explanations), *notes],
    }
    outcome["sentence"] = sentence(outcome)
    outcome["new_case"] = str(write_new_case(space, scene, verdict)) if kind == "named" else ""
    return space.note("diagnose", outcome)


def _confirmed(
    verdict: Verdict, explanations: Sequence[dict[str, Any]]
) -> tuple[str, tuple[str, ...]]:
    """Kind and effects of the verdict, once YADE has been asked: a name with which the gap does not
    shrink is none.

    Nor is one whose runs do not meet the measurements: the surfaces of a wrong effect can bend
    where no run has been made. Nor one all of whose runs of an experiment failed, which left it out
    of the explanations. That the gap shrinks is asked on the data used only: those held out may
    show none to begin with, and then grow by chance.
    """
    if verdict.kind not in ("named", "two effects"):
        return verdict.kind, verdict.effects
    run = [one for one in explanations[1:] if one["effects"] == list(verdict.effects)]
    if (
        not run
        or run[0]["gap_used"] >= explanations[0]["gap_used"]
        or run[0]["fresh_probability"] < Rule().adequacy
    ):
        return "ambiguous", (*verdict.effects, "unknown")
    return verdict.kind, verdict.effects


def _refutation(verdict: Verdict, explanations: Sequence[dict[str, Any]]) -> list[str]:
    """A sentence where the data held out, or fresh runs, took a name back."""
    names = " and ".join(effect_of(n).called for n in verdict.effects if n != "unknown")
    if verdict.best is None and not math.isnan(verdict.held_out):
        return [
            f"{names} explains the data used, but does not predict those held out (p ="
            f" {verdict.held_out:.2g}): not named"
        ]
    if verdict.best is not None and _confirmed(verdict, explanations) != (
        verdict.kind,
        verdict.effects,
    ):
        p = [
            one["fresh_probability"]
            for one in explanations
            if one["effects"] == list(verdict.effects)
        ]
        missed = (
            f"do not meet the measurements (p = {p[0]:.2g})" if p else "did not all come to an end"
        )
        return [
            f"{names} explains the surfaces' view of the data, but its runs on YADE {missed}: not"
            " named"
        ]
    return []


def _locations(scene: Scene, picture: Linear) -> list[Location]:
    names = [scene.observables[i].experiment for i in scene.used]
    slopes = picture.slopes[:, : scene.surfaces.dimensions]
    return localise(picture.none.residual, picture.none.covariance, slopes, names)


def _shifts(scene: Scene, picture: Linear) -> list[list[float]]:
    """Change of each used observable by each effect of plausible size, in standard errors (n, k)."""
    errors = np.sqrt(np.diag(picture.none.covariance))
    return [
        [float(x) for x in row]
        for row in picture.slopes[:, scene.surfaces.dimensions :] / errors[:, None]
    ]


def _ghosts(picture: Linear, rng: np.random.Generator) -> dict[str, float]:
    """Share of chi2 that the best true effect and ghost libraries remove."""
    residual = picture.residual
    shares = ghost_shares(residual, picture.prints, rng)
    found = float(picture.prints.likelihood_ratios(residual).max(initial=0) / (residual @ residual))
    return {
        "effect": found,
        "ghost_median": float(np.median(shares)),
        "ghost_95": float(np.quantile(shares, 0.95)),
    }


def _shortlist(verdict: Verdict) -> list[Explanation]:
    """The model as it is, and the explanations worth running: the named ones first, then the most
    probable.
    """
    if verdict.rivals is None:
        return [verdict.picture.none]
    ranked = sorted(verdict.rivals.single, key=lambda one: one.log_evidence, reverse=True)
    best = [verdict.best] if verdict.best is not None else []
    others = [one for one in ranked if not best or one.effects != best[0].effects]
    return [verdict.picture.none, *best, *others][: 1 + SHORTLIST]


def _confirming(
    space: Workspace, scene: Scene, tried: Sequence[Explanation], yes: bool, report: Report
) -> tuple[list[Explanation], list[observed.Averages], list[str]]:
    """Fresh YADE runs at each explanation: mean responses (n,) and runs behind them; and sentences
    on runs left out.

    An effect all of whose runs of an experiment fail, as by clogging where the laboratory's grains
    flowed, is left out and said so. Raises CalibratorError where that happens to the model as it
    is, without which there is nothing to show.
    """
    requests = [_fresh(space, scene, one, index) for index, one in enumerate(tried)]
    records = carried_out(space, [r for one in requests for own in one for r in own], yes, report)
    Database(records.values()).write(
        space.folder() / "diagnosis_confirmed.csv", made_by(space, "diagnose")
    )
    found = [by_experiment(records, own) for own in requests]
    notes = [
        note
        for own in found
        for e, r in zip(scene.experiments, own, strict=True)
        for note in observed.left_out(e, r)
    ]
    kept, runs = [], []
    for index, (one, own) in enumerate(zip(tried, found, strict=True)):
        try:
            runs.append(observed.averages(scene.experiments, own))
            kept.append(one)
        except CalibratorError as error:
            if index == 0:
                raise
            notes.append(
                f"{' and '.join(one.effects)} could not be run at its best parameters: {error}"
            )
    return kept, runs, notes


def _fresh(space: Workspace, scene: Scene, one: Explanation, index: int) -> list[list[Request]]:
    """Runs with new seeds of every experiment, a list for each, at an explanation; index keeps
    several apart.
    """
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
    """Residuals (n,) of fresh runs over standard errors that are the same for all explanations:
    larger ones would pass for a smaller gap."""
    error = np.sqrt(np.diag(scene.measured.covariance) + np.diag(scene.surfaces.noise) / runs.count)
    return np.asarray((scene.measured.values - runs.mean) / error)


def _fresh_probability(scene: Scene, one: Explanation, runs: observed.Averages) -> float:
    """Probability that fresh runs at an explanation miss the measurements, used and held out, by as
    much as these.

    Errors are those of the measurements, the seeds of the fresh runs, which scatter more where a
    neck is about to clog or a heap may stand, and of the place in the box where the fit put them.
    """
    plain = np.sqrt(np.diag(scene.surfaces.noise))
    expected = np.sqrt(plain**2 + scene.surfaces.extra_scatter(one.amplitude))
    error = observed.pooled_scatter(runs.scatter, runs.count, expected) / np.sqrt(runs.count)
    noise = scene.surfaces.noise / np.outer(plain, plain) * np.outer(error, error)
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


def _rows(
    scene: Scene, tried: Sequence[Explanation], runs: Sequence[observed.Averages]
) -> list[dict[str, Any]]:
    z = [_standardised(scene, one) for one in runs]
    errors = np.sqrt(np.diag(scene.measured.covariance))
    used = set(scene.used.tolist())
    return [
        {
            "key": o.key,
            "experiment": o.experiment,
            "role": o.role,
            "used": i in used,
            "measured": float(scene.measured.values[i]),
            "error": float(errors[i]),
            "simulated": [float(own.mean[i]) for own in runs],
            "z": [float(own[i]) for own in z],
        }
        for i, o in enumerate(scene.observables)
    ]


def _explanation(scene: Scene, one: Explanation, runs: observed.Averages) -> dict[str, Any]:
    z = _standardised(scene, runs)
    free = len(one.unit) + len(one.effects)
    return {
        "effects": list(one.effects),
        "parameters_unit": [float(u) for u in one.unit],
        "amplitudes": {
            e.name: {"value": ex.column_value(e, a), "error": finite(s * abs(e.scale))}
            for e, a, s in zip(scene.effects, one.amplitude, one.amplitude_error, strict=True)
            if e.name in one.effects
        },
        "chi2": one.chi2,
        "deviance": one.deviance,
        "degrees": one.degrees,
        "adequacy": one.adequacy(scene.surfaces.degrees),
        "fresh_probability": _fresh_probability(scene, one, runs),
        "gap_used": _rms(z[scene.used]),
        "floor_used": math.sqrt(max(len(scene.used) - free, 1) / len(scene.used)),
        "gap_held_out": _rms(z[scene.held]),
        "floor_held_out": 1.0,
    }


def _rms(z: np.ndarray) -> float | None:
    return float(np.sqrt(np.mean(z**2))) if len(z) else None
