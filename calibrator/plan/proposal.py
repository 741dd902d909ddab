"""What an adaptive design does next, in full or cheap."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calibrator.case.problem import Problem
from calibrator.responses.cokriging import CheapRuns
from calibrator.responses.fidelities import told
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.targets import bands


@dataclass(frozen=True, eq=False)
class Proposal:
    """What to do next.

    kind : "explore" or "confirm" (run `points` (k, d)), "confirmed" (the latest runs at
    `recommended` meet every target), "unreachable" or "budget" (both stop without); recommended :
    (d,) the set to take; chance : its probability of being confirmed; sentence : all that in words;
    cheap : whether the runs are those of the case's cheaper version.
    """

    kind: str
    points: np.ndarray
    recommended: np.ndarray
    chance: float
    sentence: str
    cheap: bool = False

    @property
    def stops(self) -> bool:
        """Whether no further run is asked for."""
        return self.kind in ("confirmed", "unreachable", "budget")


@dataclass(frozen=True, eq=False)
class Cheaper:
    """Runs of a cheaper version of a case, and the cost of one as a share of a full one's."""

    runs: CheapRuns
    cost: float

    def instead(self, problem: Problem, interpolant: Interpolant, proposal: Proposal) -> Proposal:
        """The proposal, of a cheap run where that tells more for its cost.

        What a run tells is by how much it lowers the variances of the responses at its set, those
        of the targets in squares of their bands.
        """
        if proposal.kind != "explore":
            return proposal
        band = bands(problem.targets, interpolant.noise, 1)
        cheap, full = ((own / band**2).sum() for own in told(interpolant, proposal.points))
        if cheap <= self.cost * full:
            return proposal
        words = proposal.sentence.replace("a run", "a cheap run", 1)
        return replace(proposal, cheap=True, sentence=words)
