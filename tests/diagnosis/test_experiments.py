"""The runs behind a diagnosis: amplitudes, and the sets at which they are run."""

from pathlib import Path

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.case.vocabulary import EFFECTS
from calibrator.diagnosis import experiments as ex
from tests.toy_laboratory import NUISANCES, SMALL, lab

REPO = Path(__file__).resolve().parents[2]


def test_amplitudes_end_where_their_columns_do():
    for effect in ex.library(read_case(REPO / "cases" / "missing_effect.toml")):
        quantity = EFFECTS[effect.name]
        for bound in effect.bounds:
            assert quantity.low - 1e-12 <= ex.column_value(effect, bound) <= quantity.high + 1e-12


def test_a_case_has_its_own_plausible_size_of_an_effect(write_case, tmp_path):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    case = read_case(
        write_case(
            ("[run]", f"{SMALL[1][:-5]}[diagnosis.scales]\nbed_viscosity = 4e-3\n[run]"), lab=lab()
        )
    )
    drag = next(e for e in ex.library(case) if e.name == "bed_viscosity")
    assert ex.column_value(drag, 1.5) == pytest.approx(6e-3)


def test_every_amplitude_of_an_effect_is_run_on_both_sides_of_every_parameter():
    case = read_case(REPO / "cases" / "missing_effect.toml")
    found, effects = ex.experiments(case, case.observables), ex.library(case)
    points = np.tile(
        ex.point(case, np.full(len(case.problem.names), 0.5)), (case.diagnosis.sets, 1)
    )
    asked = ex.change_requests(case, found, effects, points)[0]
    for k, effect in enumerate(effects):
        own = [r for r in asked if abs(ex.amplitudes(found[0], effects, [r])[0, k]) > 0]
        assert len(own) == case.diagnosis.effect_sets
        sides = ex.units(case, found[0], own) > 0.5
        sizes = ex.amplitudes(found[0], effects, own)[:, k].round(9)
        for size in set(abs(sizes)):
            assert (
                {True, False}
                == set(sides[abs(sizes) == size, 0])
                == set(sides[abs(sizes) == size, 1])
            ), (effect.name, size)


def test_a_negative_size_looks_below_the_default_only(write_case, tmp_path):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    own = (
        SMALL[1][:-5]
        .replace("bed_viscosity", "wall_friction_ratio", 1)
        .replace('nuisances = "nuisances.csv"\n', "")
    )
    smooth = f"{own}[diagnosis.scales]\nwall_friction_ratio = -0.4\n[run]"
    wall = ex.library(read_case(write_case(("[run]", smooth), lab=lab())))[1]
    assert [ex.column_value(wall, a) for a in (1.0, *wall.bounds)] == pytest.approx([0.6, 1.0, 0.0])
    assert min(
        ex.column_value(wall, ex.amplitude(wall, share)) for share in (0.1, 0.4, 0.6, 0.9)
    ) == pytest.approx(0.4)
