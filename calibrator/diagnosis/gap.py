"""Whether simulation and measurement differ, and which effect points along the gap.

Plain linear algebra on arrays. A residual r (n,) of n observables, its covariance V (n, n) and the
sensitivity J (n, d) of the observables to the d calibrated parameters come in. Whatever
recalibration can absorb is projected out: with V = L L', the residual is whitened to L^-1 r, and
only its components orthogonal to L^-1 J are kept. Under a complete model these n - d numbers are
independent standard normals, so detection, amplitudes and confusability are lengths and angles
there. The scheme is detection and identification of geodesy (Teunissen, J. Geod. 92 (2018) 59-80),
with the projection of the nuisances from fault isolation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg, stats

from calibrator.errors import CalibratorError

FEWEST_DEGREES = 5  # of freedom of a residual that may carry a name
# length of a whitened effect that is detected in 80 of 100 cases beside a dozen rivals
DETECTABLE = 4.5
NAMEABLE = 5.0  # length of the part of it that no rival shares, for a right name in 95 of 100
ALIKE = 0.99  # correlation from which two observables count as one
SINGULAR = 1e-10  # of the largest eigenvalue: smaller ones belong to observables that repeat others
DRAWS = 4000  # of the Monte Carlo probabilities


@dataclass(frozen=True, eq=False)
class Projection:
    """Map from observables to the components that neither noise scale nor recalibration touches.

    matrix (m, n) : matrix @ r are m = rank(V) - rank(J) independent standard normals where the
    model lacks nothing.
    """

    matrix: np.ndarray

    @property
    def degrees(self) -> int:
        """Degrees of freedom m of the projected residual."""
        return len(self.matrix)

    def __call__(self, vectors: np.ndarray) -> np.ndarray:
        """Projected vectors (m,) or (m, k) of vectors (n,) or (n, k)."""
        return np.asarray(self.matrix @ vectors)


def projection(covariance: np.ndarray, jacobian: np.ndarray) -> Projection:
    """Projection for a covariance V (n, n) and a Jacobian (n, d).

    Directions of no variance, as two observables that are one quantity have, are left out: they say
    nothing twice. Raises CalibratorError where V is not finite, not symmetric or has a negative
    eigenvalue.
    """
    if not (
        np.isfinite(covariance).all()
        and np.isfinite(jacobian).all()
        and np.allclose(covariance, covariance.T)
    ):
        raise CalibratorError(
            "the covariance of the residual is not a finite symmetric matrix: check scatters and"
            " runs"
        )
    if not (np.diag(covariance) > 0).all():
        raise CalibratorError(
            "an observable has no error at all: give its scatter, or replicate it"
        )
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    if values[0] < -1e-6 * values[-1]:
        raise CalibratorError(
            "the covariance of the residual has a negative eigenvalue: check the nuisances' columns"
        )
    kept = values > SINGULAR * values[-1]
    whitening = (vectors[:, kept] / np.sqrt(values[kept])).T / scale
    basis = linalg.null_space((whitening @ jacobian).T) if jacobian.size else np.eye(len(whitening))
    return Projection(basis.T @ whitening)


@dataclass(frozen=True, eq=False)
class Fingerprints:
    """How k effects would show after recalibration.

    Attributes
    ----------
    names : of the effects (k,).
    columns : projected changes (m, k) per unit amplitude.
    signs : "+" where only a positive amplitude makes sense, "+-" where both do.
    """

    names: tuple[str, ...]
    columns: np.ndarray
    signs: tuple[str, ...]

    @property
    def lengths(self) -> np.ndarray:
        """Standard errors (k,) per unit amplitude that an effect moves the residual: g."""
        return np.asarray(np.linalg.norm(self.columns, axis=0))

    @property
    def directions(self) -> np.ndarray:
        """Unit vectors (m, k); zeros for an effect that recalibration hides altogether."""
        lengths = self.lengths
        return np.asarray(
            np.divide(self.columns, lengths, out=np.zeros_like(self.columns), where=lengths > 0)
        )

    def amplitudes(self, residual: np.ndarray) -> np.ndarray:
        """Least-squares amplitude (k,) of each effect alone; nan where it does not show."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(
                (self.directions.T @ residual) / np.where(self.lengths > 0, self.lengths, np.nan)
            )

    def likelihood_ratios(self, residuals: np.ndarray) -> np.ndarray:
        """Fall (..., k) of chi2 by each effect alone, for residuals (..., m).

        Zero where the sign is wrong.
        """
        along = residuals @ self.directions
        wrong = (along < 0) & np.array([s == "+" for s in self.signs], bool)
        return np.asarray(np.where(wrong, 0.0, along**2))

    @property
    def confusability(self) -> np.ndarray:
        """|cos| (k, k) of the angles between the effects.

        It is 1 for two that nothing measured here can tell apart.
        """
        return np.asarray(np.abs(self.directions.T @ self.directions))


