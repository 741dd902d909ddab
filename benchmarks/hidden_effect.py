"""How often is the verdict right? Measurements in which an effect is hidden, from pools of real
YADE runs.

    calibrator preflight cases/missing_effect.toml --yes   runs of the surfaces: diagnosis.csv,
    grid/missing_effect.csv python -m benchmarks.hidden_effect run [N [CLASS]]     carry out the
    pools (resumable), hours: grid/missing_effect_pools.csv;
                                                           N runs of each instead of five, of
                                                           classes whose label begins so or whose
                                                           number it is
    python -m benchmarks.hidden_effect                     judge them:
    benchmarks/results/hidden_effect.json

A class is a truth: parameters, and nothing hidden, an effect at a weak, middling or strong
amplitude, an effect outside the library, or a pair. What the bars are about (nothing, strong
effects) has several truths. Its pool holds a few runs of every experiment, spare ones where some
clog; a trial draws five of each as the replicates of a laboratory, and errors of metrology anew; a
neck or a level that is slightly off shifts them along the surfaces' slopes. Pools are shared by the
trials of a class, so intervals are bootstrapped by pool. Each class of a single effect is judged
once more without that effect in the library. After a look at the first truths came, in
`verdict.Rule`, `held_out`, `second`, `reach`, the lead and the posterior that a name needs, and
that a control is not named; the scatter of runs with an effect and the design of these runs; and in
the case the plausible sizes, what is dried and walls that are only smoother. The figures that count
are those of truths that were judged for the first time after all that: each kind once, but for the
control, strong effects and nothing hidden more often; `all_truths` has the earlier ones as well
that have runs of every experiment. The fresh YADE runs by which `diagnose` can take a name back are
not made here, so live it names less.
"""

import json
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2, norm

from benchmarks.common import write
from benchmarks.hidden import (
    OUTSIDE,
    REPLICATES,
    SHIPPED,
    laboratory_requests,
    metrology,
    read_off,
    small_effects,
    truth_of,
)
from calibrator.case.case import Case
from calibrator.case.toml import read_case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.explanations import Effect, Explanation, Measured, rivals
from calibrator.diagnosis.gap import Gap
from calibrator.diagnosis.preflight import powers
from calibrator.diagnosis.surfaces import Surfaces
from calibrator.diagnosis.verdict import Verdict, judge, linear
from calibrator.plan.design import sobol
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.local import run
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

REPO = Path(__file__).resolve().parent.parent
CASE = REPO / "cases" / "missing_effect.toml"
FOLDER = RunFolder(REPO / "results" / "missing_effect_pools")
POOLS = REPO / "grid" / "missing_effect_pools.csv"
AMPLITUDES = {"weak": 0.4, "middling": 0.8, "strong": 1.5}
CONTROL = "twisting_stiffness"  # not expected to be identifiable: one class only
PAIRS = (("bond_number", "neck_error"), ("clump_aspect", "tilt_deg"))
NOTHING, MORE_NOTHING = 20, 20  # classes with nothing hidden, each with its own parameters
# wall friction ratio above the grains' own, which the case does not look for: the grains then slip
# on each other
ROUGH = 2.0
# of each strong effect, beside the first; one more of what is outside and of the pairs
MORE_TRUTHS = 2
# strong effects all of whose truths had been judged: two more of each
LATEST = ("bond_number", "neck_error", "clump_aspect")
# Truths that were judged for the first time when the case, its design and all rules were as they
# are now.
JUDGED_LAST = {*range(75, 81), *range(121, 154)}
POOL = 10  # runs of every experiment in a pool, at most
TRIALS = 10  # of a class
FIRST_SEED = 1_100_000_000
BOOTSTRAPS = 1000


@dataclass(frozen=True)
class Class:
    """A truth and the runs of its pool, a list per experiment."""

    label: str
    strength: str
    index: int
    truth: dict[str, Any]
    requests: list[list[Request]]


