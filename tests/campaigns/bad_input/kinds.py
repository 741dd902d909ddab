"""Bad input on purpose: what is damaged, and what must hold for each of it.

test_kinds.py uses a few hundred of each kind, campaign.py 100,000 in all. Every input must be
accepted, and then mean what it says, or be refused with one line. Every kind of free text carries
code that leaves a mark if anything runs it. No YADE is started.
"""

import contextlib
import signal
from collections.abc import Iterator
from typing import Any

from tests.campaigns.bad_input import asked, left, written
from tests.campaigns.bad_input.rules import Kind, require
from tests.campaigns.bad_input.yard import Yard

KINDS: dict[str, Kind] = {**written.KINDS, **left.KINDS, **asked.KINDS}
# after which one input counts as a hang, on a machine that may be busy with simulations
SECONDS = 20.0


class Hang(BaseException):
    """Raised inside an input that takes too long."""


@contextlib.contextmanager
def time_limit(seconds: float = SECONDS) -> Iterator[None]:
    """Raise Hang in the body after so many seconds."""

    def ring(*_: Any) -> None:
        raise Hang

    old = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)


def use(yard: Yard, name: str, given: Any) -> None:
    """Use one input within the time limit; raises whatever goes wrong."""
    marks = yard.executed()
    with time_limit():
        KINDS[name].use(yard, given)
    require(yard.executed() == marks, "code of the input was run")