def fingerprints(
    names: tuple[str, ...], signs: tuple[str, ...], changes: np.ndarray, project: Projection
) -> Fingerprints:
    """Fingerprints of effects that change the observables by (n, k) per unit amplitude."""
    return Fingerprints(names, project(changes), signs)


def absorbed_shares(
    changes: np.ndarray, covariance: np.ndarray, jacobian: np.ndarray
) -> np.ndarray:
    """Share (k,) of each effect's squared length that recalibration hides.

    1 - |projected|^2 / |whitened|^2, of changes (n, k), covariance (n, n) and jacobian (n, d).
    """
    seen = projection(covariance, jacobian)(changes)
    all_of_it = projection(covariance, np.zeros((len(covariance), 0)))(changes)
    whole = (all_of_it**2).sum(axis=0)
    return np.asarray(
        1 - np.divide((seen**2).sum(axis=0), whole, out=np.zeros(changes.shape[1]), where=whole > 0)
    )


def smallest_detectable(prints: Fingerprints) -> np.ndarray:
    """Amplitude (k,) found in 80 of 100 cases; infinite where nothing shows."""
    with np.errstate(divide="ignore"):
        return np.asarray(DETECTABLE / prints.lengths)


def smallest_nameable(prints: Fingerprints) -> np.ndarray:
    """Amplitude (k,) that is told from the nearest rival in 95 of 100 cases.

    Infinite where a rival looks the same.
    """
    cosines = prints.confusability - np.eye(len(prints.names))
    nearest = cosines.max(axis=1, initial=0)
    sine = np.sqrt(np.clip(1 - nearest**2, 0, 1))
    with np.errstate(divide="ignore"):
        return np.asarray(
            np.maximum(NAMEABLE / (prints.lengths * sine), smallest_detectable(prints))
        )


@dataclass(frozen=True)
class Detection:
    """Probabilities of a residual this large without any gap.

    Attributes
    ----------
    chi2, degrees : squared length of the projected residual, and its degrees of freedom.
    p_chi2 : from its length.
    p_effect : from the best likelihood ratio of any effect of the library.
    """

    chi2: float
    degrees: int
    p_chi2: float
    p_effect: float


def detect(
    residual: np.ndarray, prints: Fingerprints, noise_degrees: float, rng: np.random.Generator
) -> Detection:
    """Test a projected residual (m,) for a gap.

    noise_degrees : degrees of freedom behind the estimated covariance. Both statistics are referred
    to their distributions under normals divided by the same estimate, by Monte Carlo, and not to
    those of a covariance known exactly.
    """
    without = _without_gap(len(residual), noise_degrees, rng)
    chi2, best = (
        float(residual @ residual),
        float(prints.likelihood_ratios(residual).max(initial=0)),
    )
    p_chi2 = _share((without**2).sum(axis=1), chi2)
    p_effect = _share(prints.likelihood_ratios(without).max(axis=1, initial=0), best)
    return Detection(chi2, len(residual), p_chi2, p_effect)


def _without_gap(dimensions: int, noise_degrees: float, rng: np.random.Generator) -> np.ndarray:
    normal = rng.normal(size=(DRAWS, dimensions))
    if not np.isfinite(noise_degrees):
        return normal
    return np.asarray(
        normal / np.sqrt(rng.chisquare(noise_degrees, size=(DRAWS, 1)) / noise_degrees)
    )


