"""How far fits go astray of sets that the surfaces have not seen, beyond what their errors say.

The surfaces take what they miss of one observable to be apart from what they miss of another. Where
a quadratic bends too little, the angles of several heaps can be off to the same side, as if the
friction were another, and a fit follows that side without a worse chi2. Each set left out of the
surfaces in turn is a laboratory of which the truth is known (Stone, J. R. Stat. Soc. B 36 (1974)
111-147).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from calibrator.diagnosis.explanations import Measured
from calibrator.diagnosis.scatter import LeftOut
from calibrator.diagnosis.surfaces import Surface, Surfaces


@dataclass(frozen=True, eq=False)
class _Set:
    """A set in all experiments that ran it.

    Attributes
    ----------
    unit, amplitude : (d,) and (k,), its place.
    residual : (n,) its runs less what the surfaces without it say; 0 where it was not run.
    covariance : (n, n) of the residual, as the surfaces have it.
    """

    unit: np.ndarray
    amplitude: np.ndarray
    residual: np.ndarray
    covariance: np.ndarray


def astray(
    surfaces: Surfaces, measured: Measured, added: Sequence[int], kept: np.ndarray
) -> np.ndarray:
    """Variances (d + a,) of fitted parameters and added amplitudes beyond those that a fit states.

    measured : the observables at kept. Sets with the added effects are left out in turn, those
    without any where none is added; of a set that some experiments did not run, the others tell.
    """
    columns = np.array([*range(surfaces.dimensions), *(surfaces.dimensions + k for k in added)])
    sets = list(_sets(surfaces, added))
    found = np.zeros(len(columns))
    for one in sets:
        weights = _weights(surfaces, measured, one, columns, kept)
        moved = weights @ one.residual[kept]
        stated = weights @ one.covariance[np.ix_(kept, kept)] @ weights.T
        found += (moved**2 - np.diag(stated)) / len(sets)
    return np.maximum(found, 0.0)


def _weights(
    surfaces: Surfaces, measured: Measured, one: _Set, columns: np.ndarray, kept: np.ndarray
) -> np.ndarray:
    """By how much (d + a, n) a fit about a set follows each observable that is kept."""
    at = one.unit, one.amplitude
    scatter = surfaces.extra_scatter(one.amplitude)[kept] / measured.replicates
    covariance = measured.covariance + surfaces.error(*at)[np.ix_(kept, kept)] + np.diag(scatter)
    slopes = surfaces.jacobian(*at)[np.ix_(kept, columns)]
    seen = np.linalg.solve(covariance, slopes)
    return np.asarray(np.linalg.pinv(slopes.T @ seen) @ seen.T)


def _sets(surfaces: Surfaces, added: Sequence[int]) -> Iterator[_Set]:
    """The sets of the runs that an explanation with these effects rests on."""
    family, remains = surfaces.changes if added else surfaces.plain, surfaces.remains
    for unit, amplitude in _places([s.left_out for s in family], added):
        parts = [_part(s, p, unit, amplitude) for s, p in zip(family, surfaces.plain, strict=True)]
        residual = np.concatenate([r for r, _ in parts])
        covariance = linalg.block_diag(*[c for _, c in parts])
        if remains is not None:
            residual, covariance = remains @ residual, remains @ covariance @ remains.T
        yield _Set(unit, amplitude, residual, covariance)


def _places(
    experiments: Sequence[LeftOut], added: Sequence[int]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Parameters (d,) and amplitudes (k,) of the sets with the added effects, or with none.

    They are those of the experiment that has the most parameters.
    """
    found = []
    for own in experiments:
        right = own.amplitudes[:, list(added)].any(axis=1) if added else ~own.amplitudes.any(axis=1)
        if right.any():
            found.append((int(_varied(own).sum()), own, right))
    if not found:
        return []
    _, own, right = max(found, key=lambda one: one[0])
    return list(zip(own.units[right], own.amplitudes[right], strict=True))


def _varied(own: LeftOut) -> np.ndarray:
    """Which parameters (d,) an experiment has: one that it has not stands still in all its sets."""
    return np.asarray((own.units != own.units[:1]).any(axis=0))


def _part(
    own: Surface, plain: Surface, unit: np.ndarray, amplitude: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Residual (n,) and its covariance (n, n) of an experiment's set; zeros where it is not run."""
    sets, n = own.left_out, len(own.noise)
    varied = _varied(sets)
    here = np.isclose(sets.units[:, varied], unit[varied]).all(axis=1)
    here &= np.isclose(sets.amplitudes, amplitude).all(axis=1)
    if not here.any():
        return np.zeros(n), np.zeros((n, n))
    i = int(np.argmax(here))
    root = np.sqrt(plain.growth(unit))
    noise = plain.noise * np.outer(root, root) / sets.counts[i]
    return sets.residual[i], noise + own.noise * sets.leverage[i] + np.diag(plain.misfit)
