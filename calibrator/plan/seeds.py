"""All seeds in one place: each kind of run draws from a range of its own.

A seed decides where the grains of a filling start. Two runs of one seed start alike, and what they
have in common would look like an effect, or like agreement, where it is only the same filling.
Runs under a condition have the seeds of those without, moved into the condition's own range.
"""

from __future__ import annotations

import math

from calibrator.case.case import Case
from calibrator.case.experiment import (
    CONDITION_STRIDE,
    FIRST_CONDITION_SEED,
    parts_of,
    seed_shift,
)
from calibrator.case.settings import MOST_RUNS, Replicates
from calibrator.case.vocabulary import PARAMETERS
from calibrator.errors import CalibratorError

SET_STRIDE = 100
"""Between neighbouring sets, so that a plan can gain replicates without changing the others."""
PROPOSED_SEED = 10_000_000
"""From the plan's first seed to that of the runs that an adaptive design chooses."""
SUBSTITUTE_SEED = 50_000_000
"""From the seed of a clogged run to that of its substitute."""
EXPERIMENT_STRIDE = 1_000_000
"""Between experiments of a diagnosis: a filling must not be the same in two of them."""
CHANGE_SEED = 200_000_000
"""From the diagnosis' first seed to that of the fingerprints."""
CONFIRM_SEED = 400_000_000
"""From the diagnosis' first seed to that of the runs that confirm an explanation."""
CANDIDATES = 5
"""Most candidates that are verified: the compromise and four individuals."""
EXPLANATIONS = 100
"""More explanations than are ever confirmed."""


def plan_seed(case: Case, index: int, replicate: int = 0) -> int:
    """Seed of a replicate of the plan's set number `index`."""
    return case.plan.seed + SET_STRIDE * index + replicate


def proposed_seed(case: Case, made: int) -> int:
    """Seed of the next run of an adaptive design that has made so many.

    Raises CalibratorError where these are more than a design can make sense of.
    """
    if made >= MOST_RUNS:
        raise CalibratorError(f"{made:,} runs are too many for an adaptive design: take a plan")
    return case.plan.seed + PROPOSED_SEED + made


def in_experiment(case: Case, experiment: str, seed: int) -> int:
    """Seed of an experiment's run that has this seed where there is no condition."""
    return seed + seed_shift(experiment, case.conditions)


def substitute_seed(seed: int, limit: int = 1) -> int | None:
    """Seed of the substitute of a clogged run; None where that is one itself, the last allowed."""
    without = seed
    if seed >= FIRST_CONDITION_SEED:  # of a run under a condition
        without = (seed - FIRST_CONDITION_SEED) % CONDITION_STRIDE
    return seed + SUBSTITUTE_SEED if without < SUBSTITUTE_SEED * limit else None


def verification_seed(fresh: Replicates, candidate: int, replicate: int = 0) -> int:
    """Seed of a fresh run of candidate number `candidate`, of [verify] or of [validate]."""
    return fresh.seed + SET_STRIDE * candidate + replicate


def experiment_seed(case: Case, experiment: int, index: int, replicate: int = 0) -> int:
    """Seed of a diagnosis' run of the model as it is, at set number `index`."""
    return case.diagnosis.seed + EXPERIMENT_STRIDE * experiment + SET_STRIDE * index + replicate


def change_seed(case: Case, experiment: int, index: int) -> int:
    """Seed of a fingerprint's run number `index`: the sets first, then those of each effect."""
    return experiment_seed(case, experiment, index) + CHANGE_SEED


def confirm_seed(case: Case, experiment: int, explanation: int, replicate: int = 0) -> int:
    """Seed of a run that is to confirm an explanation."""
    return experiment_seed(case, experiment, explanation, replicate) + CONFIRM_SEED


def ranges(case: Case) -> dict[str, range]:
    """The seeds that each kind of run of a case may have, half-open, by what they are in words."""
    problem, found = case.problem, _without_conditions(case)
    kinds = list(found)  # of the plan, and then of verification and validation
    for names, own in (
        (problem.experiments, [k for k in kinds if k != "the validation"]),
        (problem.held_out_experiments, ["the validation"]),
    ):
        for experiment in (e for e in names if parts_of(e)[1]):
            shift = in_experiment(case, experiment, 0)
            moved = {k: range(found[k].start + shift, found[k].stop + shift) for k in own}
            found |= {f"{kind} ({experiment})": seeds for kind, seeds in moved.items()}
    return found | _of_diagnosis(case)


def _without_conditions(case: Case) -> dict[str, range]:
    """The seeds of the plan, of verification and of validation where there is no condition."""
    plan = range(plan_seed(case, 0), plan_seed(case, _sets(case) - 1, case.plan.replicates))
    found = {"the plan": plan}
    if case.plan.design == "adaptive":
        first = proposed_seed(case, 0)
        found["the runs that the design proposes"] = range(first, first + MOST_RUNS)
    else:
        first, end = plan.start + SUBSTITUTE_SEED, plan.stop + SUBSTITUTE_SEED
        found["the substitutes of clogged runs"] = range(first, end)
    found["the verification"] = _fresh(case.verify)
    found["the validation"] = _fresh(case.validate)
    return found


