"""Sets left out of the surfaces, and how far fits to them go astray."""

from dataclasses import replace

import numpy as np
import pytest

from calibrator.diagnosis.explanations import explain
from calibrator.diagnosis.interval import RISE, rises
from calibrator.diagnosis.left_out import astray
from calibrator.diagnosis.scatter import LeftOut
from calibrator.diagnosis.surfaces import Surface
from tests.toy_world import COUNT, EFFECTS, World

ALL = np.arange(COUNT)


class Shifted(World):
    """A world whose runs are those of other parameters: by a wave that no quadratic follows."""

    def run(self, unit, sizes, rng):
        """One run of every experiment."""
        wave = 0.12 * np.sin(9 * np.asarray(unit)[::-1] + 1)
        return super().run(np.asarray(unit) + wave, sizes, rng)


def laboratories(world, count):
    """Surfaces of one world, and fits to laboratories in it, with their truths."""
    surfaces = world.surfaces(np.random.default_rng(9))
    for seed in range(count):
        rng = np.random.default_rng(seed)
        unit = rng.uniform(0.1, 0.9, 2)
        measured = world.measure(surfaces, rng, unit=unit)
        yield unit, measured, explain(surfaces, measured, EFFECTS), surfaces


def test_a_set_is_left_out_as_by_a_new_fit():
    rng = np.random.default_rng(1)
    units = np.repeat(rng.random((14, 2)), 2, axis=0)[:-1]  # one of the sets has a single run
    amplitudes = np.zeros((len(units), 1))
    values = rng.normal(size=(len(units), 3))
    found = Surface.fit(units, amplitudes, values).left_out
    for i, unit in enumerate(found.units):
        here = np.isclose(units, unit).all(axis=1)
        rest = Surface.fit(units[~here], amplitudes[~here], values[~here])
        x = 2 * unit - 1
        row = np.array([1, *x, x[0] ** 2, x[0] * x[1], x[1] ** 2, 0, 0, 0, 0])
        expected = values[here].mean(axis=0) - row @ rest.coefficients
        assert found.residual[i] == pytest.approx(expected)
        assert found.leverage[i] == pytest.approx(row @ rest.inverse @ row)
        assert found.counts[i] == here.sum()
    assert len(found.units) == 14


def test_in_a_world_of_quadratics_little_goes_astray():
    for _, measured, fit, surfaces in laboratories(World(3), 1):
        assert (astray(surfaces, measured, (), ALL) < np.diag(fit.spread)).all()


def test_where_all_observables_are_off_to_one_side_intervals_still_hold_the_truth():
    """Chi-square alone holds it in two of three: the fit takes the shift for other parameters."""
    stated, by_chi_square = [], []
    for unit, measured, fit, surfaces in laboratories(Shifted(3), 20):
        enough = rises(surfaces, measured, (), fit, ALL)
        assert (enough > RISE).all()
        for i in range(2):
            at = explain(surfaces, measured, EFFECTS, pinned=(i, unit[i]), near=fit.unit)
            stated.append(at.deviance - fit.deviance <= enough[i])
            by_chi_square.append(at.deviance - fit.deviance <= RISE)
    assert sum(stated) >= 36 and sum(by_chi_square) < 30


def without_effect(surface):
    """An experiment that cannot show the first effect, as dried sand shows no moisture."""
    own = surface.left_out
    rows = own.amplitudes[:, 0] == 0
    shown = {k: v[rows] for k, v in vars(own).items()}
    return replace(surface, left_out=LeftOut(**shown))


def test_a_set_that_an_experiment_did_not_run_is_judged_by_the_others():
    world, surfaces = Shifted(3), Shifted(3).surfaces(np.random.default_rng(1))
    measured = world.measure(surfaces, np.random.default_rng(2), sizes=(0.7, 0, 0, 0))
    first, *rest = surfaces.changes
    dried = replace(surfaces, changes=(without_effect(first), *rest))
    found, fewer = (astray(s, measured, (0,), ALL) for s in (surfaces, dried))
    assert found.shape == (3,) and (found > 0).any()
    assert np.isfinite(fewer).all() and not np.allclose(found, fewer)
    none = replace(surfaces, changes=tuple(map(without_effect, surfaces.changes)))
    assert (astray(none, measured, (0,), ALL) == 0).all()


def test_an_experiment_whose_every_set_is_needed_says_nothing():
    """Six sets with three runs each just make a surface of two parameters."""
    units = np.repeat(np.random.default_rng(4).random((6, 2)), 3, axis=0)
    values = np.random.default_rng(5).normal(size=(18, 6))
    needed = Surface.fit(units, np.zeros((18, len(EFFECTS))), values)
    assert len(needed.left_out.units) == 0
    world, surfaces = Shifted(3), Shifted(3).surfaces(np.random.default_rng(1))
    measured = world.measure(surfaces, np.random.default_rng(2))
    found = replace(surfaces, plain=(needed, *surfaces.plain[1:]))
    assert np.isfinite(astray(found, measured, (), ALL)).all()
    alone = replace(found, plain=tuple(replace(p, left_out=needed.left_out) for p in found.plain))
    assert (astray(alone, measured, (), ALL) == 0).all()


def test_surfaces_that_fresh_runs_have_corrected_miss_less_about_their_place():
    for unit, measured, _, surfaces in laboratories(Shifted(3), 1):
        at = unit, np.zeros(len(EFFECTS))
        error = surfaces.noise_at(unit) / 50
        corrected = surfaces.corrected(*at, surfaces.mean(*at)[0], error)
        assert (
            astray(corrected, measured, (), ALL) < 0.2 * astray(surfaces, measured, (), ALL)
        ).all()
