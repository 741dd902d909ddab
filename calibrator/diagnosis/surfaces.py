"""Response surfaces: quadratic in the parameters, plus the change by each effect.

One regression per experiment, all observables at once, because a run gives them all and their seed
noise hangs together. The surfaces interpolate over the same box as the calibration's; unlike its
Gaussian processes they give the covariance between observables in closed form, which the tests for
a gap cannot do without.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from scipy import linalg

from calibrator.diagnosis.scatter import Growth, LeftOut, Replicates, noise_and_misfit
from calibrator.errors import CalibratorError

# of an effect's size: what its square and its products with parameters plausibly amount to
BENDING = 0.5
SMALLEST_EFFECT = 0.1  # in scatters of a run: keeps the ridge of an effect that does nothing finite
SPARE_RUNS = 8  # more than terms: the seed noise is estimated from these degrees of freedom
WORST_CONDITION = 1e10  # of the normal equations of a design whose terms are told apart


def terms(units: np.ndarray, amplitudes: np.ndarray) -> np.ndarray:
    """Regressors (n, p) of parameters (n, d) in the unit box and amplitudes (n, k).

    Constant, linear and quadratic terms of the parameters; of each effect its amplitude, the
    square, and the products with the parameters, so that an effect may grow with friction, and
    saturate.
    """
    x = 2 * np.atleast_2d(units) - 1
    a = np.atleast_2d(amplitudes)
    i, j = _pairs(x.shape[1])
    products = np.concatenate(
        [a[:, :, None], a[:, :, None] ** 2, a[:, :, None] * x[:, None, :]], axis=2
    )
    return np.hstack([np.ones((len(x), 1)), x, x[:, i] * x[:, j], products.reshape(len(x), -1)])


@cache
def _pairs(parameters: int) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the parameters in each quadratic term."""
    return np.tril_indices(parameters)


def plain_terms(parameters: int) -> int:
    """How many of the terms, the first ones, know nothing of effects."""
    return 1 + parameters + parameters * (parameters + 1) // 2


def enough_runs(units: np.ndarray, amplitudes: np.ndarray) -> bool:
    """Whether runs at units (m, d) with amplitudes (m, k), all finished, make a surface.

    They are enough for the terms that they move, and tell those apart that no ridge holds.
    """
    design, (d, k) = terms(units, amplitudes), (units.shape[1], amplitudes.shape[1])
    used = _moved(design)
    firm = np.r_[np.arange(plain_terms(d)), plain_terms(d) + (2 + d) * np.arange(k)]
    columns = design[:, firm[used[firm]]]
    told_apart = np.linalg.cond(columns.T @ columns) <= WORST_CONDITION
    return len(design) - int(used.sum()) >= SPARE_RUNS and bool(told_apart)


def _moved(design: np.ndarray) -> np.ndarray:
    """Which columns (p,) of a design differ between the runs, the constant among them."""
    used = np.asarray(np.ptp(design, axis=0) > 0)
    used[0] = True
    return used


@dataclass(frozen=True, eq=False)
class Surface:
    """Least-squares surfaces of the n observables of one experiment.

    Attributes
    ----------
    coefficients : (p, n) of the terms.
    inverse : (p, p), (X'X + ridge)^-1.
    noise : covariance (n, n) of one run, pooled over the box.
    misfit : variance (n,) by which the surfaces miss the mean of a set, from sets with replicates.
    degrees : of freedom of the noise.
    growth : of the noise over the box.
    left_out : its sets as the surfaces without them see them.
    """

    coefficients: np.ndarray
    inverse: np.ndarray
    noise: np.ndarray
    misfit: np.ndarray
    degrees: int
    growth: Growth
    left_out: LeftOut

    @classmethod
    def fit(
        cls, units: np.ndarray, amplitudes: np.ndarray, values: np.ndarray, name: str = ""
    ) -> Surface:
        """Fit to runs: units (m, d), amplitudes (m, k), values (m, n).

        Effects that no run has get no term and change nothing. Raises CalibratorError where there
        are too few runs for the terms, or the runs do not tell them apart.
        """
        design = terms(units, amplitudes)
        used = _moved(design)
        spare = len(design) - int(used.sum())
        if spare < SPARE_RUNS:
            raise CalibratorError(
                f"{name or 'an experiment'} has {len(design)} finished runs, {SPARE_RUNS - spare}"
                " too few for its response surfaces: add sets to [diagnosis], or see why runs fail"
            )
        inverse = np.zeros((design.shape[1],) * 2)
        columns, penalty = (
            design[:, used],
            _penalty(design, values, units.shape[1], amplitudes.shape[1])[used],
        )
        if np.linalg.cond(columns.T @ columns + np.diag(penalty)) > WORST_CONDITION:
            raise CalibratorError(
                f"the runs of {name or 'an experiment'} do not tell its terms apart: add sets to"
                " [diagnosis]"
            )
        inverse[np.ix_(used, used)] = np.linalg.inv(columns.T @ columns + np.diag(penalty))
        coefficients = inverse @ design.T @ values
        left = values - design @ coefficients
        replicates = Replicates.of(np.column_stack([units, amplitudes]), values)
        noise, misfit = noise_and_misfit(left, spare, replicates)
        d, sets = units.shape[1], replicates.sets
        growth = Growth.of(sets[:, :d], replicates)
        rows = terms(sets[:, :d], sets[:, d:])
        left_out = LeftOut.of(left, replicates, rows, inverse, d)
        return cls(coefficients, inverse, noise, misfit, spare, growth, left_out)


