"""A laboratory with a secret: YADE runs in which an effect is hidden, and the score afterwards.

    python -m tests.campaigns.hidden.laboratory make FOLDER [--hide NAME] [--seed N]
    calibrator diagnose FOLDER/case.toml
    python -m tests.campaigns.hidden.laboratory score FOLDER

The first draws a truth, publishes its hash, runs it and writes the lab file, which is all that the
second sees; the third opens the seal and compares.

NAME is a column of the library, "none", "soft_grains", "fast_lift" or "vibration" (outside the
library); without it, it is drawn. So is the seed of the truth unless N is given: whoever knows N
and NAME knows the truth. The laboratory has seeds of its own, a time step of 0.7 and a stiffness of
twice the model's, grains of slightly different size, errors of metrology within a factor of two of
what the case's nuisance table states, and errors of the day (errors.py).
"""

import argparse
import hashlib
import json
import secrets
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.case.case import Case
from calibrator.case.lab import WITH_CONDITION, Nuisance, Observable
from calibrator.case.physics import rayleigh_time, time_step
from calibrator.case.toml import read_case
from calibrator.case.vocabulary import EFFECTS, RESPONSES
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis import observed
from calibrator.diagnosis.explanations import Effect
from calibrator.diagnosis.uncertain import WIDE, uncertain
from calibrator.files import parse_json, read_text, write_text
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar
from tests.campaigns.hidden.errors import errors_of

REPO = Path(__file__).resolve().parents[3]
CASE = REPO / "cases" / "missing_effect.toml"
# the runs that every diagnosis of this case starts from
SHIPPED = REPO / "grid" / "missing_effect.csv"
REPLICATES = 3
STIFFER, FINER = 2.0, 0.7  # Young's modulus and time step of the laboratory, over the model's
JITTER = 0.03  # coefficient of variation of its grains' radius
# What no effect of the library does: parameters that the case keeps fixed take another value in the
# laboratory. The bench vibrates with the acceleration of gravity until most of a discharge or a
# lift is over.
OUTSIDE = {
    "soft_grains": {"young_modulus": 4e4},
    "fast_lift": {"lift_speed": 0.16},
    "vibration": {"shaking": 1.0, "shaking_time": 0.6},
}
# runs of laboratories; hidden_effect.py has those above
LAB_SEED, SEED_STRIDE, SEEDS = 900_000_000, 10_000, 20_000


def truth_of(case: Case, hidden: dict[str, float], rng: np.random.Generator) -> dict[str, Any]:
    """A truth: parameters from the inner part of the box, and what is hidden.

    hidden : amplitudes by column, or an outside effect
    """
    unit = rng.uniform(0.2, 0.8, len(case.problem.names))
    return {
        "parameters": dict(zip(case.problem.names, map(float, ex.point(case, unit)), strict=True)),
        "hidden": hidden,
    }


def hidden_effect(case: Case, hide: str | None, rng: np.random.Generator) -> dict[str, float]:
    """What is asked for, at an amplitude that is drawn; None draws the effect as well."""
    effects = {e.name: e for e in ex.library(case)}
    if hide is None:
        return drawn_effect(case, rng)
    if hide in effects:
        return sized(effects[hide], float(rng.uniform(0.8, 1.5)), rng)
    return {} if hide == "none" else {hide: 1.0}


def drawn_effect(case: Case, rng: np.random.Generator) -> dict[str, float]:
    """Nothing, or an effect of the library at 0.5 to 1.5 times its plausible size."""
    effects = ex.library(case)
    choice = int(rng.integers(-1, len(effects)))
    return {} if choice < 0 else sized(effects[choice], float(rng.uniform(0.5, 1.5)), rng)


def sized(effect: Effect, amplitude: float, rng: np.random.Generator) -> dict[str, float]:
    """An effect's column at an amplitude, of either sign where both make sense."""
    sign = 1 if effect.sign == "+" else int(rng.choice([-1, 1]))
    return {effect.name: ex.column_value(effect, sign * amplitude)}


