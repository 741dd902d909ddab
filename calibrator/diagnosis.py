"""The verbs `preflight` and `diagnose`: what could be seen, and what is missing from the model."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibrator import experiments as ex
from calibrator.cost import core_seconds
from calibrator.database import Database
from calibrator.design import sobol
from calibrator.discrepancy import (
    FEWEST_DEGREES,
    Detection,
    Gap,
    absorbed_shares,
    ghost_shares,
    localise,
    smallest_detectable,
    smallest_nameable,
)
from calibrator.errors import CalibratorError
from calibrator.files import read_text, write_text
from calibrator.identification import Effect, Explanation, Measured
from calibrator.lab import Observable
from calibrator.quantities import EFFECTS
from calibrator.records import Record
from calibrator.surface import Surfaces, fewest_runs
from calibrator.table import Request
from calibrator.verdict import Linear, Verdict, judge, linear
from calibrator.workflow import Report, Workspace, carry_out, for_new_seeds, made_by, silent

CONFIRM_SEED = 400_000_000  # added to the seeds of the runs that confirm an explanation
SELF_TESTS = 12  # imagined measurements per effect in the pre-flight
SHORTLIST = 3  # explanations that are run on YADE beside the model as it is


@dataclass(frozen=True, eq=False)
class Scene:
    """What a diagnosis looks at: observables with their surfaces; used and held are their indices by role."""

    effects: list[Effect]
    experiments: list[ex.Experiment]
    observables: list[Observable]
    surfaces: Surfaces
    measured: Measured
    used: np.ndarray
    held: np.ndarray
    notes: list[str]


def prepare(space: Workspace, observables: Sequence[Observable], yes: bool, report: Report = silent) -> Scene:
    """Carry out the runs of the surfaces and fit them. Raises CalibratorError beyond the budget unless yes."""
    case, effects = space.case, ex.library(space.case)
    found = ex.experiments(case, observables)
    _enough(space, len(effects))
    points = sobol(case.problem, case.diagnosis.sets)
    plain = ex.plain_requests(case, found, points)
    changes = ex.change_requests(case, found, effects, points)
    records = _carried_out(space, [r for own in (*plain, *changes) for r in own], yes, report)
    Database(records.values()).write(space.folder() / "diagnosis.csv", made_by(space, "diagnose"))
    surfaces = ex.surfaces(case, found, effects, _of(records, plain), _of(records, changes))
    ordered = ex.in_order(observables, found)
    d = surfaces.dimensions
    slopes = surfaces.jacobian(np.full(d, 0.5), np.zeros(len(effects)))[:, d:]
    kept, notes = ex.distinct(ordered, surfaces)
    used = np.array([i for i in kept if ordered[i].role != "held_out"], int)
    held = np.array([i for i, o in enumerate(ordered) if o.role == "held_out"], int)
    measured = ex.measured(ordered, case.nuisances, surfaces, slopes, effects)
    return Scene(effects, found, ordered, surfaces, measured, used, held, notes)


def _enough(space: Workspace, effects: int) -> None:
    """Raise CalibratorError where the planned runs are too few for the surfaces, before any of them is made."""
    settings, parameters = space.case.diagnosis, len(space.case.problem.names)
    if settings.sets * settings.replicates < (least := fewest_runs(parameters, 0)):
        raise CalibratorError(f"diagnosis.sets x replicates is below {least}: raise one of them")
    if settings.sets + effects * settings.effect_sets < (least := fewest_runs(parameters, effects)):
        raise CalibratorError(f"diagnosis.sets + effects x effect_sets is below {least}: raise one of them")


def _carried_out(space: Workspace, requests: Sequence[Request], yes: bool, report: Report) -> dict[str, Record]:
    space = for_new_seeds(space, space.case.diagnosis)
    done = space.finished(requests)
    there = {r.run_id for r in done}
    missing = [r for r in requests if r.run_id not in there]
    hours = float(core_seconds(missing, done).sum() / 3600) if missing else 0.0
    if hours > space.case.diagnosis.budget_core_hours and not yes:
        raise CalibratorError(
            f"{len(missing)} runs would take {hours:.1f} core-hours, more than diagnosis.budget_core_hours = "
            f"{space.case.diagnosis.budget_core_hours:g}: call again with --yes, raise that budget, or ask for fewer sets"
        )
    return {r.run_id: r for r in carry_out(space, requests, report)}


def _of(records: dict[str, Record], requests: Sequence[Sequence[Request]]) -> list[list[Record]]:
    return [[records[r.run_id] for r in own if r.run_id in records] for own in requests]


def preflight(space: Workspace, report: Report = silent, yes: bool = False) -> dict[str, Any]:
    """What these observables could detect and name, in physical units, and which further experiment would help most.

    The measured values play no part: only which observables there are, their replicates and scatter. Conditions of the case
    that the lab file does not mention are the further experiments.
    """
    case = space.case
    known_rows = list(case.observables)
    further = [o for name in case.conditions for o in _imagined(case.conditions[name].setup, name, known_rows)]
    scene = prepare(space, [*known_rows, *further], yes, report)
    names = {o.experiment for o in known_rows}
    own = np.array([i for i in scene.used if scene.observables[i].experiment in names])
    picture = _at_centre(scene, own)
    helps = {}
    for extra in sorted({o.experiment for o in further}):
        more = np.array([i for i in scene.used if scene.observables[i].experiment in {*names, extra}])
        helps[extra] = _gain(picture, _at_centre(scene, more))
    outcome = {
        "observables": [scene.observables[i].key for i in own],
        "degrees": picture.project.degrees,
        "effects": _powers(scene, own, picture),
        "confusability": [[float(c) for c in row] for row in picture.prints.confusability],
        "self_test": self_test(scene, own) if picture.project.degrees >= FEWEST_DEGREES else {},
        "further_experiments": helps,
        "notes": scene.notes,
    }
    return space.note("preflight", outcome)


def _imagined(setup: str, condition: str, rows: Sequence[Observable]) -> list[Observable]:
    """Observables of a condition that nobody has measured: those of its set-up, measured as well."""
    if any(o.condition == condition for o in rows):
        return []
    return [
        Observable(setup, o.response, 0.0, o.scatter, o.replicates, "diagnose", condition)
        for o in rows
        if o.setup == setup and not o.condition
    ]


def _at_centre(scene: Scene, used: np.ndarray) -> Linear:
    """The linear picture at the centre of the box, with measurements that fit there."""
    d, k = scene.surfaces.dimensions, len(scene.effects)
    exact = scene.surfaces.mean(np.full(d, 0.5), np.zeros(k))[0]
    return linear(scene.surfaces, Measured(exact, scene.measured.covariance).only(used), scene.effects, used)


def _gain(before: Linear, after: Linear) -> float:
    """Mean logarithm by which the smallest nameable amplitudes fall; an effect that cannot be named counts as a large one."""
    low, high = (np.minimum(smallest_nameable(p.prints), 100) for p in (after, before))
    return float(np.log(high / low).mean())


def _powers(scene: Scene, used: np.ndarray, picture: Linear) -> list[dict[str, Any]]:
    d = scene.surfaces.dimensions
    slopes = scene.surfaces.jacobian(picture.none.unit, np.zeros(len(scene.effects)))[used]
    hidden = absorbed_shares(slopes[:, d:], picture.none.covariance, slopes[:, :d])
    cosines = picture.prints.confusability - np.eye(len(scene.effects))
    seen, named = smallest_detectable(picture.prints), smallest_nameable(picture.prints)
    return [
        {
            "effect": e.name,
            "called": called(e.name),
            "unit": EFFECTS[e.name].unit,
            "scale": e.scale,
            "smallest_detectable": finite(seen[i] * e.scale),
            "smallest_nameable": finite(named[i] * e.scale),
            "absorbed": float(hidden[i]),
            "alias": scene.effects[int(cosines[i].argmax())].name if len(scene.effects) > 1 else "",
            "alias_cosine": float(cosines[i].max()),
        }
        for i, e in enumerate(scene.effects)
    ]


def called(name: str) -> str:
    """An effect in plain words."""
    effect = EFFECTS[name].effect
    assert effect is not None
    return effect.called


def finite(value: float) -> float | None:
    """The number, or None where it is none: JSON has no infinity."""
    return float(value) if math.isfinite(value) else None


def self_test(scene: Scene, used: np.ndarray, trials: int = SELF_TESTS, seed: int = 1) -> dict[str, dict[str, int]]:
    """Verdicts on imagined measurements: nothing hidden, and each effect at its plausible size; counts by what is printed."""
    rng, d, k = np.random.default_rng(seed), scene.surfaces.dimensions, len(scene.effects)
    found: dict[str, dict[str, int]] = {}
    for hidden in (-1, *range(k)):
        counts = found.setdefault("none" if hidden < 0 else scene.effects[hidden].name, {})
        for _ in range(trials):
            amplitude = np.zeros(k)
            if hidden >= 0:
                amplitude[hidden] = 1.0 if scene.effects[hidden].sign == "+" else rng.choice([-1.0, 1.0])
            unit = rng.uniform(0.2, 0.8, d)
            mean = scene.surfaces.mean(unit, amplitude)[0]
            errors = rng.multivariate_normal(
                np.zeros(len(mean)), scene.measured.covariance + scene.surfaces.error(unit, amplitude)
            )
            imagined = Measured(mean + errors, scene.measured.covariance).only(used)
            verdict = judge(scene.surfaces, imagined, scene.effects, used, rng)
            said = verdict.effects[0] if verdict.kind == "named" else verdict.kind
            counts[said] = counts.get(said, 0) + 1
    return found


def diagnose(space: Workspace, report: Report = silent, yes: bool = False) -> dict[str, Any]:
    """Find the gap, name the missing effect, run it on YADE, and say by how much the gap shrinks."""
    case = space.case
    used = [o for o in case.observables if o.role != "held_out"]
    degrees = len(used) - len(case.problem.names)
    if degrees < FEWEST_DEGREES:
        return space.note("diagnose", _cannot_tell(len(used), degrees, len(case.problem.names)))
    scene = prepare(space, case.observables, yes, report)
    rng = np.random.default_rng(case.diagnosis.seed)
    measured = scene.measured.only(scene.used)
    picture = linear(scene.surfaces, measured, scene.effects, scene.used)
    verdict = judge(scene.surfaces, measured, scene.effects, scene.used, rng)
    tried = _shortlist(scene, picture, verdict)
    runs = _confirming(space, scene, tried, yes, report)
    outcome = {
        "verdict": verdict.kind,
        "effects": list(verdict.effects),
        "detection": _plain(verdict.detection),
        "ghost_probability": finite(verdict.ghost),
        "posterior": verdict.posterior,
        "adequacy": verdict.adequacy,
        "observables": _rows(scene, tried, runs),
        "locations": [vars(one) for one in _locations(scene, picture)],
        "explanations": [_explanation(scene, one, own) for one, own in zip(tried, runs, strict=True)],
        "fingerprints": {
            "effects": [e.name for e in scene.effects],
            "shifts": _shifts(scene, picture),
            "confusability": [[float(c) for c in row] for row in picture.prints.confusability],
            "amplitudes": [finite(x) for x in picture.prints.amplitudes(picture.residual)],
            "likelihood_ratios": [float(x) for x in picture.prints.likelihood_ratios(picture.residual)],
        },
        "ghosts": _ghosts(picture, rng),
        "powers": _powers(scene, scene.used, picture),
        "notes": scene.notes,
    }
    outcome["sentence"] = sentence(outcome)
    outcome["new_case"] = str(_write_new_case(space, scene, verdict)) if verdict.kind == "named" else ""
    return space.note("diagnose", outcome)


def _cannot_tell(observables: int, degrees: int, parameters: int) -> dict[str, Any]:
    lacking = FEWEST_DEGREES - degrees
    text = (
        f"Cannot tell: {observables} observables against {parameters} parameters leave {max(degrees, 0)} degrees of freedom, "
        f"and a missing effect needs {FEWEST_DEGREES}: measure at least {lacking} more, such as steady rate, residual mass or "
        "curvature of the runs that were made, or a second neck."
    )
    return {"verdict": "cannot tell", "effects": [], "sentence": text}


def _plain(detection: Detection) -> dict[str, Any]:
    return dict(vars(detection))


def _locations(scene: Scene, picture: Linear) -> list[Any]:
    d = scene.surfaces.dimensions
    slopes = scene.surfaces.jacobian(picture.none.unit, np.zeros(len(scene.effects)))[scene.used, :d]
    names = [scene.observables[i].experiment for i in scene.used]
    return localise(picture.none.residual, picture.none.covariance, slopes, names)


def _shifts(scene: Scene, picture: Linear) -> list[list[float]]:
    """Change of each used observable by each effect of plausible size, in standard errors (n, k)."""
    slopes = scene.surfaces.jacobian(picture.none.unit, np.zeros(len(scene.effects)))[scene.used, scene.surfaces.dimensions :]
    errors = np.sqrt(np.diag(picture.none.covariance))
    return [[float(x) for x in row] for row in slopes / errors[:, None]]


def _ghosts(picture: Linear, rng: np.random.Generator) -> dict[str, float]:
    """Share of chi2 that the best true effect and ghost libraries remove."""
    residual = picture.residual
    shares = ghost_shares(residual, picture.prints, rng)
    found = float(picture.prints.likelihood_ratios(residual).max(initial=0) / (residual @ residual))
    return {"effect": found, "ghost_median": float(np.median(shares)), "ghost_95": float(np.quantile(shares, 0.95))}


def _shortlist(scene: Scene, picture: Linear, verdict: Verdict) -> list[Explanation]:
    """The model as it is, and the explanations worth running: the named ones first, then the most probable."""
    if verdict.rivals is None:
        return [picture.none]
    ranked = sorted(verdict.rivals.single, key=lambda one: one.log_evidence, reverse=True)
    best = [verdict.best] if verdict.best is not None else []
    others = [one for one in ranked if not best or one.effects != best[0].effects]
    return [picture.none, *best, *others][: 1 + SHORTLIST]


def _confirming(
    space: Workspace, scene: Scene, tried: Sequence[Explanation], yes: bool, report: Report
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Mean responses (n,) of fresh YADE runs at each explanation, and how many runs are behind them."""
    requests = [_fresh(space, scene, one, index) for index, one in enumerate(tried)]
    records = _carried_out(space, [r for three in requests for own in three for r in own], yes, report)
    Database(records.values()).write(space.folder() / "diagnosis_confirmed.csv", made_by(space, "diagnose"))
    return [ex.means(scene.experiments, _of(records, own)) for own in requests]


