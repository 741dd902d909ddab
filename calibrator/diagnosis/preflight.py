"""The verb `preflight`: which missing effects could be seen and told apart, and from what size.

It is called before any laboratory work.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibrator.case.codec import finite
from calibrator.case.vocabulary import EFFECTS, effect_of
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.basis import preflight_basis
from calibrator.diagnosis.explanations import Effect
from calibrator.diagnosis.gap import (
    DETECTABLE,
    FEWEST_DEGREES,
    NAMEABLE,
    absorbed_shares,
    smallest_nameable,
)
from calibrator.diagnosis.outcome import Power, Preflight
from calibrator.diagnosis.runs import Scene, prepare
from calibrator.diagnosis.surfaces import Surfaces
from calibrator.diagnosis.verdict import NONE, Linear, judge, linear
from calibrator.runs.workspace import Report, Workspace, silent
from calibrator.threads import on_one_thread

SELF_TESTS = 12  # imagined measurements per effect in the pre-flight
STEPS = 51  # sizes of an effect that are tried, from none to the largest that is fitted
NEVER = 100  # plausible sizes that stand for an effect which cannot be named at all


@on_one_thread
def preflight(space: Workspace, report: Report = silent, yes: bool = False) -> Preflight:
    """What these observables could detect and name, and which further experiment would help most.

    The measured values play no part: only which observables there are, their replicates and
    scatter. Conditions of the case that the lab file does not mention are the further experiments.
    Raises CalibratorError where the runs are too few, or beyond the budget unless `yes`.
    """
    case, further = space.case, ex.further(space.case)
    scene = prepare(space, [*case.observables, *further], yes, report, imagined=True)
    names = {o.experiment for o in case.observables}
    own = _in_experiments(scene, names)
    picture = _at_centre(scene, own)
    gains = {
        extra: _gain(picture, _at_centre(scene, _in_experiments(scene, {*names, extra})))
        for extra in sorted({o.experiment for o in further})
    }
    found = Preflight(
        observables=tuple(scene.observables[i].key for i in own),
        degrees=picture.project.degrees,
        effects=powers(scene.effects, picture, scene.surfaces, own),
        confusability=rows_of(picture.prints.confusability),
        self_test=self_test(scene, own) if picture.project.degrees >= FEWEST_DEGREES else {},
        further_experiments=gains,
        notes=tuple(scene.notes),
        fingerprint=preflight_basis(case, scene.records),
    )
    return space.note("preflight", found)


def _in_experiments(scene: Scene, names: set[str]) -> np.ndarray:
    """Indices of the used observables of these experiments."""
    return np.array([i for i in scene.used if scene.observables[i].experiment in names])


def _at_centre(scene: Scene, used: np.ndarray) -> Linear:
    """The linear picture of the scene, whose measurements are imagined at the centre of the box."""
    return linear(scene.surfaces, scene.measured.only(used), scene.effects, used)


def _gain(before: Linear, after: Linear) -> float:
    """Mean logarithm by which the smallest nameable amplitudes fall."""
    low, high = (np.minimum(smallest_nameable(p.prints), NEVER) for p in (after, before))
    return float(np.log(high / low).mean())


def rows_of(matrix: np.ndarray) -> tuple[tuple[float, ...], ...]:
    """A matrix (r, c) as r rows of c numbers."""
    return tuple(tuple(float(x) for x in row) for row in matrix)


def visible_lengths(
    effect: int, sizes: np.ndarray, picture: Linear, surfaces: Surfaces, used: np.ndarray
) -> np.ndarray:
    """Standard errors by which an effect of these sizes (j,) moves the residual: (j,).

    It is the change that the surfaces give, and not its slope at zero, which is too steep where an
    effect saturates. Its squared length is less by what the noise of the few runs behind it adds to
    a length: that noise has no direction, and makes effects look larger than they are.
    """
    unit, amplitudes = picture.none.unit, np.zeros((len(sizes), len(picture.prints.names)))
    amplitudes[:, effect] = sizes
    units, none = np.tile(unit, (len(sizes), 1)), np.zeros(amplitudes.shape[1])
    change = surfaces.mean(units, amplitudes) - surfaces.mean(unit, none)
    matrix, plain = picture.project.matrix, surfaces.error(unit, none)
    added = [
        np.sum((matrix @ (surfaces.error(unit, a) - plain)[np.ix_(used, used)]) * matrix)
        for a in amplitudes
    ]
    squared = (picture.project(change[:, used].T) ** 2).sum(axis=0) - np.array(added)
    return np.asarray(np.sqrt(np.maximum(squared, 0)))


def smallest_sizes(
    effects: Sequence[Effect], picture: Linear, surfaces: Surfaces, used: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Sizes (k,) from which effects are seen, and named: in plausible scales, infinite if never.

    Of an effect of both signs the worse one counts.
    """
    cosines = picture.prints.confusability - np.eye(len(effects))
    sines = np.sqrt(np.clip(1 - cosines.max(axis=1, initial=0) ** 2, 1e-12, 1))
    found = np.zeros((2, len(effects)))
    for k, effect in enumerate(effects):
        for end in (effect.bounds[1], *((effect.bounds[0],) if effect.bounds[0] < 0 else ())):
            sizes = np.linspace(0, end, STEPS)
            lengths = visible_lengths(k, sizes, picture, surfaces, used)
            for row, needed in enumerate((DETECTABLE, NAMEABLE / sines[k])):
                found[row, k] = max(found[row, k], _first(np.abs(sizes), lengths, needed))
    return found[0], np.maximum(*found)


