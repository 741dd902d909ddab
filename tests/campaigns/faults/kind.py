"""A kind of fault: what it does to a stage, and what is expected of the calibrator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tests.campaigns.faults.stage import Stage

SAME = "the next call finishes the plan"
REFUSED = "one line with a remedy, and once the cause is gone the next call finishes the plan"
REPAIRED = "the damaged record is reported and its run done again"
RETRIED = "the run is done again in the same call"
KEPT = "the run is kept with its reason and left out, and no call tries it again"
Act = Callable[[Stage], None]


@dataclass(frozen=True)
class Kind:
    """What it does to a stage, what is expected, and how often it strikes which YADE."""

    name: str
    act: Act
    expected: str
    fake: int
    real: int
    needs_mounts: bool = False


def registry(kinds: list[Kind]) -> Callable[..., Callable[[Act], Act]]:
    """A decorator that adds functions to a list of kinds."""

    def fault(
        expected: str, fake: int, real: int = 0, needs_mounts: bool = False, name: str = ""
    ) -> Callable[[Act], Act]:
        """Register a kind of fault under its name, or else the first line of its docstring."""

        def register(act: Act) -> Act:
            own = name or str(act.__doc__).splitlines()[0]
            kinds.append(Kind(own, act, expected, fake, real, needs_mounts))
            return act

        return register

    return fault