def _penalty(design: np.ndarray, values: np.ndarray, d: int, k: int) -> np.ndarray:
    """Ridge (p,) on how an effect bends and depends on the parameters.

    A few runs of each effect can hardly tell. These coefficients are taken to be normal with a
    spread of BENDING times the effect's own size, its root mean square over the observables in
    units of their scatter, as a fit of the amplitudes alone finds it (empirical Bayes).
    """
    first = plain_terms(d)
    alone = first + (2 + d) * np.arange(k)
    plain = np.r_[np.arange(first), alone]
    fitted, *_ = np.linalg.lstsq(design[:, plain], values, rcond=None)
    scatter = (
        np.std(values - design[:, plain] @ fitted, axis=0)
        + 1e-12 * np.abs(values).max(axis=0)
        + 1e-300
    )
    penalty = np.zeros(design.shape[1])
    for own, column in zip(alone, fitted[first:], strict=True):
        size = max(float(np.sqrt(np.mean((column / scatter) ** 2))), SMALLEST_EFFECT)
        penalty[own + 1 : own + 2 + d] = 1 / (BENDING * size) ** 2
    return penalty


def _effect_scatters(
    plain: Surface, change: Surface, units: np.ndarray, amplitudes: np.ndarray, values: np.ndarray
) -> np.ndarray:
    """Variance (k, n) that runs with each effect of plausible size have beyond the noise.

    A moist heap comes down as a block in one run and not in the next, a few large grains make a
    discharge uneven, and an effect may bend more than the surfaces do.
    """
    design, found = terms(units, amplitudes), np.zeros((amplitudes.shape[1], values.shape[1]))
    left, noise = values - design @ change.coefficients, np.diag(plain.noise)
    # of each run: one less its leverage
    free = 1 - np.einsum("ij,jk,ik->i", design, change.inverse, design)
    for k, own in enumerate((amplitudes != 0).T):
        if own.any():
            scatter = (left[own] ** 2).sum(axis=0) / free[own].sum()
            found[k] = np.maximum(scatter - noise, 0) / np.mean(amplitudes[own, k] ** 2)
    return found


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The surfaces of all experiments, their observables one after another.

    The change by effects comes from runs and seeds of its own (`changes`), apart from those of the
    model without effects (`plain`): noise that the two shared would look like an effect in the
    residual. effect_scatters (k, n of the experiment) : variances by which runs with each effect
    scatter more, at its plausible size. wider (2, d) : ends beyond the box up to which the surfaces
    may be asked where the box itself is in question, as shares of the parameters' ranges. shift
    (n,), known (n, n), remains (n, n) : what fresh runs at one place add to the surfaces about it,
    the covariance of their errors then, and how much of an error remains; None without such runs.
    """

    plain: tuple[Surface, ...]
    changes: tuple[Surface, ...]
    effect_scatters: tuple[np.ndarray, ...]
    wider: np.ndarray
    shift: np.ndarray | None = None
    known: np.ndarray | None = None
    remains: np.ndarray | None = None

    @property
    def dimensions(self) -> int:
        """Number of parameters d."""
        return int(self.wider.shape[1])

    def mean(self, units: np.ndarray, amplitudes: np.ndarray) -> np.ndarray:
        """Observables (j, n) at parameters (j, d) and amplitudes (j, k)."""
        without, step = self._rows(units, amplitudes)
        plain, change = self._coefficients
        found = without @ plain + step @ change
        return np.asarray(found if self.shift is None else found + self.shift)

    def error(self, unit: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """Covariance (n, n) of the observables at parameters (d,) and amplitudes (k,)."""
        if self.known is not None:
            return self.known
        without, step = (rows[0] for rows in self._rows(unit, amplitude))
        return np.asarray(
            linalg.block_diag(
                *[
                    (without @ p.inverse @ without) * _grown(p, unit)
                    + np.diag(p.misfit)
                    + (step @ c.inverse @ step) * c.noise
                    for p, c in zip(self.plain, self.changes, strict=True)
                ]
            )
        )

    def corrected(
        self, unit: np.ndarray, amplitude: np.ndarray, fresh: np.ndarray, error: np.ndarray
    ) -> Surfaces:
        """The surfaces about parameters (d,) and amplitudes (k,), of which fresh runs tell.

        fresh (n,) : means of these runs; error (n, n) : their covariance. Surfaces and runs are
        weighed by their errors, as in one step of a Kalman filter (Gelman et al., Bayesian Data
        Analysis, 3rd ed., Eq. 3.13).
        """
        own = self.error(unit, amplitude)
        gain = np.linalg.solve(own + error, own).T
        shift = gain @ (fresh - self.mean(unit, amplitude)[0])
        remains = np.eye(len(own)) - gain
        left = remains @ own
        return replace(self, shift=shift, known=(left + left.T) / 2, remains=remains)

    def extra_scatter(self, amplitude: np.ndarray) -> np.ndarray:
        """Variances (n,) that single runs with effects of amplitudes (k,) have beyond the noise."""
        return np.asarray(
            np.asarray(amplitude) ** 2 @ np.hstack(self.effect_scatters)[: len(amplitude)]
        )

    def jacobian(self, unit: np.ndarray, amplitude: np.ndarray, step: float = 1e-4) -> np.ndarray:
        """Derivatives (n, d + k): by each parameter per range, then by each amplitude per scale.

        Central differences, which are exact for quadratic surfaces; of the regressors, so that what
        has no coefficient has no slope either, not even one of rounding errors.
        """
        at, d = np.concatenate([unit, amplitude]), len(unit)
        moved = at + step * np.concatenate([np.eye(len(at)), -np.eye(len(at))])
        changes = [np.subtract(*np.split(r, 2)) for r in self._rows(moved[:, :d], moved[:, d:])]
        found = sum(c @ own for c, own in zip(changes, self._coefficients, strict=True))
        return np.asarray(found).T / (2 * step)

    def _rows(self, units: np.ndarray, amplitudes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Regressors without effects, and what the effects add to them, both (j, p).

        Changes that amplitudes (j, k) do not have are none: candidates come first, and after them
        the fixed values that are uncertain.
        """
        sizes, first = np.atleast_2d(amplitudes), plain_terms(self.dimensions)
        lacks = len(self.effect_scatters[0]) - sizes.shape[1]
        step = terms(units, np.hstack([sizes, np.zeros((len(sizes), lacks))]))
        without = np.zeros_like(step)
        without[:, :first] = step[:, :first]
        step[:, :first] = 0.0
        return without, step

    @cached_property
    def _coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        return (
            np.hstack([surface.coefficients for surface in self.plain]),
            np.hstack([surface.coefficients for surface in self.changes]),
        )

    @cached_property
    def noise(self) -> np.ndarray:
        """Covariance (n, n) of one run of every experiment without effects.

        The correlations are pooled from both families of runs, the variances are those of the runs
        without effects: with some effects runs scatter more, and what the surfaces of an effect
        miss is in their scatter, too.
        """
        blocks = []
        for p, c in zip(self.plain, self.changes, strict=True):
            scatter, pooled = np.sqrt(np.diag(p.noise)), p.degrees * p.noise + c.degrees * c.noise
            size = np.sqrt(np.diag(pooled))
            blocks.append(pooled / np.outer(size, size) * np.outer(scatter, scatter))
        return np.asarray(linalg.block_diag(*blocks))

    def noise_at(self, unit: np.ndarray) -> np.ndarray:
        """Covariance (n, n) of one run of every experiment at parameters (d,)."""
        root = np.sqrt(np.concatenate([p.growth(unit) for p in self.plain]))
        return np.asarray(self.noise * np.outer(root, root))

    @property
    def degrees(self) -> int:
        """Degrees of freedom of the noise, those of the experiment that has the fewest."""
        return min(p.degrees + c.degrees for p, c in zip(self.plain, self.changes, strict=True))