def _first(sizes: np.ndarray, lengths: np.ndarray, needed: float) -> float:
    """The size at which a length is first reached, between those tried; infinite if it is not."""
    if not (enough := lengths >= needed).any():
        return float("inf")
    i = max(int(enough.argmax()), 1)
    return float(np.interp(needed, lengths[i - 1 : i + 1], sizes[i - 1 : i + 1]))


def powers(
    effects: Sequence[Effect], picture: Linear, surfaces: Surfaces, used: np.ndarray
) -> tuple[Power, ...]:
    """What each of k effects would have to be to be seen, and to be named, in its own unit.

    used : indices of the surfaces' observables that the picture is made of.
    """
    slopes = picture.slopes
    d = slopes.shape[1] - len(effects)
    hidden = absorbed_shares(slopes[:, d:], picture.none.covariance, slopes[:, :d])
    cosines = picture.prints.confusability - np.eye(len(effects))
    seen, named = smallest_sizes(effects, picture, surfaces, used)
    return tuple(
        Power(
            effect=e.name,
            called=effect_of(e.name).called,
            unit=EFFECTS[e.name].unit,
            scale=abs(e.scale),
            smallest_detectable=finite(seen[i] * abs(e.scale)),
            smallest_nameable=finite(named[i] * abs(e.scale)),
            absorbed=float(hidden[i]),
            alias=effects[int(cosines[i].argmax())].name if len(effects) > 1 else "",
            alias_cosine=float(cosines[i].max()),
        )
        for i, e in enumerate(effects)
    )


def self_test(
    scene: Scene, used: np.ndarray, trials: int = SELF_TESTS, seed: int = 1
) -> dict[str, dict[str, int]]:
    """Verdicts on imagined measurements: nothing hidden, and each effect at its plausible size.

    used : indices of the observables; trials : imagined measurements of each. Returns counts of
    what is printed, by what is hidden.
    """
    rng, d, k = np.random.default_rng(seed), scene.surfaces.dimensions, len(scene.effects)
    found: dict[str, dict[str, int]] = {}
    for hidden in (-1, *range(k)):
        counts = found.setdefault(NONE if hidden < 0 else scene.effects[hidden].name, {})
        for _ in range(trials):
            amplitude = np.zeros(k)
            if hidden >= 0:
                amplitude[hidden] = (
                    1.0 if scene.effects[hidden].sign == "+" else rng.choice([-1.0, 1.0])
                )
            unit = rng.uniform(0.2, 0.8, d)
            mean = scene.surfaces.mean(unit, amplitude)[0]
            scatter = np.diag(scene.surfaces.extra_scatter(amplitude) / scene.measured.replicates)
            covariance = scene.measured.covariance + scene.surfaces.error(unit, amplitude) + scatter
            imagined = replace(scene.measured, values=rng.multivariate_normal(mean, covariance))
            verdict = judge(
                scene.surfaces,
                imagined,
                scene.effects,
                used,
                rng,
                held=scene.held,
                uncertain=scene.uncertain,
            )
            counts[verdict.said] = counts.get(verdict.said, 0) + 1
    return found