@dataclass(frozen=True)
class Trial:
    """What was hidden (size: amplitude of a single effect) in which pool, what was said, and by how
    much the gap closed.

    best_chi2, naive, bic : names by simpler rules: the effect of lowest chi2 after a refit, the
    same only where chi2 rejects the model at 5 %, and the one that lowers the Bayesian information
    criterion.
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
    gaps: dict[str, float] = field(default_factory=dict)


def classes(case: Case) -> list[Class]:
    """All truths, each with its own parameters and seeds."""
    found = ex.experiments(case, case.observables)
    made = []
    for index, (label, strength, hidden) in enumerate([*_first(case), *_further(case)]):
        truth = truth_of(case, hidden, np.random.default_rng(index))
        asked = laboratory_requests(case, truth, found, FIRST_SEED + 100_000 * index, POOL)
        made.append(Class(label, strength, index, truth, asked))
    return made


def _first(case: Case) -> list[tuple[str, str, dict[str, float]]]:
    """Label, strength and what is hidden: one truth of everything, many of nothing."""
    effects = ex.library(case)
    wanted: list[tuple[str, str, dict[str, float]]] = [
        (f"nothing {i + 1}", "none", {}) for i in range(NOTHING)
    ]
    for i, effect in enumerate(effects):
        for j, strength in enumerate(AMPLITUDES):
            if effect.name != CONTROL or strength == "strong":
                wanted.append((effect.name, strength, _hidden(effect, strength, i + j)))
    return wanted + _outside_and_pairs(effects, [name for name in OUTSIDE if name != "vibration"])


def _further(case: Case) -> list[tuple[str, str, dict[str, float]]]:
    """Further truths: an order apart, so that they leave the seeds of the first ones alone."""
    effects = ex.library(case)
    named = [e for e in effects if e.name != CONTROL]
    wanted: list[tuple[str, str, dict[str, float]]] = []
    for turn in range(MORE_TRUTHS):
        wanted += [
            (e.name, "strong", _hidden(e, "strong", i + turn + 3)) for i, e in enumerate(named)
        ]
    wanted += _outside_and_pairs(effects, [*OUTSIDE, "vibration"])
    wanted += [(f"nothing {NOTHING + i + 1}", "none", {}) for i in range(MORE_NOTHING)]
    wanted.append(("wall_friction_ratio", "rough", {"wall_friction_ratio": ROUGH}))
    for turn in range(MORE_TRUTHS):
        wanted += [
            (e.name, "strong", _hidden(e, "strong", turn)) for e in effects if e.name in LATEST
        ]
    wanted += _outside_and_pairs(effects, list(OUTSIDE))
    for j, strength in enumerate(("strong", "weak", "middling")):
        wanted += [(e.name, strength, _hidden(e, strength, i + j)) for i, e in enumerate(named)]
    wanted += _outside_and_pairs(effects, [])
    for j, strength in enumerate(("strong", "strong", "weak", "middling")):
        wanted += [(e.name, strength, _hidden(e, strength, i + j)) for i, e in enumerate(named)]
    return wanted + _outside_and_pairs(effects, list(OUTSIDE))


def _hidden(effect: Effect, strength: str, parity: int) -> dict[str, float]:
    """An effect at a strength; negative where parity is odd and the effect can be."""
    size = AMPLITUDES[strength]
    return {
        effect.name: ex.column_value(
            effect, -size if parity % 2 and effect.bounds[0] <= -size else size
        )
    }


def _outside_and_pairs(
    effects: Sequence[Effect], outside: Sequence[str]
) -> list[tuple[str, str, dict[str, float]]]:
    by_name = {e.name: e for e in effects}
    pairs = [
        (
            " and ".join(two),
            "pair",
            {n: ex.column_value(by_name[n], AMPLITUDES["strong"]) for n in two},
        )
        for two in PAIRS
    ]
    return [*((name, "outside", {name: 1.0}) for name in outside), *pairs]


@dataclass(frozen=True, eq=False)
class Judged:
    """A library with its surfaces: the whole one, or one from which an effect is withheld."""

    effects: list[Effect]
    surfaces: Surfaces
    used: np.ndarray
    held: np.ndarray


def library(case: Case, database: Database, withheld: str = "") -> Judged:
    """Surfaces of the case's diagnosis from shipped runs."""
    effects = [e for e in ex.library(case) if e.name != withheld]
    found = ex.experiments(case, case.observables)
    points = sobol(case.problem, case.diagnosis.sets)
    plain = [database.find(own) for own in ex.plain_requests(case, found, points)]
    changes = [
        database.find(own) for own in ex.change_requests(case, found, ex.library(case), points)
    ]
    if withheld:
        changes = [[r for r in own if withheld not in r.request.parameters] for own in changes]
    surfaces = observed.surfaces(case, found, effects, plain, changes)
    ordered = ex.in_order(case.observables, found)
    kept, _ = observed.distinct(ordered, surfaces)
    used = np.array([i for i in kept if ordered[i].role != "held_out"])
    held = np.array([i for i, o in enumerate(ordered) if o.role == "held_out"])
    return Judged(effects, surfaces, used, held)