def _of_diagnosis(case: Case) -> dict[str, range]:
    """The seeds of a diagnosis' runs, by experiment."""
    own, found = case.diagnosis, dict[str, range]()
    changes = own.sets + len(own.effects) * own.effect_sets
    for e in range(_experiments(case)):
        found[f"the diagnosis (experiment {e + 1})"] = range(
            experiment_seed(case, e, 0), experiment_seed(case, e, own.sets - 1, own.replicates)
        )
        found[f"the fingerprints (experiment {e + 1})"] = range(
            change_seed(case, e, 0), change_seed(case, e, changes)
        )
        found[f"the confirming runs (experiment {e + 1})"] = range(
            confirm_seed(case, e, 0), confirm_seed(case, e, EXPLANATIONS)
        )
    return found


def overlapping(case: Case) -> list[str]:
    """A sentence, with what to change, for each two kinds of run whose seeds could meet.

    Empty where all is well. Neighbouring sets and candidates must not share seeds either.
    """
    found, sentences = ranges(case), _too_many_replicates(case)
    if found["the plan"].stop > SUBSTITUTE_SEED:
        sentences.append(
            f"the seeds of the plan ({_said(found['the plan'])}) reach those of substitutes, which"
            f" begin at {SUBSTITUTE_SEED:,}: lower plan.seed, or ask for fewer sets"
        )
    if any("@" in kind for kind in found):
        # a seed beyond says for which condition a run was made (see `experiment.condition_of_seed`)
        sentences += [
            f"the seeds of {kind} ({_said(found[kind])}) reach those of conditions, which begin at"
            f" {FIRST_CONDITION_SEED:,}: lower {_key(kind)}"
            for kind in ("the verification", "the validation")
            if found[kind].stop > FIRST_CONDITION_SEED
        ]
    ordered = sorted(found.items(), key=lambda kind: (kind[1].start, kind[1].stop))
    for i, (one, low) in enumerate(ordered):
        for other, high in ordered[i + 1 :]:
            if high.start >= low.stop:
                break
            sentences.append(
                f"the seeds of {one} ({_said(low)}) meet those of {other} ({_said(high)}):"
                f" {_remedy(case, one, other, low.stop - high.start)}"
            )
    largest = int(PARAMETERS["seed"].high or 0)
    for kind, own in found.items():
        if own.stop - 1 > largest:
            sentences.append(
                f"the seeds of {kind} ({_said(own)}) are more than YADE takes, {largest:,}:"
                f" lower {_key(kind)}{_or_move_up(kind)}"
            )
    return sentences


def _sets(case: Case) -> int:
    if case.plan.design == "grid":
        return math.prod(p.samples for p in case.problem.parameters)
    return case.plan.sets


def _fresh(settings: Replicates) -> range:
    """Seeds of the compromise, and of the other candidates where any of them is run."""
    first, most = verification_seed(settings, 0), settings.spread_replicates
    others = verification_seed(settings, CANDIDATES - 1, most) if most else first
    return range(first, max(verification_seed(settings, 0, max(settings.replicates, 1)), others))


def _experiments(case: Case) -> int:
    """The most experiments that a diagnosis of the case can have."""
    return len({o.setup for o in case.observables if not o.condition}) + len(case.conditions)


def _too_many_replicates(case: Case) -> list[str]:
    """Tables whose replicates would take the seeds of the next set or candidate."""
    replicates = {"plan.replicates": case.plan.replicates if _sets(case) > 1 else 0}
    for key, own in (("verify", case.verify), ("validate", case.validate)):
        if own.spread_replicates:
            replicates[f"{key}.replicates"] = own.replicates
            replicates[f"{key}.spread_replicates"] = own.spread_replicates
    return [
        f"{key} = {count}: neighbouring sets would share seeds; give {SET_STRIDE} or less"
        for key, count in replicates.items()
        if count > SET_STRIDE
    ]


def _or_move_up(kind: str) -> str:
    """What else would help, where the seeds are those of a condition: the later, the larger."""
    return ", or name that condition before others in the case" if "@" in kind else ""


def _said(seeds: range) -> str:
    return f"{seeds.start:,} to {seeds.stop - 1:,}"


def _key(kind: str) -> str:
    """The key of the case file that a kind's seeds start from."""
    kind = kind.partition(" (")[0]
    tables = {
        "the verification": "verify",
        "the validation": "validate",
        "the diagnosis": "diagnosis",
        "the fingerprints": "diagnosis",
        "the confirming runs": "diagnosis",
    }
    return f"{tables.get(kind, 'plan')}.seed"


def _remedy(case: Case, one: str, other: str, common: int) -> str:
    """What keeps two kinds apart, the second of which begins so many seeds too early."""
    if _key(one) == _key(other):
        return "ask for fewer sets or conditions"
    now = {
        "plan.seed": case.plan.seed,
        "verify.seed": case.verify.seed,
        "validate.seed": case.validate.seed,
        "diagnosis.seed": case.diagnosis.seed,
    }[_key(other)]
    return f"raise {_key(other)} from {now} to {now + common}, or move {_key(one)}"
