"""One verdict on a gap: what the evidence allows to say, and nothing more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calibrator.diagnosis.explanations import (
    LIKELY,
    Effect,
    Explanation,
    Measured,
    explain,
    tail,
)
from calibrator.diagnosis.gap import (
    FEWEST_DEGREES,
    Detection,
    Fingerprints,
    Projection,
    detect,
    fingerprints,
    ghost_probability,
    projection,
)
from calibrator.diagnosis.limits import Fits, fits
from calibrator.diagnosis.rivals import Rivals, otherwise, pairs, rivals
from calibrator.diagnosis.rule import Rule
from calibrator.diagnosis.surfaces import Surfaces

CANNOT_TELL, NO_GAP, AMBIGUOUS = "cannot tell", "no gap", "ambiguous"
OUT_OF_BOUNDS = "out of bounds"
NAMED, TWO_EFFECTS = "named", "two effects"
# explanations that take a name back
MEASUREMENT, BEYOND = "error of measurement", "parameters beyond their bounds"
FIXED = "a fixed value"
UNKNOWN = "unknown"  # the verdict, and the explanation that nobody has thought of
NONE = "none"  # the explanation without any effect


@dataclass(frozen=True, eq=False)
class Linear:
    """The linear picture at the best fit of the model as it is: for detection, ghosts and figures.

    slopes (n, d + k) : derivatives of the observables by parameters, per range, and by amplitudes,
    per plausible size.
    """

    none: Explanation
    slopes: np.ndarray
    project: Projection
    residual: np.ndarray
    prints: Fingerprints


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is printed, and what it rests on.

    kind : "no gap", "out of bounds", "named", "ambiguous", "two effects", "unknown" or "cannot
    tell"; effects : the name, the pair, or the set that cannot be told apart; fits : the model as
    it is, within its bounds and beyond; best : the fit of the named effect or pair, None otherwise;
    held_out : probability of the data held out under what would be named, nan where nothing would
    be or there are none; fixed : the likeliest fit with a fixed value free instead, where something
    would be named and a value is uncertain.
    """

    kind: str
    effects: tuple[str, ...]
    picture: Linear
    detection: Detection
    fits: Fits
    rivals: Rivals | None = None
    best: Explanation | None = None
    ghost: float = float("nan")
    held_out: float = float("nan")
    fixed: Explanation | None = None
    posterior: dict[str, float] = field(default_factory=dict)
    adequacy: dict[str, float] = field(default_factory=dict)

    @property
    def said(self) -> str:
        """The name where there is one, else the kind."""
        return self.effects[0] if self.kind == NAMED else self.kind


def linear(
    surfaces: Surfaces, measured: Measured, effects: Sequence[Effect], kept: np.ndarray
) -> Linear:
    """Fit the model without effects, and project its residual and all fingerprints."""
    none = explain(surfaces, measured, effects, kept=kept)
    d = surfaces.dimensions
    slopes = surfaces.jacobian(none.unit, np.zeros(len(effects)))[kept]
    project = projection(none.covariance, slopes[:, :d])
    names, signs = tuple(e.name for e in effects), tuple(e.sign for e in effects)
    return Linear(
        none,
        slopes,
        project,
        project(none.residual),
        fingerprints(names, signs, slopes[:, d:], project),
    )


def judge(
    surfaces: Surfaces,
    everything: Measured,
    effects: Sequence[Effect],
    used: np.ndarray,
    rng: np.random.Generator,
    rule: Rule | None = None,
    held: Sequence[int] | np.ndarray = (),
    uncertain: Sequence[Effect] = (),
) -> Verdict:
    """Detect a gap and identify what explains it.

    everything : measurements of all observables of the surfaces; used, held : indices of those that
    the diagnosis is made from and of those held out, which can only take a name back; uncertain :
    fixed values that the surfaces know changes of, after the effects, which can do that as well.
    """
    rule, measured = rule or Rule(), everything.only(used)
    picture = linear(surfaces, measured, effects, used)
    detection = detect(picture.residual, picture.prints, surfaces.degrees, rng)
    box = fits(surfaces, measured, effects, picture.none, used)
    if picture.project.degrees < FEWEST_DEGREES:
        return Verdict(CANNOT_TELL, (), picture, detection, box)
    if not _is_gap(detection, rule):
        outside = bool(box.bounds) and box.p < rule.p_chi2
        return Verdict(OUT_OF_BOUNDS if outside else NO_GAP, (), picture, detection, box)
    found = rivals(surfaces, measured, effects, used)
    if _beats(box.wider, surfaces, rule, min((f.deviance for f in found.single), default=np.inf)):
        return Verdict(OUT_OF_BOUNDS, (), picture, detection, box)
    ghost = ghost_probability(picture.residual, picture.prints, rng)
    evidence = _Evidence(surfaces, measured, effects, used, rule, found, ghost)
    kind, names, best = _explained(evidence)
    p, fixed = float("nan"), None
    if best is not None:
        p = withstands(surfaces, everything, effects, best, used, held)
        fixed = otherwise(surfaces, measured, effects, uncertain, used)
        if rival := _remaining_rival(evidence, [box.wider, fixed], best, p, picture, rng):
            kind, names, best = AMBIGUOUS, (*names, rival), None
    weights, adequacy = evidence.weights, evidence.adequacy
    return Verdict(
        kind, names, picture, detection, box, found, best, ghost, p, fixed, weights, adequacy
    )


