"""Rival explanations of a gap: no effect, each one, pairs, and one nobody has thought of.

Each explanation is fitted with all parameters free, because recalibration hides part of every
effect, and weighed by its evidence (Laplace's approximation; MacKay, Information Theory, Inference,
and Learning Algorithms, 2003, ch. 28).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize, stats

from calibrator.diagnosis.surfaces import Surfaces

# factor within which laboratories know the errors that their observables share, and the mean square
# of that factor where its logarithm is uniform
KNOWN_WITHIN = 2.0
LIKELY = (KNOWN_WITHIN**2 - KNOWN_WITHIN**-2) / (4 * np.log(KNOWN_WITHIN))
# amplitude, in plausible scales: the surfaces are made from up to 1.5 and extrapolate beyond
LARGEST = 2.5
STARTS = (0.15, 0.5, 0.85)  # of each parameter, in its range
AT_END = 1e-4  # shares of a range, or plausible scales
# the errors of the surfaces depend on where they are used; this converges in two
VARIANCE_ROUNDS = 2


@dataclass(frozen=True)
class Effect:
    """A candidate for the missing effect.

    Attributes
    ----------
    name : its column.
    sign : "+" where only positive amplitudes make sense, "+-" where both signs do.
    scale : plausible size in the column's unit, which amplitudes count; negative where it lowers
        its column.
    least, largest : amplitudes that its column can take.
    excludes : columns that it cannot be combined with.
    control : whether no laboratory can remove it, so that nothing could refute its name.
    base : value of its column without it.
    setups : that it concerns; all that know its column where there are none.
    nuisance : what the nuisance table calls it where it is an uncertain value and no candidate.
    """

    name: str
    sign: str
    scale: float
    least: float = -LARGEST
    largest: float = LARGEST
    excludes: tuple[str, ...] = ()
    control: bool = False
    base: float = 0.0
    setups: tuple[str, ...] = ()
    nuisance: str = ""

    @property
    def bounds(self) -> tuple[float, float]:
        """Amplitudes that are fitted, in plausible scales."""
        return (0.0 if self.sign == "+" else self.least, self.largest)


@dataclass(frozen=True, eq=False)
class Measured:
    """Measurements of n observables.

    Attributes
    ----------
    values : means (n,) over replicates, each in its response's unit.
    covariance : of these (n, n): scatter, and errors of the metrology.
    replicates : number (n,) of measurements behind each mean.
    shared : standard deviations (n, m) of m errors that several observables share, each with its
        signs, as the laboratory states them; the covariance holds them LIKELY as large in square.
    """

    values: np.ndarray
    covariance: np.ndarray
    replicates: np.ndarray
    shared: np.ndarray

    def only(self, kept: np.ndarray) -> Measured:
        """The observables at indices or where a mask is true."""
        return Measured(
            self.values[kept],
            self.covariance[np.ix_(kept, kept)],
            self.replicates[kept],
            self.shared[kept],
        )


@dataclass(frozen=True, eq=False)
class Explanation:
    """One fitted model.

    Attributes
    ----------
    effects : names of the a added effects, () for the model as it is.
    unit : parameters (d,) as shares of their ranges.
    amplitude, amplitude_error : (k,) in plausible scales; zero and nan where not added, with an
        infinite error where it shows nowhere.
    chi2, degrees : of the fit, with its degrees of freedom.
    residual, covariance : (n,) and (n, n) at the fit, in the observables' units.
    log_evidence : Laplace's.
    spread : covariance (d + a, d + a) of the fitted parameters and the added amplitudes.
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
        """Minus twice the log likelihood, but for a constant.

        This and not chi2 compares explanations, as their errors differ.
        """
        return self.chi2 + float(np.linalg.slogdet(self.covariance)[1])

    def adequacy(self, noise_degrees: float) -> float:
        """Probability of as large a chi2 if this explanation is true."""
        return tail(self.chi2, self.degrees, noise_degrees)


