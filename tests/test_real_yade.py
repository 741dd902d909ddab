"""The three set-ups on the real YADE, tiny: by hand, from a table line, and from the driver."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from benchmarks.runs import rolling_scans
from calibrator.case.physics import LARGEST_STEP_SHARE, contact_time, rayleigh_time
from calibrator.case.vocabulary import EFFECTS, RESPONSES, SCRIPTS, parameters_of
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.request import Request, write_table
from tests.conftest import processes_in

pytestmark = pytest.mark.yade

SMALL = {
    "hourglass": dict(
        fill_mass=2e-3, cylinder_diameter=16e-3, neck_diameter=10e-3, young_modulus=1e6, seed=3
    ),
    "ledge": dict(box_length=16e-3, box_width=8e-3, fill_height=10e-3, young_modulus=1e6, seed=3),
    "conical_pile": dict(
        cylinder_diameter=12e-3,
        fill_height=10e-3,
        lift_speed=0.08,
        lift_height=10e-3,
        young_modulus=1e6,
        seed=3,
    ),
}
RAYLEIGH = ("particle_radius", "particle_density", "young_modulus", "poisson_ratio")
MAY_BE_MISSING = {  # a slope of a few grains cannot be fitted on each side
    "drained_angle_of_repose_deg", "drained_angle_error_deg", "drained_curvature",
    "drained_asymmetry_deg", "mass_flow_rate", "late_early_ratio", "onset_delay",
    "rate_fluctuation", "emptying_time", "pile_asymmetry_deg", "pile_angle_of_repose_deg",
    "pile_angle_error_deg", "pile_curvature", "pile_apex_rounding", "ledge_angle_of_repose_deg",
    "ledge_angle_error_deg", "ledge_curvature",
}  # fmt: skip


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """Records and folder of one run of each set-up by the driver."""
    assert shutil.which("yade"), "yade is not on the PATH: run `make yade`"
    folder = RunFolder(tmp_path_factory.mktemp("driven"))
    records = run(folder, [Request.of(setup, **p) for setup, p in SMALL.items()])
    return folder, {r.request.setup: r for r in records}


@pytest.mark.parametrize("setup", SMALL)
def test_the_driver_gets_a_settled_run_with_every_response(driven, setup):
    record = driven[1][setup]
    assert (record.status, record.error) == ("ok", "")
    expected = {n for n, q in RESPONSES.items() if setup in q.setups}
    assert expected - MAY_BE_MISSING <= set(record.responses) <= expected
    assert record.diagnostics["kinetic_energy"] < 1e-15
    assert 1400 < record.responses["bulk_density"] < 1750
    numbers = {n: v for n, v in record.request.parameters.items() if not isinstance(v, str)}
    # soft grains
    assert record.diagnostics["time_step"] == pytest.approx(
        LARGEST_STEP_SHARE * contact_time(numbers)
    )
    assert record.diagnostics["rayleigh_fraction"] < 0.4


def test_the_curves_of_a_discharge_agree_with_its_responses(driven):
    folder, records = driven
    record = records["hourglass"]
    curves = np.load(folder.curves(record.run_id))
    left = len(curves["filled"]) - len(curves["final"])
    grain = 4 / 3 * np.pi * 1e-9 * 2650
    assert curves["passed_mass"][-1] == pytest.approx(left * grain)
    assert record.responses["residual_mass"] == pytest.approx(len(curves["final"]) * grain)
    assert record.responses["discharge_time"] == pytest.approx(curves["time"][-1])
    assert np.all(np.diff(curves["passed_mass"]) >= 0)
    assert np.hypot(*curves["final"][:, :2].T).max() < 8e-3 and curves["final"][:, 2].min() >= 0


@pytest.mark.parametrize("setup", SMALL)
def test_the_oracles_of_the_benchmarks_measure_as_the_scripts_do(driven, setup):
    """LIGGGHTS and LAMMPS go through benchmarks.runs.rolling_scans: same grains, same numbers."""
    folder, records = driven
    record = records[setup]
    curves = np.load(folder.curves(record.run_id))
    filled, final = (curves[name].astype(float) for name in ("filled", "final"))
    curve = (curves["time"], curves["passed_mass"]) if setup == "hourglass" else None
    status, found = rolling_scans.responses(setup, record.request.parameters, filled, final, curve)
    assert status == record.status and "bulk_density" in found
    sides = [n for n in found if n.endswith("asymmetry_deg")]
    # curves are stored in single precision, and rounding decides which side has the middle column
    # of a raster with an odd number of pixels
    assert all(abs(found.pop(n) - record.responses[n]) < 0.2 for n in sides)
    assert found == pytest.approx({n: record.responses[n] for n in found}, rel=1e-5)


def by_hand(folder, setup):
    """Carry out the first line of folder/runs.table as a user would."""
    subprocess.run(
        ["yade", "-n", "-x", str(SCRIPTS / f"{setup}.py")],
        cwd=folder,
        env={"PATH": "/usr/bin:/bin", "YADE_BATCH": "runs.table:2", "HOME": str(folder)},
        capture_output=True,
        timeout=300,
    )


@pytest.mark.parametrize("setup", SMALL)
def test_a_table_line_by_hand_gives_the_same_record_bit_for_bit(driven, tmp_path, setup):
    record = driven[1][setup]
    write_table(tmp_path / "runs.table", [record.request])
    by_hand(tmp_path, setup)
    twin = json.loads((tmp_path / "records" / f"{record.run_id}.json").read_text())
    assert twin["responses"] == record.responses
    assert twin["diagnostics"]["steps"] == record.diagnostics["steps"]


def test_after_kill_9_in_mid_run_the_database_of_real_runs_is_the_same_to_the_byte(tmp_path):
    asked = [Request.of("ledge", **SMALL["ledge"] | {"seed": seed}) for seed in (1, 2, 3, 4)]
    Database(run(RunFolder(tmp_path / "whole"), asked)).write(tmp_path / "whole.csv")
    broken = RunFolder(tmp_path / "broken")
    code = (
        "from calibrator.runs.folder import RunFolder; from calibrator.runs.local import run;"
        "from calibrator.runs.request import Request; from pathlib import Path;"
        f"box = {SMALL['ledge']}; run(RunFolder(Path({str(broken.path)!r})),"
        " [Request.of('ledge', **box | {'seed': s}) for s in (1, 2, 3, 4)])"
    )
    driver = subprocess.Popen(
        [sys.executable, "-c", code], cwd=SCRIPTS.parent, start_new_session=True
    )
    end = time.monotonic() + 120
    while not list(broken.path.glob("records/*.json")):
        assert time.monotonic() < end, "no run finished"
        time.sleep(0.1)
    driver.kill()
    for process in processes_in(broken.path):
        os.kill(process, signal.SIGKILL)
    driver.wait()
    Database(run(broken, asked)).write(tmp_path / "broken.csv")
    assert (tmp_path / "broken.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()


def test_an_impossible_geometry_is_an_input_error_with_a_remedy(tmp_path):
    request = Request.of("hourglass", neck_diameter=1.5e-3)
    (record,) = run(RunFolder(tmp_path), [request])
    assert record.status == "input" and "widen the neck" in record.error


def test_inelastic_grains_rest_at_the_scripts_step_and_are_unstable_at_a_longer_one(tmp_path):
    """A fifth of the Rayleigh time is what `check` once advised for a restitution below 0.6."""
    inelastic = {setup: dict(p, restitution=0.3) for setup, p in SMALL.items()}
    good = Request.of("ledge", **inelastic["ledge"])
    crossing = float(rayleigh_time({n: good.value(n) for n in RAYLEIGH}))
    bad = [Request.of(s, **p, time_step=0.2 * crossing) for s, p in inelastic.items()]
    first, *others = run(RunFolder(tmp_path / "runs"), [good, *bad])
    assert (first.status, first.error) == ("ok", "")
    assert first.diagnostics["time_step"] < 0.1 * crossing
    assert [r.status for r in others] == ["unstable"] * 3
    for record in others:
        assert "a grain moves at" in record.error and "lower time_step" in record.error
        assert "pouring_velocity" not in record.error and record.responses == {}


def test_too_little_simulated_time_is_not_settled(tmp_path):
    (record,) = run(
        RunFolder(tmp_path), [Request.of("ledge", **SMALL["ledge"] | {"longest_time": 0.05})]
    )
    assert record.status == "not_settled" and record.responses == {}


def test_a_neck_of_two_grains_clogs_and_has_no_discharge_time(tmp_path):
    tight = SMALL["hourglass"] | {
        "neck_diameter": 4.2e-3,
        "sliding_friction": 0.8,
        "rolling_friction": 0.5,
    }
    (record,) = run(RunFolder(tmp_path), [Request.of("hourglass", **tight)])
    assert record.status == "clogged" and set(record.responses) == {"bulk_density"}


def test_the_ledge_angle_grows_with_friction_and_with_adhesion(tmp_path):
    box = dict(box_length=16e-3, box_width=6.4e-3, fill_height=11e-3, young_modulus=0.5e6)
    base = dict(rolling_friction=0.05, sliding_friction=0.2)
    more = {
        "base": {},
        "rolling": {"rolling_friction": 0.4},
        "sliding": {"sliding_friction": 0.7},
        "adhesion": {"bond_number": 2.0},
    }
    asked = {
        name: [Request.of("ledge", **{**box, **base, **own}, seed=seed) for seed in (1, 2)]
        for name, own in more.items()
    }
    records = {
        r.run_id: r for r in run(RunFolder(tmp_path), [q for own in asked.values() for q in own])
    }
    angle = {
        n: np.mean([records[q.run_id].responses["ledge_equivalent_angle_deg"] for q in own])
        for n, own in asked.items()
    }
    assert angle["base"] + 2 < min(angle["rolling"], angle["sliding"], angle["adhesion"])


def test_only_the_ratio_of_modulus_to_density_matters(tmp_path):
    """Twice the density, modulus, filled mass and rest threshold: every bit is the same.

    A power of two rounds nothing.
    """
    heavier = {
        "particle_density": 2 * 2650.0,
        "young_modulus": 2e6,
        "fill_mass": 4e-3,
        "rest_kinetic_energy": 2e-15,
    }
    folder = RunFolder(tmp_path)
    pair = [
        Request.of("hourglass", **SMALL["hourglass"]),
        Request.of("hourglass", **{**SMALL["hourglass"], **heavier}),
    ]
    light, heavy = run(folder, pair)
    assert light.diagnostics["steps"] == heavy.diagnostics["steps"]
    with np.load(folder.curves(light.run_id)) as one, np.load(folder.curves(heavy.run_id)) as other:
        for name in ("filled", "final", "time"):
            assert np.array_equal(one[name], other[name]), name
    for name, value in light.responses.items():
        assert heavy.responses[name] == (2 * value if "kg" in RESPONSES[name].unit else value), name


@pytest.mark.parametrize("setup", SMALL)
def test_a_run_with_every_effect_written_down_as_off_is_the_one_without_these_columns(
    driven, tmp_path, setup
):
    folder, records = driven
    record = records[setup]
    write_table(tmp_path / "runs.table", [record.request])
    header, line = (tmp_path / "runs.table").read_text().splitlines()
    off = {n: q.default for n, q in parameters_of(setup).items() if q.unmentioned}
    assert not set(off) & set(header.split())
    text = f"{header} {' '.join(off)}\n{line} {' '.join(map(repr, off.values()))}\n"
    (tmp_path / "runs.table").write_text(text)
    by_hand(tmp_path, setup)
    twin = json.loads((tmp_path / "records" / f"{record.run_id}.json").read_text())
    assert twin["responses"] == record.responses and twin["parameters"] == record.request.parameters
    with (
        np.load(folder.curves(record.run_id)) as one,
        np.load(tmp_path / "records" / f"{record.run_id}.npz") as other,
    ):
        assert all(np.array_equal(one[name], other[name]) for name in one.files)


@pytest.fixture(scope="module")
def affected(tmp_path_factory):
    """{effect: record of the small hourglass with it}, and of the one without under None."""
    sizes = {
        "bond_number": 2.0,
        "bed_viscosity": 0.02,
        "wall_friction_ratio": 0.1,
        "neck_error": 2e-3,
        "tilt_deg": 8.0,
    }
    sizes |= {"twisting_stiffness": 1.0, "size_spread": 0.25, "clump_aspect": 1.3, "shaking": 1.0}
    asked = {
        name: Request.of("hourglass", **SMALL["hourglass"], **{name: value})
        for name, value in sizes.items()
    }
    asked[None] = Request.of("hourglass", **SMALL["hourglass"])
    done = {
        r.run_id: r
        for r in run(RunFolder(tmp_path_factory.mktemp("affected")), list(asked.values()))
    }
    return {name: done[request.run_id] for name, request in asked.items()}


@pytest.mark.parametrize("effect", [*EFFECTS, "shaking"])
def test_an_effect_makes_another_run_that_comes_to_rest(affected, effect):
    record, plain = affected[effect], affected[None]
    assert record.status in ("ok", "clogged") and record.error == ""
    assert record.run_id != plain.run_id and record.responses != plain.responses


def test_effects_do_to_the_hourglass_what_physics_says(tmp_path):
    """Means of four seeds, as the small hourglass scatters by more than some effects.

    It does so differently on every processor.
    """

    def mean(response, **effect):
        asked = [
            Request.of("hourglass", **{**SMALL["hourglass"], "seed": seed}, **effect)
            for seed in range(1, 5)
        ]
        return np.nanmean(
            [r.responses.get(response, np.nan) for r in run(RunFolder(tmp_path), asked)]
        )

    density = mean("bulk_density")
    assert mean("bulk_density", bond_number=2.0) < 0.99 * density  # adhesive grains pack loosely
    # grains that land gently do, too
    assert mean("bulk_density", bed_viscosity=0.02) < 0.99 * density
    assert mean("residual_fraction", neck_error=2e-3) < 0.85 * mean("residual_fraction")


def test_grains_of_other_shapes_and_sizes_come_to_rest_in_ledge_and_pile_too(tmp_path):
    """With drag, whose engine has to know the spheres of a clump."""
    kinds = ({"clump_aspect": 1.4}, {"size_spread": 0.2})
    asked = [
        Request.of(s, **SMALL[s], **kind, bed_viscosity=1e-3)
        for s in ("ledge", "conical_pile")
        for kind in kinds
    ]
    # Clumps that stand on end spun for ever: five heaps of eight never came to rest.
    heap = {**SMALL["conical_pile"], "clump_aspect": 1.4}
    asked += [Request.of("conical_pile", **{**heap, "seed": seed}) for seed in range(4, 8)]
    for record in run(RunFolder(tmp_path), asked):
        assert (record.status, record.error) == ("ok", "")
        assert 1350 < record.responses["bulk_density"] < 1800


def test_clumps_of_several_sizes_are_refused_rather_than_run_with_one_size(tmp_path):
    (record,) = run(
        RunFolder(tmp_path),
        [Request.of("ledge", **SMALL["ledge"], clump_aspect=1.3, size_spread=0.2)],
    )
    assert record.status == "input" and "cannot be combined" in record.error
