"""The verb `diagnose`: a gap, where it is, which effect explains it, and whether it goes away."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibrator.case.codec import finite
from calibrator.case.vocabulary import effect_of
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.basis import CONFIRMED, diagnosis_basis
from calibrator.diagnosis.confirm import Confirmation, confirm
from calibrator.diagnosis.gap import FEWEST_DEGREES, Location, ghost_shares, localise
from calibrator.diagnosis.limits import Fits
from calibrator.diagnosis.metrology import explaining_errors
from calibrator.diagnosis.new_case import write_new_case
from calibrator.diagnosis.outcome import (
    BoundedFit,
    Diagnosis,
    ErrorSize,
    ExplanationRun,
    FingerprintTable,
    Ghosts,
)
from calibrator.diagnosis.preflight import powers, rows_of
from calibrator.diagnosis.rule import Rule
from calibrator.diagnosis.runs import Scene, nuisances, prepare
from calibrator.diagnosis.sentence import sentence, too_few
from calibrator.diagnosis.verdict import (
    AMBIGUOUS,
    BEYOND,
    CANNOT_TELL,
    FIXED,
    MEASUREMENT,
    NAMED,
    NO_GAP,
    TWO_EFFECTS,
    UNKNOWN,
    Linear,
    Verdict,
    judge,
)
from calibrator.errors import CalibratorError
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
    verdict = judge(
        scene.surfaces,
        scene.measured,
        scene.effects,
        scene.used,
        rng,
        held=scene.held,
        uncertain=scene.uncertain,
    )
    if verdict.kind == CANNOT_TELL:  # some observables repeat others
        found = _untested(space, len(scene.used), scene.notes, scene.records)
        return space.note("diagnose", found)
    runs = confirm(space, scene, verdict, yes, report)
    verdict = replace(verdict, best=runs.best)
    found = _found(space, scene, verdict, runs, rng)
    if found.verdict == NAMED:
        found = _with_new_case(found, space, scene, verdict)
    said = replace(found, sentence=sentence(found))
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
    kind, names = confirmed(verdict, runs.explanations)
    return Diagnosis(
        verdict=kind,
        effects=names,
        notes=(*scene.notes, *_refutation(scene, verdict, runs.explanations), *runs.notes),
        fingerprint=diagnosis_basis(space.case, [*scene.records, *runs.records]),
        detection=verdict.detection,
        bounded=_bounded(space, verdict.fits),
        errors=_errors(space, scene, verdict),
        day_error=space.case.diagnosis.day_error,
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


def _bounded(space: Workspace, fits: Fits) -> BoundedFit:
    """The fit within the bounds and beyond, with parameters by name and in their units."""
    parameters = space.case.problem.parameters
    unit = fits.wider.unit if fits.wider is not None else np.full(len(parameters), 0.5)
    values = ex.point(space.case, unit)
    return BoundedFit(
        p=fits.p,
        p_wider=finite(fits.p_wider),
        at_bounds=tuple(
            f"{parameters[b.parameter].name} at its"
            f" {'upper' if b.upper else 'lower'} bound"
            f" {parameters[b.parameter].high if b.upper else parameters[b.parameter].low:g}"
            for b in fits.bounds
        ),
        beyond=tuple(
            f"{p.name} = {value:.3g} ({'above' if share > 1 else 'below'} its bounds {p.low:g} to"
            f" {p.high:g})"
            for p, share, value in zip(parameters, unit, values, strict=True)
            if not 0 <= share <= 1
        ),
    )


def _errors(space: Workspace, scene: Scene, verdict: Verdict) -> tuple[ErrorSize, ...]:
    """What each shared error of the measurement would have to be to explain the gap."""
    if verdict.kind == NO_GAP:
        return ()
    picture, shared = verdict.picture, scene.measured.only(scene.used).shared
    sizes = explaining_errors(picture.residual, shared, picture.project, scene.surfaces.degrees)
    return tuple(
        ErrorSize(
            name=one.name,
            unit=one.unit,
            stated=one.error,
            needed=finite(size.times * one.error),
            p=size.p,
        )
        for one, size in zip(nuisances(space.case), sizes, strict=True)
    )


def confirmed(
    verdict: Verdict, explanations: Sequence[ExplanationRun]
) -> tuple[str, tuple[str, ...]]:
    """Kind and effects of the verdict, once YADE has been asked.

    A name with which the gap does not shrink is none. Nor is one whose runs do not meet the
    measurements: the surfaces of a wrong effect can bend where no run has been made. Nor one all of
    whose runs of an experiment failed, which left it out of the explanations. On data held out,
    which may show no gap to begin with, it may grow by chance, but not far beyond the noise.
    """
    if verdict.kind not in (NAMED, TWO_EFFECTS):
        return verdict.kind, verdict.effects
    run = next((one for one in explanations[1:] if one.effects == verdict.effects), None)
    if run is None or _contradicted(explanations[0], run):
        return AMBIGUOUS, (*verdict.effects, UNKNOWN)
    return verdict.kind, verdict.effects


def _contradicted(before: ExplanationRun, run: ExplanationRun) -> str:
    """What fresh runs of an explanation say against it, "" if nothing.

    before : the fresh runs of the model as it is.
    """
    rule, held = Rule(), before.gap_held_out
    if run.fresh_probability < rule.adequacy:
        return f"do not meet the measurements (p = {run.fresh_probability:.2g})"
    if run.scatter_probability < rule.scatter:
        return (
            f"scatter more in {run.most_scattered} than replicates of the laboratory do (p ="
            f" {run.scatter_probability:.2g}), as where one heap stands and the next falls"
        )
    if run.gap_used >= before.gap_used:
        return "do not make the gap smaller"
    after = run.gap_held_out
    if (
        held is not None
        and after is not None
        and after > max(held, rule.grown * run.floor_held_out)
    ):
        return f"make the gap on data held out larger ({held:.1f} -> {after:.1f} standard errors)"
    return ""


def _refutation(
    scene: Scene, verdict: Verdict, explanations: Sequence[ExplanationRun]
) -> list[str]:
    """A sentence where the data held out, or fresh runs, took a name back."""
    others = (UNKNOWN, MEASUREMENT, BEYOND, FIXED)
    names = " and ".join(effect_of(n).called for n in verdict.effects if n not in others)
    if FIXED in verdict.effects and verdict.fixed is not None:
        (name,) = verdict.fixed.effects
        (one,) = (e for e in scene.uncertain if e.name == name)
        size = verdict.fixed.amplitude[len(scene.effects) + scene.uncertain.index(one)]
        return [
            f"{names} explains the gap, but so would a {name} of {ex.column_value(one, size):.2g}"
            f" where the case fixes {one.base:g}: not named; measure it"
        ]
    if BEYOND in verdict.effects:
        return [f"{names} explains the gap, but so would parameters beyond their bounds: not named"]
    if MEASUREMENT in verdict.effects:
        return [
            f"{names} explains the gap, but with shared errors of the measurement"
            f" {Rule().shared:g} times as large as stated there is none: not named"
        ]
    if verdict.best is None and not math.isnan(verdict.held_out):
        return [
            f"{names} explains the data used, but does not predict those held out (p ="
            f" {verdict.held_out:.2g}): not named"
        ]
    kept = confirmed(verdict, explanations) == (verdict.kind, verdict.effects)
    if verdict.best is None or kept:
        return []
    runs = [one for one in explanations[1:] if one.effects == verdict.effects]
    missed = _contradicted(explanations[0], runs[0]) if runs else "did not all come to an end"
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


def _with_new_case(found: Diagnosis, space: Workspace, scene: Scene, verdict: Verdict) -> Diagnosis:
    """The outcome with the case written that has the named effect among its parameters."""
    assert verdict.best is not None
    (name,) = verdict.effects
    index = [e.name for e in scene.effects].index(name)
    size, error = verdict.best.amplitude[index], verdict.best.amplitude_error[index]
    try:
        path = write_new_case(space, scene.effects[index], float(size), float(error))
    except CalibratorError as refusal:  # as where the effect was seen under conditions alone
        note = f"the case with {name}, in with_effect/, cannot be used as it is: {refusal}"
        return replace(found, notes=(*found.notes, note))
    return replace(found, new_case=str(path), following=space.command("run", path))
