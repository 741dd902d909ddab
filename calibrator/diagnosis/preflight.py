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
    FEWEST_DEGREES,
    absorbed_shares,
    smallest_detectable,
    smallest_nameable,
)
from calibrator.diagnosis.outcome import Power, Preflight
from calibrator.diagnosis.runs import Scene, prepare
from calibrator.diagnosis.verdict import NONE, Linear, judge, linear
from calibrator.runs.workspace import Report, Workspace, silent
from calibrator.threads import on_one_thread

SELF_TESTS = 12  # imagined measurements per effect in the pre-flight
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
        effects=powers(scene.effects, picture),
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


def powers(effects: Sequence[Effect], picture: Linear) -> tuple[Power, ...]:
    """What each of k effects would have to be to be seen, and to be named, in its own unit."""
    slopes = picture.slopes
    d = slopes.shape[1] - len(effects)
    hidden = absorbed_shares(slopes[:, d:], picture.none.covariance, slopes[:, :d])
    cosines = picture.prints.confusability - np.eye(len(effects))
    seen, named = smallest_detectable(picture.prints), smallest_nameable(picture.prints)
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
            verdict = judge(scene.surfaces, imagined, scene.effects, used, rng, held=scene.held)
            counts[verdict.said] = counts.get(verdict.said, 0) + 1
    return found
