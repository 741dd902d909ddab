"""Rival explanations of a gap: the model as it is, each effect added, pairs, and an explanation
that nobody has thought of.

Each explanation is fitted with all parameters free, because recalibration hides part of every
effect, and weighed by its evidence (Laplace's approximation; MacKay, Information Theory, Inference,
and Learning Algorithms, 2003, ch. 28).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize, stats

from calibrator.diagnosis.surfaces import Surfaces

Function = Callable[[np.ndarray], np.ndarray]

# amplitude, in plausible scales: the surfaces are made from up to 1.5 and extrapolate beyond
LARGEST = 2.5

# of the explanation that nobody has thought of, in seed scatters of one run
UNKNOWN_SPREADS = (1.0, 2.0, 4.0)
STARTS = (0.15, 0.5, 0.85)  # of each parameter, in its range

# the errors of the surfaces depend on where they are used; this converges in two
VARIANCE_ROUNDS = 2


@dataclass(frozen=True)
class Effect:
    """A candidate: its column, its sign, and the plausible size that amplitudes count (negative
    where it lowers its column).

    least, largest : amplitudes that its column can take; excludes : columns that it cannot be
    combined with; control : whether no laboratory can remove it, so that nothing could refute its
    name.
    """

    name: str
    sign: str
    scale: float
    least: float = -LARGEST
    largest: float = LARGEST
    excludes: tuple[str, ...] = ()
    control: bool = False

    @property
    def bounds(self) -> tuple[float, float]:
        """Amplitudes that are fitted, in plausible scales."""
        return (0.0 if self.sign == "+" else self.least, self.largest)


@dataclass(frozen=True, eq=False)
class Measured:
    """Observables (n,), means over replicates (n,), with their covariance (n, n): scatter, and
    errors of the metrology.
    """

    values: np.ndarray
    covariance: np.ndarray
    replicates: np.ndarray

    def only(self, kept: np.ndarray) -> Measured:
        """The observables at indices or where a mask is true."""
        return Measured(
            self.values[kept], self.covariance[np.ix_(kept, kept)], self.replicates[kept]
        )


@dataclass(frozen=True, eq=False)
class Explanation:
    """One fitted model.

    effects : names of the added effects, () for the model as it is; unit (d,) parameters in their
    ranges; amplitude (k,) in plausible scales, zero where not added, with standard errors (nan
    where not added, inf where it shows nowhere); chi2 with its degrees of freedom; residual (n,)
    and covariance (n, n) at the fit; log_evidence; spread (d + a, d + a) covariance of the fitted
    parameters and the a added amplitudes.
    """

    effects: tuple[str, ...]
    unit: np.ndarray
    amplitude: np.ndarray
    amplitude_error: np.ndarray
    chi2: float
    degrees: int
    residual: np.ndarray
    covariance: np.ndarray
    log_evidence: float
    spread: np.ndarray

    @property
    def deviance(self) -> float:
        """Minus twice the log likelihood, but for a constant: what to compare explanations by, as
        their errors differ.
        """
        return self.chi2 + float(np.linalg.slogdet(self.covariance)[1])

    def adequacy(self, noise_degrees: float) -> float:
        """Probability of as large a chi2 if this explanation is true."""
        return tail(self.chi2, self.degrees, noise_degrees)


def tail(chi2: float, degrees: int, noise_degrees: float) -> float:
    """Probability of a chi2 beyond this one;

    Hotelling's T2 for a covariance estimated with so many degrees of freedom.
    """
    m, nu = degrees, noise_degrees
    if not np.isfinite(nu) or nu <= m:
        return float(stats.chi2.sf(chi2, m))
    return float(stats.f.sf(chi2 * (nu - m + 1) / (nu * m), m, nu - m + 1))


def explain(
    surfaces: Surfaces,
    measured: Measured,
    effects: Sequence[Effect],
    added: tuple[int, ...] = (),
    kept: np.ndarray | None = None,
    unknown: float = 0.0,
) -> Explanation:
    """Fit parameters and the amplitudes of the added effects (indices) to the measured observables.

    kept : indices of the surfaces' observables that were measured, all unless given; unknown : seed
    scatters by which every observable may differ for reasons outside the library.
    """
    kept = np.arange(len(surfaces.noise)) if kept is None else kept
    index = np.ix_(kept, kept)
    d = surfaces.dimensions
    low = np.concatenate([np.zeros(d), [effects[k].bounds[0] for k in added]])
    high = np.concatenate([np.ones(d), [effects[k].bounds[1] for k in added]])
    own = unknown**2 * np.diag(np.diag(surfaces.noise)[kept])

    def split(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        amplitude = np.zeros(len(effects))
        amplitude[list(added)] = x[d:]
        return x[:d], amplitude

    def left(x: np.ndarray) -> np.ndarray:
        return np.asarray(measured.values - surfaces.mean(*split(x))[0, kept])

    def slope(x: np.ndarray) -> np.ndarray:
        columns = [*range(d), *(d + k for k in added)]
        return np.asarray(surfaces.jacobian(*split(x))[np.ix_(kept, columns)])

    best = np.concatenate([np.full(d, 0.5), np.zeros(len(added))])
    starts = _starts(d, added, low, high)
    for _ in range(VARIANCE_ROUNDS):
        scatter = surfaces.extra_scatter(split(best)[1])[kept] / measured.replicates
        covariance = (
            measured.covariance + surfaces.error(*split(best))[index] + np.diag(scatter) + own
        )
        root = linalg.cholesky(covariance, lower=True)
        whitening = linalg.solve_triangular(root, np.eye(len(root)), lower=True)
        best = _least_squares(left, slope, whitening, starts, low, high)
        starts = [best]
    residual, jacobian = left(best), slope(best)
    white, white_jacobian = whitening @ residual, whitening @ jacobian
    chi2 = float(white @ white)
    unit, amplitude = split(best)
    error = np.full(len(effects), np.nan)
    curvature = white_jacobian.T @ white_jacobian
    spread = np.linalg.pinv(curvature)
    variance = np.diag(spread)[d:]
    # what shows nowhere is not known at all
    error[list(added)] = np.sqrt(np.where(variance > 0, variance, np.inf))
    evidence = _log_evidence(
        chi2, root, curvature, d, [(effects[k], amplitude[k], error[k]) for k in added]
    )
    return Explanation(
        tuple(effects[k].name for k in added),
        unit,
        amplitude,
        error,
        chi2,
        max(len(residual) - len(best), 1),
        residual,
        covariance,
        evidence,
        spread,
    )


def _starts(d: int, added: tuple[int, ...], low: np.ndarray, high: np.ndarray) -> list[np.ndarray]:
    """A few places in the box, each with no amplitude, and with middling ones of either sign."""
    amplitudes = [np.zeros(len(added))] + [np.full(len(added), s) for s in (1.0, -1.0)] * bool(
        added
    )
    starts = [np.concatenate([np.full(d, share), a]) for share in STARTS for a in amplitudes]
    return [s for s in starts if (s >= low).all() and (s <= high).all()]


def _least_squares(
    left: Function,
    slope: Function,
    whitening: np.ndarray,
    starts: Sequence[np.ndarray],
    low: np.ndarray,
    high: np.ndarray,
) -> np.ndarray:
    """Best of bounded least-squares fits (Branch, Coleman & Li, SIAM J.

    Sci. Comput. 21 (1999) 1-23) from several starts.
    """

    def white(x: np.ndarray) -> np.ndarray:
        return np.asarray(whitening @ left(x))

    def white_slope(x: np.ndarray) -> np.ndarray:
        return np.asarray(-whitening @ slope(x))

    inside = [np.clip(s, low + 1e-6, high - 1e-6) for s in starts]
    fits = [
        optimize.least_squares(
            white, s, white_slope, (low, high), x_scale=1.0, xtol=1e-8, ftol=1e-8
        )
        for s in inside
    ]
    return np.asarray(min(fits, key=lambda fit: fit.cost).x)


def _log_evidence(
    chi2: float,
    root: np.ndarray,
    curvature: np.ndarray,
    d: int,
    added: Sequence[tuple[Effect, float, float]],
) -> float:
    """Laplace's log evidence: parameters uniform over their ranges, amplitudes normal with their
    plausible scale.

    The prior's curvature of one per squared range keeps a parameter that nothing measures from
    counting as known beyond its range. An effect of one sign has a half-normal prior, and only the
    positive half of the peak counts.
    """
    prior = np.diag([12.0] * d + [1.0] * len(added))  # 12: a uniform range has a variance of 1/12
    logdet = float(np.linalg.slogdet((curvature + prior) / (2 * np.pi))[1])
    log = (
        -chi2 / 2
        - len(root) / 2 * np.log(2 * np.pi)
        - float(np.log(np.diag(root)).sum())
        - logdet / 2
    )
    for effect, amplitude, error in added:
        log += -(amplitude**2) / 2 - np.log(2 * np.pi) / 2
        if effect.sign == "+":
            log += np.log(2) + float(stats.norm.logcdf(amplitude / error))
    return log


@dataclass(frozen=True, eq=False)
class Rivals:
    """All explanations of one set of measurements: none, each effect, and the unknown one with its
    log evidence.
    """

    none: Explanation
    single: tuple[Explanation, ...]
    log_unknown: float

    @property
    def posterior(self) -> np.ndarray:
        """Probabilities (k + 2,) of none, of each effect, and of the unknown explanation, equally
        likely beforehand.
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
