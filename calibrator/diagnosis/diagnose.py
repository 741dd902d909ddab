"""The verb `diagnose`: a gap, where it is, which effect explains it, and whether it goes away."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from calibrator.case.codec import finite
from calibrator.case.vocabulary import effect_of
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.basis import CONFIRMED, diagnosis_basis
from calibrator.diagnosis.confirm import Confirmation, confirm
from calibrator.diagnosis.gap import FEWEST_DEGREES, Location, ghost_shares, localise
from calibrator.diagnosis.new_case import write_new_case
from calibrator.diagnosis.outcome import Diagnosis, ExplanationRun, FingerprintTable, Ghosts
from calibrator.diagnosis.preflight import powers, rows_of
from calibrator.diagnosis.runs import Scene, prepare
from calibrator.diagnosis.sentence import sentence, too_few
from calibrator.diagnosis.verdict import (
    AMBIGUOUS,
    CANNOT_TELL,
    NAMED,
    TWO_EFFECTS,
    UNKNOWN,
    Linear,
    Rule,
    Verdict,
    judge,
)
from calibrator.runs.record import Record
from calibrator.runs.workspace import Report, Workspace, silent
from calibrator.threads import on_one_thread


@on_one_thread
def diagnose(space: Workspace, report: Report = silent, yes: bool = False) -> Diagnosis:
    """Find the gap, name the missing effect, run it on YADE, and say by how much the gap shrinks.

    Raises CalibratorError where the runs are too few, beyond the budget unless `yes`, or fail for
    the model as it is.
    """
    case = space.case
    degrees, parameters = ex.degrees_left(case), len(case.problem.names)
    if degrees < FEWEST_DEGREES:
        return space.note("diagnose", _untested(space, degrees + parameters, (), ()))
    scene = prepare(space, case.observables, yes, report)
    rng = np.random.default_rng(case.diagnosis.seed)
    verdict = judge(scene.surfaces, scene.measured, scene.effects, scene.used, rng, held=scene.held)
    if verdict.kind == CANNOT_TELL:  # some observables repeat others
        found = _untested(space, len(scene.used), scene.notes, scene.records)
        return space.note("diagnose", found)
    runs = confirm(space, scene, verdict, yes, report)
    found = _found(space, scene, verdict, runs, rng)
    new_case = _new_case(space, scene, verdict) if found.verdict == NAMED else ""
    following = space.command("run", Path(new_case)) if new_case else ""
    said = replace(found, sentence=sentence(found), new_case=new_case, following=following)
    return space.note("diagnose", said)


def _untested(
    space: Workspace, used: int, notes: Sequence[str], records: Sequence[Record]
) -> Diagnosis:
    """The outcome where too few observables are used for a test."""
    # an earlier diagnosis' runs are none of this one's
    (space.folder() / CONFIRMED).unlink(missing_ok=True)
    return Diagnosis(
        verdict=CANNOT_TELL,
        effects=(),
        sentence=too_few(used, len(space.case.problem.names)),
        notes=tuple(notes),
        fingerprint=diagnosis_basis(space.case, records),
    )


def _found(
    space: Workspace,
    scene: Scene,
    verdict: Verdict,
    runs: Confirmation,
    rng: np.random.Generator,
) -> Diagnosis:
    """The outcome of a tested gap, but for its sentence and the new case."""
    picture = verdict.picture
    kind, names = _confirmed(verdict, runs.explanations)
    return Diagnosis(
        verdict=kind,
        effects=names,
        notes=(*scene.notes, *_refutation(verdict, runs.explanations), *runs.notes),
        fingerprint=diagnosis_basis(space.case, [*scene.records, *runs.records]),
        detection=verdict.detection,
        ghost_probability=finite(verdict.ghost),
        held_out_probability=finite(verdict.held_out),
        posterior=verdict.posterior,
        adequacy=verdict.adequacy,
        observables=runs.rows,
        locations=_locations(scene, picture),
        explanations=runs.explanations,
        fingerprints=_fingerprints(scene, picture),
        ghosts=_ghosts(picture, rng),
        powers=powers(scene.effects, picture, scene.surfaces, scene.used),
    )


def _confirmed(
    verdict: Verdict, explanations: Sequence[ExplanationRun]
) -> tuple[str, tuple[str, ...]]:
    """Kind and effects of the verdict, once YADE has been asked.

    A name with which the gap does not shrink is none. Nor is one whose runs do not meet the
    measurements: the surfaces of a wrong effect can bend where no run has been made. Nor one all of
    whose runs of an experiment failed, which left it out of the explanations. That the gap shrinks
    is asked on the data used only: those held out may show none to begin with, and then grow by
    chance.
    """
    if verdict.kind not in (NAMED, TWO_EFFECTS):
        return verdict.kind, verdict.effects
    before, *others = explanations
    run = next((one for one in others if one.effects == verdict.effects), None)
    if run is None or run.gap_used >= before.gap_used or run.fresh_probability < Rule().adequacy:
        return AMBIGUOUS, (*verdict.effects, UNKNOWN)
    return verdict.kind, verdict.effects


def _refutation(verdict: Verdict, explanations: Sequence[ExplanationRun]) -> list[str]:
    """A sentence where the data held out, or fresh runs, took a name back."""
    names = " and ".join(effect_of(n).called for n in verdict.effects if n != UNKNOWN)
    if verdict.best is None and not math.isnan(verdict.held_out):
        return [
            f"{names} explains the data used, but does not predict those held out (p ="
            f" {verdict.held_out:.2g}): not named"
        ]
    kept = _confirmed(verdict, explanations) == (verdict.kind, verdict.effects)
    if verdict.best is None or kept:
        return []
    p = [one.fresh_probability for one in explanations if one.effects == verdict.effects]
    missed = f"do not meet the measurements (p = {p[0]:.2g})" if p else "did not all come to an end"
    return [
        f"{names} explains the surfaces' view of the data, but its runs on YADE {missed}: not named"
    ]


def _locations(scene: Scene, picture: Linear) -> tuple[Location, ...]:
    names = [scene.observables[i].experiment for i in scene.used]
    slopes = picture.slopes[:, : scene.surfaces.dimensions]
    return tuple(localise(picture.none.residual, picture.none.covariance, slopes, names))


def _fingerprints(scene: Scene, picture: Linear) -> FingerprintTable:
    errors = np.sqrt(np.diag(picture.none.covariance))
    shifts = picture.slopes[:, scene.surfaces.dimensions :] / errors[:, None]
    prints, residual = picture.prints, picture.residual
    return FingerprintTable(
        effects=prints.names,
        shifts=rows_of(shifts),
        confusability=rows_of(prints.confusability),
        amplitudes=tuple(finite(x) for x in prints.amplitudes(residual)),
        likelihood_ratios=tuple(float(x) for x in prints.likelihood_ratios(residual)),
    )


def _ghosts(picture: Linear, rng: np.random.Generator) -> Ghosts:
    residual = picture.residual
    shares = ghost_shares(residual, picture.prints, rng)
    found = float(picture.prints.likelihood_ratios(residual).max(initial=0) / (residual @ residual))
    return Ghosts(
        effect=found,
        ghost_median=float(np.median(shares)),
        ghost_95=float(np.quantile(shares, 0.95)),
    )


def _new_case(space: Workspace, scene: Scene, verdict: Verdict) -> str:
    """Write the case with the named effect among its parameters; returns its path."""
    if verdict.best is None:
        return ""
    (name,) = verdict.effects
    index = [e.name for e in scene.effects].index(name)
    size, error = verdict.best.amplitude[index], verdict.best.amplitude_error[index]
    return str(write_new_case(space, scene.effects[index], float(size), float(error)))