def measurements(
    case: Case, pool: list[np.ndarray], judged: Judged, rng: np.random.Generator
) -> Measured:
    """One laboratory: replicates of every experiment from its pool (runs, n), and errors of
    metrology.
    """
    found = ex.experiments(case, case.observables)
    ordered = ex.in_order(case.observables, found)
    values = np.hstack([own[rng.choice(len(own), REPLICATES, replace=False)] for own in pool])
    draws = metrology(case.nuisances, rng)
    d, k = judged.surfaces.dimensions, len(judged.effects)
    slopes = judged.surfaces.jacobian(np.full(d, 0.5), np.zeros(k))[:, d:]
    names = [e.name for e in judged.effects]
    nuisances = [n for n in case.nuisances if not n.effect or n.effect in names]
    reported = read_off(ordered, values, nuisances, draws)
    small = small_effects(nuisances, draws)
    shift = sum(
        (
            slopes[:, names.index(n)] * v / judged.effects[names.index(n)].scale
            for n, v in small.items()
        ),
        0.0,
    )
    found_errors = observed.measured(reported, nuisances, judged.surfaces, slopes, judged.effects)
    return replace(found_errors, values=found_errors.values + shift)


def trial(
    case: Case,
    one: Class,
    pool: list[np.ndarray],
    judged: Judged,
    withheld: bool,
    rng: np.random.Generator,
) -> Trial:
    """Judge one laboratory, and what simpler rules would have said."""
    everything = measurements(case, pool, judged, rng)
    measured = everything.only(judged.used)
    verdict = judge(judged.surfaces, everything, judged.effects, judged.used, rng, held=judged.held)
    found = verdict.rivals or rivals(judged.surfaces, measured, judged.effects, judged.used)
    best = min(found.single, key=lambda fit: fit.chi2)
    rejected = chi2.sf(found.none.chi2, found.none.degrees) < 0.05
    penalty = np.log(len(judged.used))
    hidden = tuple(n for n in one.truth["hidden"] if n not in OUTSIDE)
    amplitude, gaps = None, {}
    if verdict.kind == "named":
        assert verdict.best is not None
        k = [e.name for e in judged.effects].index(verdict.effects[0])
        amplitude = (float(verdict.best.amplitude[k]), float(verdict.best.amplitude_error[k]))
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
        best.effects[0] if best.chi2 + penalty < found.none.chi2 else "none",
        amplitude,
        gaps,
    )


def closed(
    judged: Judged,
    measured: Measured,
    none: Explanation,
    best: Explanation,
    single: Sequence[Explanation],
    rng: np.random.Generator,
) -> dict[str, float]:
    """Closed share of the gap on data used and held out, by the named effect, the runner-up and a
    ghost.
    """
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


