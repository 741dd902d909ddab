"""Shares of trials that come in laboratories, with intervals that are never of zero width.

Trials of one laboratory share its runs of YADE, so they are no independent evidence: of six
laboratories, each judged ten times, one knows six things and not sixty.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np
from scipy.stats import beta


def exact(hits: float, total: float, level: float = 0.95) -> tuple[float, float]:
    """Two-sided interval of a share (Clopper and Pearson, Biometrika 26 (1934) 404-413).

    Numbers need not be whole. No trial at all leaves everything from 0 to 1 open.
    """
    tail = (1 - level) / 2
    low = float(beta.ppf(tail, hits, total - hits + 1)) if hits > 0 else 0.0
    high = float(beta.ppf(1 - tail, hits + 1, total - hits)) if hits < total else 1.0
    return low, high


def upper(hits: int, total: int) -> float:
    """One-sided 95 % bound from above, by the same authors."""
    return exact(hits, total, level=0.9)[1]


def effective_size(laboratories: Sequence[Hashable]) -> float:
    """How many independent trials these trials are worth: about as many as laboratories.

    n over the design effect (Rao and Scott, Biometrics 48 (1992) 577-585) at its largest, where all
    trials of a laboratory agree: n^2 over the sum of the squared sizes of the laboratories. An
    intraclass correlation estimated from a dozen laboratories would shorten intervals, and they
    then hold the truth in 86 to 94 of 100 where it is large and the share is near one; so do those
    of a bootstrap, which have no width at all where everything agrees. These hold it in 96 or more.
    """
    sizes = np.array([len(own) for own in _groups([True] * len(laboratories), laboratories)])
    return float(sizes.sum() ** 2 / (sizes**2).sum()) if len(sizes) else 0.0


def interval(hits: Sequence[bool], laboratories: Sequence[Hashable]) -> tuple[float, float]:
    """95 % interval of the share of hits: the exact one of as many trials as these are worth."""
    size = effective_size(laboratories)
    return exact(size * sum(hits) / max(len(hits), 1), size)


def laboratories_with(
    hits: Sequence[bool], laboratories: Sequence[Hashable], whole: bool
) -> tuple[int, int]:
    """Laboratories with a hit in all of their trials, or in any of them; and their number."""
    groups = _groups(hits, laboratories)
    return sum(bool(own.all() if whole else own.any()) for own in groups), len(groups)


def _groups(hits: Sequence[bool], laboratories: Sequence[Hashable]) -> list[np.ndarray]:
    found: dict[Hashable, list[bool]] = {}
    for hit, laboratory in zip(hits, laboratories, strict=True):
        found.setdefault(laboratory, []).append(hit)
    return [np.array(own, bool) for own in found.values()]