def _fresh(space: Workspace, scene: Scene, one: Explanation, index: int) -> list[list[Request]]:
    """Runs with new seeds of every experiment, a list for each, at an explanation; index keeps several apart."""
    case, at = space.case, ex.point(space.case, one.unit)
    first = case.diagnosis.seed + CONFIRM_SEED + ex.SET_STRIDE * index
    sizes = zip(scene.effects, one.amplitude, strict=True)
    added = {effect.name: ex.column_value(effect, size) for effect, size in sizes if effect.name in one.effects}
    return [
        [ex.request(case, e, at, first + ex.EXPERIMENT_STRIDE * i + j, added) for j in range(case.diagnosis.verify_replicates)]
        for i, e in enumerate(scene.experiments)
    ]


def _standardised(scene: Scene, runs: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Residuals (n,) of fresh runs over their standard errors."""
    mean, count = runs
    error = np.sqrt(np.diag(scene.measured.covariance) + np.diag(scene.surfaces.noise) / count)
    return np.asarray((scene.measured.values - mean) / error)


def _rows(scene: Scene, tried: Sequence[Explanation], runs: Sequence[tuple[np.ndarray, np.ndarray]]) -> list[dict[str, Any]]:
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
            "simulated": [float(mean[i]) for mean, _ in runs],
            "z": [float(own[i]) for own in z],
        }
        for i, o in enumerate(scene.observables)
    ]


def _explanation(scene: Scene, one: Explanation, runs: tuple[np.ndarray, np.ndarray]) -> dict[str, Any]:
    z = _standardised(scene, runs)
    free = len(one.unit) + len(one.effects)
    return {
        "effects": list(one.effects),
        "parameters_unit": [float(u) for u in one.unit],
        "amplitudes": {
            e.name: {"value": ex.column_value(e, a), "error": s * e.scale}
            for e, a, s in zip(scene.effects, one.amplitude, one.amplitude_error, strict=True)
            if e.name in one.effects
        },
        "chi2": one.chi2,
        "degrees": one.degrees,
        "adequacy": one.adequacy(scene.surfaces.degrees),
        "gap_used": _rms(z[scene.used]),
        "floor_used": math.sqrt(max(len(scene.used) - free, 1) / len(scene.used)),
        "gap_held_out": _rms(z[scene.held]),
        "floor_held_out": 1.0,
    }


def _rms(z: np.ndarray) -> float | None:
    return float(np.sqrt(np.mean(z**2))) if len(z) else None


def sentence(o: dict[str, Any]) -> str:
    """The verdict in one sentence with its numbers."""
    p = min(o["detection"]["p_effect"], o["detection"]["p_chi2"])
    where = o["locations"][0] if o["locations"] else None
    place = f", most of all in {where['experiment']} (p = {where['p_holm']:.2g})" if where and where["p_holm"] < 0.05 else ""
    gap = f"Simulation and measurement disagree beyond every known error (p = {p:.2g}{place})"
    if o["verdict"] == "no gap":
        return f"No gap: the model meets the measurements within their errors (p = {p:.2g}). {_could_have_seen(o)}"
    if o["verdict"] in ("named", "two effects"):
        return f"{gap}. {_named(o)} {_shrunk(o)} {_refuted(o)}"
    if o["verdict"] == "ambiguous":
        names = " or ".join(
            "nothing" if n == "none" else "something unknown" if n == "unknown" else called(n) for n in o["effects"]
        )
        return f"{gap}; what explains it is ambiguous: {names}."
    return f"{gap}, and no effect of the library explains it: unknown."


def _could_have_seen(o: dict[str, Any]) -> str:
    seen = [p for p in o["powers"] if p["smallest_detectable"] is not None and p["smallest_detectable"] < 3 * p["scale"]]
    if not seen:
        return "No effect of plausible size would have been seen."
    sizes = (f"{p['called']} of {p['smallest_detectable']:.2g}{'' if p['unit'] == '1' else ' ' + p['unit']}" for p in seen)
    return f"What would have been seen, with 80 % probability: {', '.join(sizes)}."


def _named(o: dict[str, Any]) -> str:
    best = o["explanations"][1]
    parts = [f"{called(n)} ({n} = {a['value']:.3g} +- {a['error']:.2g})" for n, a in best["amplitudes"].items()]
    rivals = [e for e in o["explanations"][2:] if e["effects"]]
    rival = f"; next {called(rivals[0]['effects'][0])}, chi2 {rivals[0]['chi2'] - best['chi2']:+.1f}" if rivals else ""
    return f"The missing effect is {' and '.join(parts)}{rival}, with posterior {_posterior(o):.2f}."


def _posterior(o: dict[str, Any]) -> float:
    return max((o["posterior"].get(n, float("nan")) for n in o["effects"]), default=float("nan"))


def _shrunk(o: dict[str, Any]) -> str:
    before, after = o["explanations"][:2]
    texts = []
    for what, words in (("used", "on the data used"), ("held_out", "on held-out data")):
        if before[f"gap_{what}"] is not None:
            gap = Gap(before[f"gap_{what}"], after[f"gap_{what}"], before[f"floor_{what}"])
            closed = "" if math.isnan(gap.closed) else f", {gap.closed:.0%} closed"
            texts.append(f"{gap.before:.1f} -> {gap.after:.1f} {words} (noise alone {gap.floor:.1f}{closed})")
    ghosts = o["ghosts"]
    return (
        f"With it the gap, in standard errors, goes from {' and '.join(texts)}; a random effect would remove "
        f"{ghosts['ghost_median']:.0%} of chi2, this one {ghosts['effect']:.0%}."
    )


def _refuted(o: dict[str, Any]) -> str:
    cures = []
    for name in o["effects"]:
        effect = EFFECTS[name].effect
        assert effect is not None
        cures.append(effect.removed_by)
    return f"It would be refuted if the gap stayed after {' and '.join(cures)}."


def _write_new_case(space: Workspace, scene: Scene, verdict: Verdict) -> Path:
    """The case with the effect among its parameters, beside copies of the files that it names."""
    case = space.case
    (name,) = verdict.effects
    assert verdict.best is not None
    index = [e.name for e in scene.effects].index(name)
    effect = scene.effects[index]
    size, error = verdict.best.amplitude[index], verdict.best.amplitude_error[index]
    ends = sorted(ex.column_value(effect, size + s * max(3 * error, 0.5 * abs(size))) for s in (-1, 1))
    if effect.sign == "+":
        ends[0] = max(ends[0], ex.column_value(effect, 0.0))
    folder = space.folder("with_effect")
    text = re.sub(r"(?m)^(shipped|truth_file)\s*=.*\n", "", read_text(case.path))
    text = re.sub(r"(?m)^name\s*=.*$", f'name = "{case.name}_with_{name}"', text, count=1)
    for named in re.findall(r'(?m)^(?:measured|nuisances)\s*=\s*"([^"]+)"', text):
        shutil.copyfile(case.path.parent / named, folder / Path(named).name)
        text = text.replace(f'"{named}"', f'"{Path(named).name}"')
    path = folder / f"{case.name}_with_{name}.toml"
    head = f"\n# added by calibrator diagnose: {called(name)}\n[parameters.{name}]\n"
    write_text(path, f"{text}{head}low = {ends[0]!r}\nhigh = {ends[1]!r}\n")
    return path