def wilson(count: int, total: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson, J. Am. Stat. Assoc. 22 (1927) 209-212)."""
    if total == 0:
        return float("nan"), float("nan")
    z, p = float(norm.ppf(0.975)), count / total
    centre = (p + z**2 / (2 * total)) / (1 + z**2 / total)
    half = z / (1 + z**2 / total) * np.sqrt(p * (1 - p) / total + z**2 / (4 * total**2))
    return centre - half, centre + half


def true_size(case: Case, one: Class) -> float:
    """Amplitude of the hidden effect in plausible scales; nan where it is not exactly one of the
    library.
    """
    sizes = [
        (value, e)
        for name, value in one.truth["hidden"].items()
        for e in ex.library(case)
        if e.name == name
    ]
    return (
        (sizes[0][0] - ex.column_value(sizes[0][1], 0.0)) / sizes[0][1].scale
        if len(sizes) == 1
        else float("nan")
    )


def prints_names(t: Trial) -> bool:
    """Whether a name was given, or two."""
    return t.verdict.kind in ("named", "two effects")


def is_right(t: Trial) -> bool:
    """Whether the names that were printed are what was hidden."""
    return prints_names(t) and sorted(t.verdict.effects) == sorted(t.hidden)


def is_part(t: Trial) -> bool:
    """Whether the names that were printed are among what was hidden, if perhaps not all of it."""
    return prints_names(t) and set(t.verdict.effects) <= set(t.hidden)


def by_pool(
    trials: Sequence[Trial], value: Callable[[Sequence[Trial]], float]
) -> tuple[float, float]:
    """95 % interval of a statistic, resampling whole pools."""
    rng, pools = np.random.default_rng(1), {}
    for t in trials:
        pools.setdefault(t.pool, []).append(t)
    groups = list(pools.values())
    drawn = [
        value([t for i in rng.integers(len(groups), size=len(groups)) for t in groups[i]])
        for _ in range(BOOTSTRAPS)
    ]
    return float(np.nanquantile(drawn, 0.025)), float(np.nanquantile(drawn, 0.975))


def rates(trials: Sequence[Trial]) -> dict[str, Any]:
    """The figures that the project promises."""
    whole = [t for t in trials if not t.withheld]
    nothing = [t for t in whole if t.strength == "none"]
    single = [t for t in whole if t.strength in AMPLITUDES and t.label != CONTROL]
    strong = [t for t in single if t.strength == "strong"]
    outside = [t for t in trials if t.strength == "outside" or t.withheld]
    inside = [t for t in whole if t.strength != "outside"]
    printed = [t for t in inside if prints_names(t)]
    detected = [t for t in single if t.verdict.kind not in ("no gap", "cannot tell")]
    alarms = sum(t.verdict.kind != "no gap" for t in nothing)
    correct = [t for t in single if is_right(t)]
    true_names, wrong_names = sum(map(is_right, printed)), sum(map(prints_names, outside))
    no_heldout_gap = sum(not np.isfinite(t.gaps["held_out_closed"]) for t in correct)
    return {
        "false_alarm_rate": alarms / max(len(nothing), 1),
        "false_alarm_upper95": wilson(alarms, len(nothing))[1],
        "false_alarm_interval_by_pool": by_pool(
            nothing, lambda own: float(np.mean([t.verdict.kind != "no gap" for t in own]))
        ),
        "name_precision_in_library": true_names / max(len(printed), 1),
        "name_precision_interval": wilson(true_names, len(printed)),
        "name_precision_if_part_counts": share(printed, is_part, lambda t: True),
        "strong_named_rate": share(strong, is_right, lambda t: True),
        "strong_named_interval": wilson(sum(map(is_right, strong)), len(strong)),
        "strong_named_interval_by_pool": by_pool(
            strong, lambda own: float(np.mean([is_right(t) for t in own]))
        ),
        "pairs_named_rate": share(
            [t for t in whole if t.strength == "pair"], is_right, lambda t: True
        ),
        "outside_wrongly_named_rate": wrong_names / max(len(outside), 1),
        "outside_wrongly_named_interval": wilson(wrong_names, len(outside)),
        "set_coverage": sum(covered(t) for t in detected) / max(len(detected), 1),
        "set_coverage_interval": wilson(sum(map(covered, detected)), len(detected)),
        "heldout_gap_trials": len(correct),
        "heldout_gap_trials_without_gap": no_heldout_gap,
        "heldout_gap_closed_median": median(correct, "held_out_closed"),
        "heldout_gap_closed_ci95": by_pool(correct, lambda own: median(own, "held_out_closed")),
        "heldout_gap_closed_ghost_median": median(correct, "held_out_ghost"),
        "heldout_gap_closed_runner_up_median": median(correct, "held_out_runner_up"),
        "used_gap_closed_median": median(correct, "used_closed"),
        "used_gap_closed_ci95": by_pool(correct, lambda own: median(own, "used_closed")),
        "best_chi2_precision": share(single, lambda t: t.best_chi2 == t.label, lambda t: True),
        "naive_best_chi2_precision": share(
            single, lambda t: t.naive == t.label, lambda t: t.naive != "none"
        ),
        "naive_best_chi2_false_alarm_rate": share(
            nothing, lambda t: t.naive != "none", lambda t: True
        ),
        "bic_precision": share(single, lambda t: t.bic == t.label, lambda t: t.bic != "none"),
        "bic_false_alarm_rate": share(nothing, lambda t: t.bic != "none", lambda t: True),
        "bic_outside_named_rate": share(outside, lambda t: t.bic != "none", lambda t: True),
        "trials": len(trials),
    }


def covered(t: Trial) -> bool:
    """Whether the truth is in what was printed;

    `unknown` prints no effect of the library, so it leaves the truth out.
    """
    return t.label in t.verdict.effects


def share(
    trials: Sequence[Trial], good: Callable[[Trial], bool], among: Callable[[Trial], bool]
) -> float:
    """Share of good ones among those that count."""
    counted = [t for t in trials if among(t)]
    return sum(map(good, counted)) / max(len(counted), 1)


def median(trials: Sequence[Trial], key: str) -> float:
    """Median of a closed share over the trials that have a gap there."""
    values = [t.gaps[key] for t in trials if np.isfinite(t.gaps.get(key, np.nan))]
    return float(np.median(values)) if values else float("nan")


def matrix(trials: Sequence[Trial]) -> dict[str, dict[str, int]]:
    """What was said by what was hidden."""
    table: dict[str, Counter[str]] = {}
    for t in trials:
        row = f"{t.label}, {t.strength}" + (", withheld" if t.withheld else "")
        table.setdefault(row, Counter())[t.verdict.said] += 1
    return {row: dict(counts) for row, counts in table.items()}


def amplitudes(trials: Sequence[Trial]) -> list[dict[str, Any]]:
    """True and recovered amplitudes of the effects named rightly, in plausible scales."""
    return [
        {
            "effect": t.label,
            "strength": t.strength,
            "true": t.size,
            "found": t.amplitude[0],
            "error": t.amplitude[1],
        }
        for t in trials
        if t.amplitude is not None and is_right(t)
    ]


def smallest(case: Case, judged: Judged) -> list[dict[str, Any]]:
    """What each effect must be to be seen and named, at the centre of the box, beside the strong
    amplitude of the classes.
    """
    centre, none = np.full(judged.surfaces.dimensions, 0.5), np.zeros(len(judged.effects))
    values = judged.surfaces.mean(centre, none)[0]
    ordered = ex.in_order(case.observables, ex.experiments(case, case.observables))
    imagined = [
        replace(o, value=float(v), scatter=0.0, replicates=REPLICATES)
        for o, v in zip(ordered, values, strict=True)
    ]
    slopes = judged.surfaces.jacobian(centre, none)[:, judged.surfaces.dimensions :]
    measured = observed.measured(
        imagined, case.nuisances, judged.surfaces, slopes, judged.effects
    ).only(judged.used)
    picture = linear(judged.surfaces, measured, judged.effects, judged.used)
    return [
        {**vars(own), "strong": AMPLITUDES["strong"] * own.scale}
        for own in powers(judged.effects, picture)
    ]


def figures(trials: Sequence[Trial]) -> dict[str, Any]:
    """Rates, what was said by what was hidden, and amplitudes."""
    pools = len({t.pool for t in trials})
    return {
        **rates(trials),
        "confusion": matrix(trials),
        "amplitudes": amplitudes(trials),
        "pools": pools,
    }


def carry_out(case: Case, one: Class, most: int, there: Database) -> None:
    """The first runs of a pool that are not there yet, then spare ones where some clog or throw a
    grain off.
    """
    found = ex.experiments(case, case.observables)
    counts, before = [most] * len(found), [0] * len(found)
    while counts != before:
        asked = [own[:n] for own, n in zip(one.requests, counts, strict=True)]
        todo = [r for own in asked for r in own if not there.find([r])]
        have = Database(
            [
                *there.find([r for own in asked for r in own]),
                *run(FOLDER, todo, report=ProgressBar(sys.stderr)),
            ]
        )
        good = [
            len(observed.values_of(e, have.find(own))) for e, own in zip(found, asked, strict=True)
        ]
        spare = [max(min(most, REPLICATES) - n, 0) for n in good]
        before, counts = (
            counts,
            [min(n + more, POOL) for n, more in zip(counts, spare, strict=True)],
        )


def main() -> None:
    """Carry out the pools, or judge them."""
    case = read_case(CASE)
    everything = classes(case)
    asked = [r for c in everything for own in c.requests for r in own]
    what, *some = sys.argv[1:] or ["judge"]
    there = Database.read(POOLS) if POOLS.exists() else Database()
    if what == "run":
        most, label = int(some[0]) if some else REPLICATES, some[1] if some[1:] else ""
        chosen = [c for c in everything if c.label.startswith(label) or str(c.index) == label]
        if not chosen:
            labels = ", ".join(sorted({c.label for c in everything}))
            sys.exit(
                f"no class has the number {label} or a label that begins so: give one of {labels}"
            )
        for one in chosen:
            carry_out(case, one, most, there)
    pools = Database(
        {r.run_id: r for r in [*there.records.values(), *gather(FOLDER, asked)]}.values()
    )
    if not len(pools) or (what != "run" and not SHIPPED.exists()):
        sys.exit("no runs to judge: see the commands at the top of this file")
    pools.write(POOLS, "python -m benchmarks.hidden_effect run")
    if what == "run":
        return
    shipped = Database.read(SHIPPED)
    trials = judged_trials(case, everything, pools, shipped)
    last = [t for t in trials if t.pool in JUDGED_LAST]
    results = {
        **figures(last),
        "all_truths": figures(trials),
        "smallest": smallest(case, library(case, shipped)),
    }
    # a median over no trial is none, and JSON has no NaN
    write("hidden_effect", json.loads(json.dumps(results).replace("NaN", "null")))


def judged_trials(
    case: Case, everything: Sequence[Class], pools: Database, database: Database
) -> list[Trial]:
    """All trials; a class whose pool is too small, as most of its runs clog, is left out and said
    so.
    """
    whole, trials = library(case, database), []
    found = ex.experiments(case, case.observables)
    for index, one in enumerate(everything):
        pool = [
            observed.values_of(e, pools.find(own))
            for e, own in zip(found, one.requests, strict=True)
        ]
        if min(map(len, pool)) < REPLICATES:
            print(
                f"{one.label}, {one.strength}: only {min(map(len, pool))} complete runs of an"
                " experiment, left out",
                file=sys.stderr,
            )
            continue
        rng = np.random.default_rng(10_000 + index)
        trials += [trial(case, one, pool, whole, False, rng) for _ in range(TRIALS)]
        if one.strength in ("middling", "strong") and one.label != CONTROL:
            without = library(case, database, one.label)
            trials += [trial(case, one, pool, without, True, rng) for _ in range(TRIALS // 4)]
        print(
            one.label,
            one.strength,
            dict(Counter(t.verdict.said for t in trials if t.label == one.label)),
            file=sys.stderr,
        )
    return trials


if __name__ == "__main__":
    main()