def laboratory_requests(
    case: Case,
    truth: dict[str, Any],
    found: Sequence[ex.Experiment],
    first_seed: int,
    replicates: int,
) -> list[list[Request]]:
    """Runs of the laboratory, a list per experiment."""
    hidden = dict(truth["hidden"])
    outside = [OUTSIDE[name] for name in list(hidden) if name in OUTSIDE and hidden.pop(name)]
    modulus = float(case.problem.fixed["young_modulus"]) * STIFFER
    extra: dict[str, float] = {
        "young_modulus": modulus,
        "rayleigh_fraction": finer_fraction(case, found[0]),
    }
    # clumps of several sizes are not possible
    if not hidden.keys() & {"clump_aspect", "size_spread"}:
        extra["size_spread"] = JITTER
    for values in outside:
        extra.update(values)
    at = np.array([truth["parameters"][n] for n in case.problem.names])
    return [
        [
            ex.request(case, e, at, first_seed + 1000 * i + j, {**hidden, **extra})
            for j in range(replicates)
        ]
        for i, e in enumerate(found)
    ]


def finer_fraction(case: Case, experiment: ex.Experiment) -> float:
    """Fraction of the laboratory's Rayleigh time that is FINER times the step of the model.

    The model's grains are softer.
    """
    centre = ex.point(case, np.full(len(case.problem.names), 0.5))
    asked = ex.request(case, experiment, centre, 1)
    model = {n: float(v) for n, v in asked.parameters.items() if not isinstance(v, str)}
    stiff = {
        n: np.array(v)
        for n, v in {**model, "young_modulus": model["young_modulus"] * STIFFER}.items()
    }
    return FINER * time_step(model) / float(rayleigh_time(stiff))


def small_effects(nuisances: Sequence[Nuisance], draws: dict[str, float]) -> dict[str, float]:
    """Columns of the nuisances that are a small effect of either sign.

    The spread of sizes is JITTER in every laboratory.
    """
    return {
        n.effect: n.error * draws[n.name]
        for n in nuisances
        if n.effect and n.effect != "size_spread"
    }


def fixed_values(case: Case, draws: dict[str, float]) -> dict[str, float]:
    """What the laboratory's grains and vessels have instead of the fixed values that may be off."""
    by_row = {n.observables: draws[n.name] for n in case.nuisances}
    found = {}
    for one in uncertain(case):
        size = float(np.clip(by_row[one.nuisance] / WIDE, one.least, one.largest))
        found[one.name] = ex.column_value(one, size)
    return found


def read_off(
    observables: Sequence[Observable],
    values: np.ndarray,
    nuisances: Sequence[Nuisance],
    draws: dict[str, float],
    days: int = 1,
) -> list[Observable]:
    """What the laboratory reports of runs (replicates, n) on some days, with errors of reading."""
    mean, scatter = values.mean(axis=0), np.zeros(values.shape[1])
    if len(values) > 1:  # a single run knows no scatter of its own
        scatter = values.std(axis=0, ddof=1)
    reported = []
    for one, m, s in zip(observables, mean, scatter, strict=True):
        for nuisance in nuisances:
            if not (nuisance.effect or nuisance.fixed) and nuisance.touches(one):
                m += (
                    draws[nuisance.name]
                    * nuisance.error
                    * (abs(m) / 100 if nuisance.unit == "%" else 1)
                )
        reported.append(
            Observable(
                one.setup,
                one.response,
                float(m),
                float(s),
                len(values),
                one.role,
                one.condition,
                days,
            )
        )
    return reported


def lab_text(observables: Sequence[Observable], notes: Sequence[str]) -> str:
    """The lab file."""
    rows = [
        f"{o.setup},{o.condition},{o.response},{o.value!r},{o.scatter!r},{o.replicates},"
        f"{RESPONSES[o.response].unit},{o.role},{o.days}"
        for o in observables
    ]
    head = ",".join([*WITH_CONDITION, "days"])
    return "".join(f"# {n}\n" for n in notes) + "\n".join([head, *rows]) + "\n"