def tail(chi2: float, degrees: int, noise_degrees: float) -> float:
    """Probability of a chi2 beyond this one.

    It is Hotelling's T2 for a covariance estimated with so many degrees of freedom (Anderson, An
    Introduction to Multivariate Statistical Analysis, 3rd ed., Theorem 5.2.2).
    """
    m, nu = degrees, noise_degrees
    if not np.isfinite(nu) or nu <= m:
        return float(stats.chi2.sf(chi2, m))
    return float(stats.f.sf(chi2 * (nu - m + 1) / (nu * m), m, nu - m + 1))


@dataclass(frozen=True, eq=False)
class _Model:
    """An explanation to be fitted, as functions of x: d parameters, then a added amplitudes.

    added : indices of the effects; kept : those of the surfaces' observables that were measured;
    unknown : covariance (n, n) of what lies outside the library; box : lower and upper ends (2, d)
    of the parameters, as shares of their ranges; pinned : index and value of one of x that is not
    fitted.
    """

    surfaces: Surfaces
    measured: Measured
    effects: Sequence[Effect]
    added: tuple[int, ...]
    kept: np.ndarray
    unknown: np.ndarray
    box: np.ndarray
    pinned: tuple[int, float] | None = None

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper end (d + a,) of x."""
        ends = [self.effects[k].bounds for k in self.added]
        low = np.concatenate([self.box[0], [low for low, _ in ends]])
        high = np.concatenate([self.box[1], [high for _, high in ends]])
        if self.pinned is not None:
            index, value = self.pinned
            low[index], high[index] = value - AT_END / 2, value + AT_END / 2
        return low, high

    def free(self, x: np.ndarray) -> int:
        """How many of x (d + a,) are fitted: one at its end cannot follow the noise."""
        low, high = self.bounds
        return int(((x > low + AT_END) & (x < high - AT_END)).sum())

    def split(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Parameters (d,) and amplitudes (k,) of all effects."""
        d, amplitude = self.surfaces.dimensions, np.zeros(len(self.effects))
        amplitude[list(self.added)] = x[d:]
        return x[:d], amplitude

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Measured less simulated (n,)."""
        mean = self.surfaces.mean(*self.split(x))[0, self.kept]
        return np.asarray(self.measured.values - mean)

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """Derivatives (n, d + a) of the simulated observables."""
        d = self.surfaces.dimensions
        columns = [*range(d), *(d + k for k in self.added)]
        return np.asarray(self.surfaces.jacobian(*self.split(x))[np.ix_(self.kept, columns)])

    def covariance(self, x: np.ndarray) -> np.ndarray:
        """Covariance (n, n) of the residual."""
        unit, amplitude = self.split(x)
        scatter = self.surfaces.extra_scatter(amplitude)[self.kept] / self.measured.replicates
        error = self.surfaces.error(unit, amplitude)[np.ix_(self.kept, self.kept)]
        return np.asarray(self.measured.covariance + error + np.diag(scatter) + self.unknown)


def explain(
    surfaces: Surfaces,
    measured: Measured,
    effects: Sequence[Effect],
    added: tuple[int, ...] = (),
    kept: np.ndarray | None = None,
    unknown: float = 0.0,
    box: np.ndarray | None = None,
    pinned: tuple[int, float] | None = None,
    near: np.ndarray | None = None,
) -> Explanation:
    """Fit parameters and the amplitudes of the added effects (indices) to the measured observables.

    kept : indices of the surfaces' observables that were measured, all unless given; unknown : seed
    scatters by which every observable may differ for reasons outside the library; box : ends (2, d)
    of the parameters, those of their ranges unless given; pinned : index among parameters and added
    amplitudes of one that is not fitted, and its value; near : parameters and added amplitudes of a
    fit that this one may lie near, from where it is sought as well.
    """
    kept = np.arange(len(surfaces.noise)) if kept is None else kept
    own = unknown**2 * np.diag(np.diag(surfaces.noise)[kept])
    ends = np.repeat([[0.0], [1.0]], surfaces.dimensions, axis=1) if box is None else box
    model = _Model(surfaces, measured, effects, added, kept, own, ends, pinned)
    best, covariance, root, whitening = _fitted(model, near)
    d, residual = surfaces.dimensions, model.residual(best)
    white, white_slopes = whitening @ residual, whitening @ model.slopes(best)
    chi2 = float(white @ white)
    unit, amplitude = model.split(best)
    error = np.full(len(effects), np.nan)
    curvature = white_slopes.T @ white_slopes
    spread = np.linalg.pinv(curvature)
    variance = np.diag(spread)[d:]
    # what shows nowhere is not known at all
    error[list(added)] = np.sqrt(np.where(variance > 0, variance, np.inf))
    sizes = [(effects[k], amplitude[k], error[k]) for k in added]
    return Explanation(
        effects=tuple(effects[k].name for k in added),
        unit=unit,
        amplitude=amplitude,
        amplitude_error=error,
        chi2=chi2,
        degrees=max(len(residual) - model.free(best), 1),
        residual=residual,
        covariance=covariance,
        log_evidence=_log_evidence(chi2, root, curvature, d, sizes),
        spread=spread,
    )


def _fitted(
    model: _Model, near: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Best x (d + a,), and the covariance that it was fitted with, its root and inverse root."""
    d, starts = model.surfaces.dimensions, _starts(model, near)
    best = np.concatenate([np.full(d, 0.5), np.zeros(len(model.added))])
    for _ in range(VARIANCE_ROUNDS):
        covariance = model.covariance(best)
        root = linalg.cholesky(covariance, lower=True)
        whitening = linalg.solve_triangular(root, np.eye(len(root)), lower=True)
        best = _least_squares(model, whitening, starts)
        starts = [best]
    return best, covariance, root, whitening


