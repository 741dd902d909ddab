"""All explanations of a gap side by side: none, each effect, pairs, one nobody has thought of."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.diagnosis.explanations import Effect, Explanation, Measured, explain
from calibrator.diagnosis.surfaces import Surfaces

# of the explanation that nobody has thought of, in seed scatters of one run
UNKNOWN_SPREADS = (1.0, 2.0, 4.0)


@dataclass(frozen=True, eq=False)
class Rivals:
    """All explanations of one set of measurements.

    Attributes
    ----------
    none : the model as it is.
    single : each of k effects.
    log_unknown : log evidence of the explanation that nobody has thought of.
    """

    none: Explanation
    single: tuple[Explanation, ...]
    log_unknown: float

    @property
    def posterior(self) -> np.ndarray:
        """Probabilities (k + 2,) of none, each effect and the unknown one.

        They are equally likely beforehand.
        """
        logs = np.array(
            [self.none.log_evidence, *(e.log_evidence for e in self.single), self.log_unknown]
        )
        weights = np.exp(logs - logs.max())
        return np.asarray(weights / weights.sum())


def rivals(
    surfaces: Surfaces,
    measured: Measured,
    effects: Sequence[Effect],
    kept: np.ndarray | None = None,
) -> Rivals:
    """Fit every explanation to the measurements."""
    none = explain(surfaces, measured, effects, kept=kept)
    single = tuple(explain(surfaces, measured, effects, (k,), kept) for k in range(len(effects)))
    unknown = [
        explain(surfaces, measured, effects, (), kept, spread).log_evidence
        for spread in UNKNOWN_SPREADS
    ]
    return Rivals(none, single, float(np.logaddexp.reduce(unknown) - np.log(len(unknown))))


def pairs(
    surfaces: Surfaces,
    measured: Measured,
    effects: Sequence[Effect],
    kept: np.ndarray | None = None,
) -> list[Explanation]:
    """Every pair of effects that can be combined, the likeliest first."""
    fits = [
        explain(surfaces, measured, effects, (i, j), kept)
        for i, j in itertools.combinations(range(len(effects)), 2)
        if effects[j].name not in effects[i].excludes and effects[i].name not in effects[j].excludes
    ]
    return sorted(fits, key=lambda fit: fit.deviance)


def otherwise(
    surfaces: Surfaces,
    measured: Measured,
    effects: Sequence[Effect],
    uncertain: Sequence[Effect],
    kept: np.ndarray | None = None,
) -> Explanation | None:
    """The likeliest fit with one uncertain fixed value free, None where there is none.

    uncertain : these values, which follow the effects in the surfaces. What is stated for their
    errors bounds nothing here: a value that the case fixes may be plainly wrong.
    """
    everything, first = [*effects, *uncertain], len(effects)
    found = [
        explain(surfaces, measured, everything, (first + i,), kept) for i in range(len(uncertain))
    ]
    return min(found, key=lambda fit: fit.deviance, default=None)
