"""The tables for engines that are not run: numbers from hand-made formulas."""

import csv

import pytest

from calibrator.handover import tables
from tests.handover.materials import material

SAND = dict(young_modulus=2.6e6, poisson_ratio=0.3, rolling_friction=0.3, sliding_friction=0.4)


def rows(text):
    """(name, value, meaning) of each row."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return [(r["name"], float(r["value"]), r["meaning"]) for r in csv.DictReader(lines)]


def test_mercurydpm_takes_reduced_moduli_and_half_the_rolling_coefficient():
    found = {name: value for name, value, _ in rows(tables.mercury(material(**SAND)))}
    assert found["effective elastic modulus"] == pytest.approx(2.6e6 / 1.82)
    assert found["setEffectiveShearModulus"] == pytest.approx(1e6 / 3.4)  # G = 1 MPa
    assert found["setRollingFrictionCoefficient"] == pytest.approx(0.15)
    assert found["rolling stiffness over k_t R_eff^2"] == 4.0


def test_edem_s_rolling_coefficient_depends_on_its_model_and_on_what_is_touched():
    found = rows(tables.edem(material(**SAND, wall_friction_ratio=0.5)))
    rolling = [(v, about) for name, v, about in found if name == "Coefficient of Rolling Friction"]
    assert [value for value, _ in rolling] == pytest.approx([0.15, 0.3, 0.3, 0.3, 0.3, 0.3])
    assert [about.split()[0] for _, about in rolling] == ["Standard"] * 2 + ["RVD"] * 2 + [
        "Type"
    ] * 2
    static = [value for name, value, _ in found if name == "Coefficient of Static Friction"]
    assert static == pytest.approx([0.4, 0.2])
    assert {n: v for n, v, _ in found}["Shear Modulus"] == pytest.approx(1e6)


@pytest.mark.parametrize("table", [tables.mercury, tables.edem])
def test_a_table_says_that_no_run_was_compared(table):
    assert "was compared with YADE's" in " ".join(table(material()).replace("\n#", "").split())