def _starts(model: _Model, near: np.ndarray | None) -> list[np.ndarray]:
    """A few places in the box, each with no amplitude, and with middling ones of either sign.

    So also a place (d + a,) that is known to be near.
    """
    a, (low, high) = len(model.added), model.bounds
    amplitudes = [np.full(a, size) for size in ((0.0, 1.0, -1.0) if a else (0.0,))]
    places = [np.full(model.surfaces.dimensions, share) for share in STARTS]
    starts = [np.concatenate([place, size]) for place in places for size in amplitudes]
    starts += [] if near is None else [near.copy()]
    if model.pinned is not None:
        for start in starts:
            start[model.pinned[0]] = model.pinned[1]
        starts = list(np.unique(starts, axis=0))
    return [s for s in starts if (s >= low).all() and (s <= high).all()]


def _least_squares(
    model: _Model, whitening: np.ndarray, starts: Sequence[np.ndarray]
) -> np.ndarray:
    """Best of bounded least-squares fits from several starts.

    The method is that of Branch, Coleman and Li, SIAM J. Sci. Comput. 21 (1999) 1-23.
    """
    low, high = model.bounds
    fits = [
        optimize.least_squares(
            lambda x: whitening @ model.residual(x),
            np.clip(start, low + 1e-6, high - 1e-6),
            lambda x: -whitening @ model.slopes(x),
            (low, high),
            x_scale=1.0,
            xtol=1e-8,
            ftol=1e-8,
        )
        for start in starts
    ]
    return np.asarray(min(fits, key=lambda fit: fit.cost).x)


def _log_evidence(
    chi2: float,
    root: np.ndarray,
    curvature: np.ndarray,
    d: int,
    added: Sequence[tuple[Effect, float, float]],
) -> float:
    """Laplace's log evidence (MacKay 2003, ch. 28).

    Parameters are uniform over their ranges, amplitudes normal with their plausible scale. The
    prior's curvature of one per squared range keeps a parameter that nothing measures from counting
    as known beyond its range. An effect of one sign has a half-normal prior, and only the positive
    half of the peak counts.
    """
    prior = np.diag([12.0] * d + [1.0] * len(added))  # 12: a uniform range has a variance of 1/12
    logdet = float(np.linalg.slogdet((curvature + prior) / (2 * np.pi))[1])
    peak = -chi2 / 2 - len(root) / 2 * np.log(2 * np.pi)
    log = peak - float(np.log(np.diag(root)).sum()) - logdet / 2
    for effect, amplitude, error in added:
        log += -(amplitude**2) / 2 - np.log(2 * np.pi) / 2
        if effect.sign == "+":
            log += np.log(2) + float(stats.norm.logcdf(amplitude / error))
    return float(log)