def _share(drawn: np.ndarray, found: float) -> float:
    """Monte Carlo probability of a value as large as found, never zero.

    Davison and Hinkley, Bootstrap Methods and their Application (1997), Eq. 4.11.
    """
    return float((1 + np.count_nonzero(drawn >= found)) / (1 + len(drawn)))


def ghost_shares(
    residual: np.ndarray, prints: Fingerprints, rng: np.random.Generator
) -> np.ndarray:
    """Share (DRAWS,) of chi2 that ghosts of the library remove.

    Ghosts are the same effects, turned together into a random direction. A rotation keeps the
    angles between the effects and their number, so this is what as rich a library would reach by
    chance. Turning the library is the same as turning the residual, whose direction alone counts.
    """
    drawn = rng.normal(size=(DRAWS, len(residual)))
    drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    return np.asarray(prints.likelihood_ratios(drawn).max(axis=1, initial=0))


def ghost_probability(
    residual: np.ndarray, prints: Fingerprints, rng: np.random.Generator
) -> float:
    """Probability that a ghost library removes as large a share of chi2 as the best effect.

    Uniform without a gap.
    """
    found = prints.likelihood_ratios(residual).max(initial=0) / (residual @ residual)
    return _share(ghost_shares(residual, prints, rng), float(found))


def repeated(correlation: np.ndarray) -> list[tuple[int, int]]:
    """Pairs (later, earlier) of observables that are one quantity, by their correlation (n, n)."""
    pairs: list[tuple[int, int]] = []
    kept: list[int] = []
    for i in range(len(correlation)):
        twin = next((j for j in kept if abs(correlation[i, j]) > ALIKE), None)
        if twin is None:
            kept.append(i)
        else:
            pairs.append((i, twin))
    return pairs


@dataclass(frozen=True)
class Location:
    """How badly the measurements of one experiment agree with what all others predict for it.

    Attributes
    ----------
    experiment : its name.
    chi2, degrees : of the difference, with its degrees of freedom.
    p, p_holm : probability of as large a one; p_holm allows for looking at all experiments.
    """

    experiment: str
    chi2: float
    degrees: int
    p: float
    p_holm: float


def localise(
    residual: np.ndarray, covariance: np.ndarray, jacobian: np.ndarray, experiments: list[str]
) -> list[Location]:
    """Predict each experiment from the others and compare, the worst first.

    residual (n,), covariance (n, n), jacobian (n, d) per range of the parameters; experiments (n,)
    names. The parameters are normal about the present ones with the spread of their ranges, and the
    prediction is the conditional distribution. Probabilities are corrected by Holm's method
    (Scand. J. Statist. 6 (1979) 65-70).
    """
    total = covariance + jacobian @ jacobian.T
    found = []
    for name in dict.fromkeys(experiments):
        own = np.array([e == name for e in experiments])
        if own.all():
            continue
        gain = np.linalg.lstsq(total[np.ix_(~own, ~own)], total[np.ix_(~own, own)], rcond=None)[0].T
        surprise = residual[own] - gain @ residual[~own]
        spread = total[np.ix_(own, own)] - gain @ total[np.ix_(~own, own)]
        z = projection((spread + spread.T) / 2, np.zeros((len(spread), 0)))(surprise)
        found.append((name, float(z @ z), len(z), float(stats.chi2.sf(z @ z, len(z)))))
    found.sort(key=lambda one: one[3])
    holm = np.maximum.accumulate(
        [min(1.0, p * (len(found) - i)) for i, (_, _, _, p) in enumerate(found)] or [1.0]
    )
    return [Location(*one, float(p)) for one, p in zip(found, holm, strict=False)]


@dataclass(frozen=True)
class Gap:
    """Root mean square of residuals in units of their errors, before and after.

    Attributes
    ----------
    before, after : without the effect and with it.
    floor : what pure noise would leave.
    closed : share of the squared gap above the floor that has gone; below 0 where it grew.
    """

    before: float
    after: float
    floor: float

    @property
    def closed(self) -> float:
        """(before^2 - after^2) / (before^2 - floor^2), nan where there was no gap to close."""
        width = self.before**2 - self.floor**2
        return (self.before**2 - self.after**2) / width if width > 0 else float("nan")
