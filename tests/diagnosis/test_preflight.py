"""`calibrator preflight`: what could be seen, before anything is measured."""

import json
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest

from calibrator.cli import main
from calibrator.diagnosis.explanations import Effect
from calibrator.diagnosis.gap import DETECTABLE, fingerprints, projection
from calibrator.diagnosis.preflight import smallest_sizes
from calibrator.diagnosis.verdict import Linear
from calibrator.summary import schema
from tests.toy_laboratory import lab


def test_preflight_says_in_physical_units_what_could_be_seen_and_which_experiment_would_help(
    space, tmp_path, capsys
):
    here = space()
    assert main(["preflight", str(here.case.path), "--results", str(tmp_path / "results")]) == 0
    said = capsys.readouterr().out
    assert "bed_viscosity [Pa s], plausible 0.001" in said and "seen from" in said
    assert "hourglass@wide_neck helps most" in said
    summary = json.loads((here.path / "summary.json").read_text())
    jsonschema.validate(summary, schema())
    found = summary["preflight"]
    assert found["self_test"]["none"]["no gap"] >= 10
    right = found["self_test"]["bond_number"]
    assert right["bond_number"] >= 6 and "bed_viscosity" not in right
    power = {p["effect"]: p for p in found["effects"]}["bond_number"]
    rows = [line.split(",") for line in lab().splitlines()]
    others = [rows[0], *([*row[:3], str(0.5 * float(row[3])), *row[4:]] for row in rows[1:])]
    # the values play no part
    (here.case.path.parent / "lab.csv").write_text("".join(",".join(row) + "\n" for row in others))
    assert main(["preflight", str(here.case.path), "--results", str(tmp_path / "results")]) == 0
    assert json.loads((here.path / "summary.json").read_text())["preflight"] == found
    assert (
        0 < power["smallest_detectable"] <= power["smallest_nameable"] < 1
        and 0 < power["absorbed"] < 1
    )


class Saturating:
    """Surfaces of four observables, moved by one effect that levels off, with noise of its own."""

    def __init__(self, noise):
        self.noise = noise

    def mean(self, units, amplitudes):
        size = np.atleast_2d(amplitudes)[:, :1]
        return 10 * (size - 0.3 * size**2) * np.array([[1.0, 0.0, 0.0, 0.0]])

    def error(self, unit, amplitude):
        return np.eye(4) * (0.01 + (self.noise * amplitude[0]) ** 2)


def pictured():
    project = projection(np.eye(4), np.zeros((4, 0)))
    none = SimpleNamespace(unit=np.array([0.5]))
    prints = fingerprints(("bond_number",), ("+",), np.eye(4)[:, :1] * 10, project)
    return Linear(none, np.eye(4)[:, :1] * 10, project, np.zeros(4), prints)


def test_sizes_follow_the_change_and_not_its_slope_and_noise_makes_no_effect_larger():
    effect, used = Effect("bond_number", "+", 1.0), np.arange(4)
    seen, named = smallest_sizes([effect], pictured(), Saturating(0.0), used)
    true = (1 - np.sqrt(1 - 4 * 0.3 * DETECTABLE / 10)) / 0.6
    assert seen == pytest.approx([true], rel=0.01) and named > seen > DETECTABLE / 10
    noisy, _ = smallest_sizes([effect], pictured(), Saturating(2.0), used)
    assert noisy > seen
    assert smallest_sizes([effect], pictured(), Saturating(9.0), used)[0] == np.inf