def _grown(surface: Surface, unit: np.ndarray) -> np.ndarray:
    """The noise (n, n) of one run at parameters (d,)."""
    root = np.sqrt(surface.growth(unit))
    return np.asarray(surface.noise * np.outer(root, root))


def fit_surfaces(
    plain: Sequence[tuple[np.ndarray, np.ndarray]],
    changes: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]],
    experiments: Sequence[str],
    plain_seeds: set[int],
    change_seeds: set[int],
    wider: np.ndarray,
) -> Surfaces:
    """Fit all surfaces.

    plain : (units (m, d), values (m, n)) per experiment; changes : (units, amplitudes (m, k),
    values) per experiment, runs without effects among them; wider : as in `Surfaces`. Raises
    CalibratorError where the two families share a seed, and as `Surface.fit` does.
    """
    shared = plain_seeds & change_seeds
    if shared:
        raise CalibratorError(
            f"seed {min(shared)} serves both the residual and the fingerprints, whose common noise"
            " would look like an effect: give them seeds of their own"
        )
    effects = changes[0][1].shape[1] if changes else 0
    without = [
        Surface.fit(u, np.zeros((len(u), effects)), v, name)
        for (u, v), name in zip(plain, experiments, strict=True)
    ]
    added = [
        Surface.fit(u, a, v, name) for (u, a, v), name in zip(changes, experiments, strict=True)
    ]
    scatters = [
        _effect_scatters(p, c, *own) for p, c, own in zip(without, added, changes, strict=True)
    ]
    return Surfaces(tuple(without), tuple(added), tuple(scatters), wider)
