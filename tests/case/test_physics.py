"""Formulas of the contact that both Pythons know."""

import numpy as np
import pytest

from calibrator.case.physics import (
    LARGEST_SHARE,
    LARGEST_STEP_SHARE,
    contact_time,
    damped_step,
    damped_steps,
    damping_ratio,
    floored,
    rayleigh_time,
    time_step,
    time_step_warning,
)
from calibrator.case.vocabulary import PARAMETERS
from tests.reference_paper import INDIVIDUALS, PAPER


def test_rayleigh_time_follows_its_formula():
    columns = {
        "particle_radius": 1e-3,
        "particle_density": 2500.0,
        "young_modulus": 2.6e7,
        "poisson_ratio": 0.3,
    }
    assert float(rayleigh_time(columns)) == pytest.approx(
        np.pi * 1e-3 * np.sqrt(2500 / 1e7) / 0.9255, rel=1e-9
    )


def test_time_step_above_two_fifths_of_the_shortest_rayleigh_time_warns_with_share_and_remedy():
    columns = PAPER.columns(np.vstack([INDIVIDUALS, [0.1, 0.2, 0.3e-3, 2600.0, 500e6]]))
    limit = 0.4 * rayleigh_time(columns).min()
    assert time_step_warning(0.999 * limit, columns) is None
    assert "40%" in time_step_warning(1.001 * limit, columns)
    # the paper's step, in the stiffest corner of its own box
    warning = time_step_warning(2e-6, columns)
    assert "53%" in warning and "lower it to 1.5e-06 s" in warning


def grains(**given):
    """Defaults of the scripts, with other numbers."""
    numbers = {n: q.default for n, q in PARAMETERS.items() if isinstance(q.default, (int, float))}
    return {**numbers, **given}


SOFT = {"young_modulus": 4e6, "particle_radius": 3e-3, "particle_density": 4000.0}


@pytest.mark.parametrize(
    ("restitution", "unstable"),
    [(0.3, 0.1131), (0.4, 0.2), (0.5, 0.32), (0.6, 0.4525)],
)
def test_the_step_stays_well_below_those_at_which_beds_exploded_or_never_rested(
    restitution, unstable
):
    """Shares of the Rayleigh time: grid/damped_step.csv, and the failure at 0.2 for 0.4."""
    p = grains(**SOFT, restitution=restitution)
    share = time_step(p) / float(rayleigh_time({n: np.array(v) for n, v in p.items()}))
    assert 0.4 * unstable < share < 0.75 * unstable


@pytest.mark.parametrize("restitution", [0.6, 0.7, 0.9, 0.95])
@pytest.mark.parametrize("modulus", [0.5e6, 4e6, 1e8, 1e11])
def test_elastic_grains_keep_their_step_to_the_bit(restitution, modulus):
    p = grains(young_modulus=modulus, restitution=restitution)
    crossing = float(rayleigh_time({n: np.array(v) for n, v in p.items()}))
    before = min(LARGEST_SHARE * crossing, LARGEST_STEP_SHARE * contact_time(p))
    assert time_step(p) == before
    assert time_step({**p, "time_step": 1e-6}) == 1e-6


def test_the_damped_step_of_columns_is_that_of_each_row():
    rows = [grains(restitution=e, young_modulus=m) for e in (0.2, 0.5) for m in (1e6, 1e7)]
    columns = {n: np.array([row[n] for row in rows]) for n in rows[0]}
    assert damped_steps(columns).tolist() == [damped_step(row) for row in rows]


def test_the_damping_ratio_falls_with_restitution_and_a_limit_is_rounded_down():
    ratios = [damping_ratio(e) for e in (0.1, 0.3, 0.5, 0.9)]
    assert ratios == sorted(ratios, reverse=True)
    assert [floored(x) for x in (0.1367, 1.999e-5, 0.13, 2e-6)] == [
        "0.13",
        "1.9e-05",
        "0.13",
        "2e-06",
    ]
