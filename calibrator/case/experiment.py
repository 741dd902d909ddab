"""Experiments: what one run simulates, a set-up as it is or under one of the case's conditions.

The name of an experiment is that of its set-up, or setup@condition; a response that is measured
there has the key experiment.response. Runs of a set-up under several conditions differ in little
else, so that the seeds of each condition have a range of their own: two runs of one seed start
alike, and what they have in common would look like an effect of the condition.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from calibrator.case.values import Value
from calibrator.case.vocabulary import SETUPS

FIRST_CONDITION_SEED = 600_000_000
"""Added to the seeds of the first condition: beyond all others, but for those a case puts there."""
CONDITION_STRIDE = 100_000_000
"""Between conditions; a plan, its proposals and the substitutes of clogged runs stay below it."""


@dataclass(frozen=True)
class Condition:
    """A variant of a set-up that was measured as well, such as a wider neck.

    values : the parameters that differ from the set-up's own.
    """

    setup: str
    values: dict[str, Value]


def experiment_name(setup: str, condition: str = "") -> str:
    """setup, or setup@condition where there is one.

    >>> experiment_name("hourglass"), experiment_name("hourglass", "wide_neck")
    ('hourglass', 'hourglass@wide_neck')
    """
    return f"{setup}@{condition}" if condition else setup


def parts_of(experiment: str) -> tuple[str, str]:
    """Set-up and condition of an experiment; the condition is "" where there is none.

    >>> parts_of("hourglass@wide_neck")
    ('hourglass', 'wide_neck')
    """
    setup, _, condition = experiment.partition("@")
    return setup, condition


def ordered(names: Iterable[str], conditions: Mapping[str, Condition]) -> list[str]:
    """These experiments, each once: set-ups as in the contract, then conditions as in the case."""
    known = [*SETUPS, *(experiment_name(c.setup, name) for name, c in conditions.items())]
    wanted = set(names)
    return [name for name in known if name in wanted]


def seed_shift(experiment: str, conditions: Mapping[str, Condition]) -> int:
    """What is added to the seeds of an experiment's runs; 0 where it has no condition.

    It goes by the place of the condition in the case: one that is added at the end changes no run.
    """
    _, condition = parts_of(experiment)
    if not condition:
        return 0
    return FIRST_CONDITION_SEED + CONDITION_STRIDE * list(conditions).index(condition)


def condition_of_seed(seed: int, conditions: Mapping[str, Condition]) -> str:
    """The condition in whose range a seed lies; "" for none.

    A seed says so only of runs that a plan has made; see `responses.table.experiment_of`.
    """
    place = (seed - FIRST_CONDITION_SEED) // CONDITION_STRIDE
    return list(conditions)[place] if 0 <= place < len(conditions) else ""