def _is_gap(found: Detection, rule: Rule) -> bool:
    return found.p_effect < rule.p_effect or found.p_chi2 < rule.p_chi2


def _beats(one: Explanation | None, surfaces: Surfaces, rule: Rule, deviance: float) -> bool:
    """Whether an explanation, if any, is adequate, and of no higher deviance than this."""
    if one is None or one.adequacy(surfaces.degrees) < rule.adequacy:
        return False
    return one.deviance <= deviance


def _outlasts_larger_errors(
    surfaces: Surfaces, measured: Measured, picture: Linear, rule: Rule, rng: np.random.Generator
) -> bool:
    """Whether there is a gap still where shared errors are as much larger as the rule says."""
    more = (rule.shared**2 - LIKELY) * measured.shared @ measured.shared.T
    covariance, d = picture.none.covariance + more, surfaces.dimensions
    project = projection(covariance, picture.slopes[:, :d])
    prints = fingerprints(
        picture.prints.names, picture.prints.signs, picture.slopes[:, d:], project
    )
    found = detect(project(picture.none.residual), prints, surfaces.degrees, rng)
    return _is_gap(found, rule)


@dataclass(frozen=True, eq=False)
class _Evidence:
    """What a gap's explanation is judged by, all that is held out apart."""

    surfaces: Surfaces
    measured: Measured
    effects: Sequence[Effect]
    used: np.ndarray
    rule: Rule
    rivals: Rivals
    ghost: float

    @property
    def weights(self) -> dict[str, float]:
        """Posterior probability of each explanation by its name."""
        names = [NONE, *(e.name for e in self.effects), UNKNOWN]
        return dict(zip(names, map(float, self.rivals.posterior), strict=True))

    @property
    def adequacy(self) -> dict[str, float]:
        """Probability of each single effect's fit by its name."""
        return {f.effects[0]: f.adequacy(self.surfaces.degrees) for f in self.rivals.single}

    @property
    def adequate(self) -> list[Explanation]:
        """Single effects that fit."""
        fits = zip(self.rivals.single, self.adequacy.values(), strict=True)
        return [one for one, p in fits if p >= self.rule.adequacy]


def _remaining_rival(
    evidence: _Evidence,
    others: Sequence[Explanation | None],
    best: Explanation,
    held_out: float,
    picture: Linear,
    rng: np.random.Generator,
) -> str:
    """What else than the effects of the library may explain what a name does, "" if nothing.

    others : the fits with wider bounds and with a fixed value free, where there are such; held_out
    : probability of the data held out under the name, nan where there are none.
    """
    rule = evidence.rule
    if held_out < rule.held_out:
        return UNKNOWN
    for one, rival in zip(others, (BEYOND, FIXED), strict=True):
        if _beats(one, evidence.surfaces, rule, best.deviance + rule.lead):
            return rival
    outlasts = _outlasts_larger_errors(evidence.surfaces, evidence.measured, picture, rule, rng)
    return "" if outlasts else MEASUREMENT