def make(folder: Path, hide: str | None, seed: int) -> None:
    """Draw, seal, run, report."""
    case, rng = read_case(CASE), np.random.default_rng(seed)
    truth = truth_of(case, hidden_effect(case, hide, rng), rng)
    errors = errors_of(case.nuisances, seed)
    # errors of reading are added to what is reported, small effects to the laboratory's runs
    truth["metrology"] = errors.drawn(case.nuisances, rng)
    folder.mkdir(parents=True, exist_ok=True)
    seal(folder, truth)
    found = ex.experiments(case, case.observables)
    small = small_effects(case.nuisances, truth["metrology"])
    small |= fixed_values(case, truth["metrology"])
    with_small = {**truth, "hidden": _added(truth["hidden"], small)}
    asked = laboratory_requests(case, with_small, found, LAB_SEED + SEED_STRIDE * seed, REPLICATES)
    records = run(
        RunFolder((folder / "laboratory").resolve()),
        [r for own in asked for r in own],
        report=ProgressBar(sys.stderr),
    )
    Database(records).write(
        folder / "laboratory.csv", f"python -m tests.campaigns.hidden.laboratory make {folder.name}"
    )
    by_id = {r.run_id: r for r in records}
    values = [
        observed.values_of(e, [by_id[r.run_id] for r in own])
        for e, own in zip(found, asked, strict=True)
    ]
    fewest = min(map(len, values))
    if fewest < 2:
        sys.exit(
            f"{fewest} runs of an experiment ended well: such a laboratory has nothing to report;"
            " take another seed"
        )
    with_days = [
        errors.of_days(v, np.cov(v.T).reshape(2 * (v.shape[1],)), rng)
        for v in (own[:fewest] for own in values)
    ]
    reported = read_off(
        ex.in_order(case.observables, found),
        np.hstack(with_days),
        case.nuisances,
        truth["metrology"],
        min(errors.days, fewest),
    )
    _write_case(
        folder,
        case,
        lab_text(reported, ["a synthetic laboratory whose truth is sealed: see commitment.txt"]),
    )


def seal(folder: Path, truth: dict[str, Any]) -> None:
    """Write the truth, which nobody opens before the diagnosis, and its hash, which is public."""
    sealed = json.dumps({"truth": truth, "salt": secrets.token_hex(16)}, sort_keys=True)
    write_text(folder / "commitment.txt", hashlib.sha256(sealed.encode()).hexdigest() + "\n")
    write_text(folder / "sealed.json", sealed + "\n")


def _added(hidden: dict[str, float], small: dict[str, float]) -> dict[str, float]:
    return {**small, **{n: v + small.get(n, 0.0) for n, v in hidden.items()}}


def _write_case(folder: Path, case: Case, lab: str) -> None:
    text = read_text(CASE).replace(f'"{case.name}"', f'"{folder.name}"', 1)
    write_text(folder / "case.toml", text.replace("../grid/", ""))
    write_text(folder / "missing_effect_lab.csv", lab)
    shutil.copyfile(
        CASE.with_name("missing_effect_nuisances.csv"), folder / "missing_effect_nuisances.csv"
    )
    if SHIPPED.exists():
        shutil.copyfile(SHIPPED, folder / SHIPPED.name)


def score(folder: Path, results: Path) -> dict[str, Any]:
    """Open the seal: was the verdict right?"""
    sealed = read_text(folder / "sealed.json").strip()
    if hashlib.sha256(sealed.encode()).hexdigest() != read_text(folder / "commitment.txt").strip():
        sys.exit("the seal is broken: the truth is not the one whose hash was published")
    truth = parse_json(sealed)["truth"]
    found = parse_json(read_text(results / folder.name / "summary.json"))["diagnose"]
    names = [n for n in truth["hidden"] if n not in OUTSIDE]
    outside = bool(truth["hidden"].keys() & OUTSIDE.keys())
    right = {
        "no gap": not truth["hidden"],
        "named": found["effects"] == names,
        "two effects": sorted(found["effects"]) == sorted(names),
        "ambiguous": (
            names[0] in found["effects"] if names else outside and "unknown" in found["effects"]
        ),
        "unknown": outside,
    }
    outcome = {
        "truth": truth,
        "verdict": found["verdict"],
        "effects": found["effects"],
        "sentence": found["sentence"],
    }
    outcome["right"] = right.get(found["verdict"], False)
    write_text(folder / "score.json", json.dumps(outcome, indent=1) + "\n")
    return outcome


def main() -> None:
    """Make a sealed laboratory, or score a diagnosis."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", choices=("make", "score"))
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--hide", choices=(*EFFECTS, "none", *OUTSIDE), help="what to hide; drawn unless given"
    )
    parser.add_argument(
        "--seed", type=int, choices=range(SEEDS), default=secrets.randbelow(SEEDS), metavar="N"
    )
    parser.add_argument("--results", type=Path, default=REPO / "results")
    options = parser.parse_args()
    if options.what == "make":
        make(options.folder, options.hide, options.seed)
    else:
        print(json.dumps(score(options.folder, options.results), indent=1))


if __name__ == "__main__":
    main()
