"""Formulas of the contact that both Pythons know."""

import numpy as np
import pytest

from calibrator.case.physics import rayleigh_time, time_step_warning
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