def _explained(evidence: _Evidence) -> tuple[str, tuple[str, ...], Explanation | None]:
    """Kind and effects of the verdict on a gap, and the fit of the named ones."""
    if not (adequate := evidence.adequate):
        two = _pair(evidence)
        return (UNKNOWN, (), None) if two is None else (TWO_EFFECTS, two.effects, two)
    best = max(adequate, key=lambda one: one.log_evidence)
    (control,) = (e.control for e in evidence.effects if e.name in best.effects)
    if not control and _nameable(best, evidence):
        if not _wants_a_second(best, evidence):
            return NAMED, best.effects, best
        return AMBIGUOUS, (*best.effects, UNKNOWN), None
    names = _credible_set(evidence.weights, evidence.rule.coverage)
    if names == (UNKNOWN,):
        return UNKNOWN, (), None
    if len(names) == 1:  # probable, but not clear of chance or of a rival
        names = (*names, UNKNOWN)
    return AMBIGUOUS, names, None


def withstands(
    surfaces: Surfaces,
    everything: Measured,
    effects: Sequence[Effect],
    explanation: Explanation,
    used: np.ndarray,
    held: Sequence[int] | np.ndarray,
) -> float:
    """Probability of held-out data as far off as these if an explanation of the used ones is true.

    It is that of the rise of chi2 when the held-out data are fitted as well, which allows for the
    errors of the fit and for those that both kinds of data share; nan where none are held out.
    """
    if not len(held):
        return float("nan")
    added = tuple(i for i, e in enumerate(effects) if e.name in explanation.effects)
    both = np.concatenate([used, np.asarray(held, int)])
    once = everything.replicates.copy()
    # what runs with an effect have beyond the noise may be a bend that replicates share
    once[np.asarray(held, int)] = 1
    rise = (
        explain(
            surfaces, replace(everything, replicates=once).only(both), effects, added, both
        ).chi2
        - explanation.chi2
    )
    return tail(max(rise, 0.0), len(held), surfaces.degrees)


def _nameable(best: Explanation, evidence: _Evidence) -> bool:
    (name,) = best.effects
    rule, degrees = evidence.rule, len(evidence.used) - evidence.surfaces.dimensions
    others = [one.deviance for one in evidence.rivals.single if one.effects != best.effects]
    return (
        evidence.weights[name] >= rule.posterior
        and all(deviance >= best.deviance + rule.lead for deviance in others)
        and best.adequacy(evidence.surfaces.degrees) >= rule.fit
        and _plausible(best, rule)
        and evidence.ghost < (rule.ghost if degrees >= rule.few else rule.ghost_of_few)
    )


def _plausible(one: Explanation, rule: Rule) -> bool:
    """Whether all amplitudes are clear of zero, and not far beyond what was run."""
    added = ~np.isnan(one.amplitude_error)
    size, error = np.abs(one.amplitude[added]), one.amplitude_error[added]
    return bool(((rule.errors * error < size) & (size < rule.reach)).all())


def _wants_a_second(best: Explanation, evidence: _Evidence) -> bool:
    """Whether a second effect explains so much more that this one is not the whole story."""
    surfaces, measured, effects = evidence.surfaces, evidence.measured, evidence.effects
    (k,) = (i for i, e in enumerate(effects) if e.name in best.effects)
    others = [
        i
        for i, e in enumerate(effects)
        if i != k and e.name not in effects[k].excludes and best.effects[0] not in e.excludes
    ]
    needed = best.deviance - evidence.rule.second
    return any(
        explain(surfaces, measured, effects, (k, i), evidence.used).deviance < needed
        for i in others
    )


def _credible_set(weights: dict[str, float], coverage: float) -> tuple[str, ...]:
    """The smallest set of explanations that holds the posterior probability asked for."""
    names, held = [], 0.0
    for name in sorted(weights, key=weights.__getitem__, reverse=True):
        names.append(name)
        held += weights[name]
        if held >= coverage:
            break
    return tuple(names)


def _pair(evidence: _Evidence) -> Explanation | None:
    """The pair of effects that explains what no single one does, or None."""
    surfaces, effects, rule = evidence.surfaces, evidence.effects, evidence.rule
    if len(evidence.used) - surfaces.dimensions - 2 < 1 or len(effects) < 2:
        return None
    if not (found := pairs(surfaces, evidence.measured, effects, evidence.used)):
        return None
    best, *others = found
    alone = [one.deviance for one in evidence.rivals.single if one.effects[0] in best.effects]
    clear = not others or others[0].deviance > best.deviance + rule.pair_lead
    worthwhile = all(deviance > best.deviance + rule.pair_gain for deviance in alone)
    refutable = not any(e.control for e in effects if e.name in best.effects)
    fits = _plausible(best, rule) and best.adequacy(surfaces.degrees) >= rule.pair_adequacy
    return best if clear and worthwhile and refutable and fits else None
