"""When a plan is not worth going on with: its first runs have all failed, and all alike."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from calibrator.case.vocabulary import STATUSES
from calibrator.errors import CalibratorError
from calibrator.runs.folder import RETRIED

FEWEST = 8
"""Runs that must have failed alike before the others are not started."""

NEVER_FUTILE = ("ok", "clogged")
"""A clogged run says something of its parameters, and a smaller friction may flow."""


@dataclass(frozen=True)
class End:
    """How a run ended: its status, and why in words."""

    status: str
    reason: str

    @property
    def likeness(self) -> tuple[str, str]:
        """What ends of the same cause share: all but the numbers."""
        return self.status, re.sub(r"[-+.\d]+(e[-+]?\d+)?", "#", self.reason)


def refuse_futile(ends: Sequence[End], total: int | None) -> None:
    """Raise CalibratorError where at least FEWEST of `total` runs have ended, all of them alike.

    A plan of no more runs than that is carried out whatever becomes of them; so is one where
    `total` is None.
    """
    if total is None or total <= FEWEST or len(ends) < FEWEST:
        return
    first = ends[0]
    if first.status in NEVER_FUTILE or len({e.likeness for e in ends}) > 1:
        return
    remedy = "correct the case"
    if first.status not in RETRIED:
        remedy = STATUSES[first.status].partition("; ")[2]
    raise CalibratorError(
        f"the first {len(ends)} of {total} runs all failed alike, {first.status}:"
        f" {first.reason or STATUSES[first.status]}; no further run is started: {remedy}, or add"
        " --go-on to make the others nevertheless"
    )
