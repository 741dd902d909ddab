"""A case whose target is a curve, from the lab file to the page, in a world with a known answer."""

import json
import shutil

import numpy as np
import pytest

from calibrator.check import check_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.foresight.impossible import require_possible
from calibrator.foresight.values import resolved
from calibrator.plan.run import collect, run_plan
from calibrator.runs.curves import companion
from calibrator.search.calibrate import calibrate
from calibrator.verification.verify import validate, verify
from tests.conftest import space_for
from tests.curve_world import (
    TRUTH,
    crater,
    curves_of,
    photographed,
    photographed_heap,
    scalar_row,
    world,
    write,
)
from tests.stand_in import World, lacking_nothing, put_in_place

ROWS = (
    "conical_pile,profile_height,heap.csv,,5,m,calibrate\n"
    "hourglass,profile_height,crater.csv,,5,m,held_out\n"
) + scalar_row("hourglass", "bulk_density")
OPTIONS = '[targets."conical_pile.profile_height"]\nscale_error = 0.01\n'
HEAP = "conical_pile.profile_height"


def measured():
    """The two photographs."""
    curved = photographed(np.random.default_rng(3), crater)
    return {"heap.csv": photographed_heap(), "crater.csv": curved}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder of the case, all verbs done."""
    folder = tmp_path_factory.mktemp("curve")
    with pytest.MonkeyPatch.context() as patch:
        put_in_place(patch, world())
        path = write(folder, ROWS, measured(), OPTIONS)
        assert main(["all", str(path), "--results", str(folder / "results")]) == 0
    return folder


def test_the_frictions_behind_the_photograph_are_found(done):
    summary = json.loads((done / "results" / "toy" / "summary.json").read_text())
    for profile in summary["calibrate"]["identifiability"]["parameters"]:
        low, high = profile["interval_95"]
        assert low <= TRUTH[profile["name"]] <= high
        assert profile["pinned"]
    assert summary["calibrate"]["reachability"]["all"]


def test_verification_and_validation_compare_whole_curves(done):
    summary = json.loads((done / "results" / "toy" / "summary.json").read_text())
    for verdict, key, runs in (
        (summary["verify"]["candidates"]["compromise"], HEAP, 5),
        (summary["validate"], "hourglass.profile_height", 4),
    ):
        (curve,) = verdict["curves"]
        assert curve["key"] == key and curve["verdict"] == "met"
        own = [row for row in verdict["responses"] if row["key"].startswith(f"{key}_")]
        assert len(own) == curve["components"]
        mean = np.mean(curve["simulated"], axis=0)
        off = np.sqrt(np.mean((mean - curve["measured"]) ** 2))
        assert len(curve["simulated"]) == runs
        assert curve["difference"] == pytest.approx(off)
        # of the difference the components tell all but what seeds add beside their shapes
        told = np.sqrt(sum((row["simulated"] - row["target"]) ** 2 for row in own))
        assert 0.3 * off < told <= off * 1.000001 < curve["band"]


def test_the_page_shows_the_curve_with_its_band(done):
    page = (done / "results" / "toy" / "report.html").read_text()
    assert "Measured curves against those of the recommended set" in page
    figures = {path.name for path in (done / "results" / "toy" / "figures").iterdir()}
    assert {
        "curve_conical_pile_profile_height.png",
        "curve_hourglass_profile_height.png",
    } <= figures


def test_a_shipped_database_with_its_curves_gives_the_same_targets(done, tmp_path, monkeypatch):
    made = space_for(done / "toy.toml", done / "results")
    shipped = '[run]\nshipped = "runs.csv"\n'
    there = space_for(write(tmp_path, ROWS, measured(), OPTIONS + shipped), tmp_path / "results")
    database = made.path / "database.csv"
    shutil.copy(database, tmp_path / "runs.csv")
    monkeypatch.setattr("calibrator.check.examine", lacking_nothing)
    for verb in (check_case, calibrate):
        with pytest.raises(CalibratorError, match=r"left no profile_height.*runs_curves\.npz"):
            verb(there)
    shutil.copy(companion(database), tmp_path / "runs_curves.npz")
    assert check_case(there).targets == (HEAP, "hourglass.bulk_density")
    calibration = calibrate(there)
    first = json.loads((made.path / "summary.json").read_text())["calibrate"]
    assert calibration.compromise.parameters == first["candidates"]["compromise"]["parameters"]
    assert calibration.fingerprint == first["fingerprint"]


def test_another_photograph_makes_the_calibration_stale(done, tmp_path):
    results = tmp_path / "results"
    shutil.copytree(done / "results", results)
    other = measured() | {"heap.csv": photographed(np.random.default_rng(9))}
    space = space_for(write(tmp_path, ROWS, other, OPTIONS), results)
    with pytest.raises(CalibratorError, match="targets changed since calibrate"):
        verify(space)


def test_a_curve_that_grains_cannot_form_is_missed_and_said_to_be_out_of_reach(
    tmp_path, monkeypatch
):
    put_in_place(monkeypatch, world())
    rippled = {"heap.csv": photographed(np.random.default_rng(3), bump=0.5e-3)}
    row = "conical_pile,profile_height,heap.csv,,5,m,calibrate\n"
    space = space_for(write(tmp_path, row, rippled), tmp_path / "results")
    run_plan(space)
    assert f"{HEAP}_difference" in calibrate(space).reachability.missed
    found = verify(space)
    assert not found.passed
    assert "MISSED" in found.candidates["compromise"].curves[0].line


def test_an_adaptive_design_confirms_a_set_that_meets_the_curve(tmp_path, monkeypatch):
    put_in_place(monkeypatch, world())
    plan = ("sets = 14\nreplicates = 2", 'design = "adaptive"\nsets = 8\nreplicates = 3')
    path = write(tmp_path, ROWS, measured(), OPTIONS)
    path.write_text(path.read_text().replace(*plan))
    space = space_for(path, tmp_path / "results")
    found = run_plan(space)
    assert found.ended == "confirmed"
    collect(space)
    calibration = calibrate(space)
    assert "confirmed" in calibration.compromise_reason
    assert verify(space).passed
    assert validate(space).curves[0].difference is not None


def test_check_refuses_a_curve_whose_scatter_no_replicate_would_show(tmp_path):
    path = write(tmp_path, ROWS, measured(), OPTIONS)
    path.write_text(path.read_text().replace("replicates = 2", "replicates = 1"))
    case = space_for(path, tmp_path).case
    with pytest.raises(CalibratorError, match="how its points scatter together: raise"):
        require_possible(case, resolved(case))


def coarse_too(setup, p, seed):
    """Coarse grains make heaps a tenth higher, and hardly wider."""
    found = curves_of(setup, p, seed)
    if found and p["particle_radius"] > 1.5e-3:
        found["profile_height"] = 1.1 * found["profile_height"]
    return found


def test_cheap_runs_carry_the_curves_of_dear_ones(tmp_path, monkeypatch):
    put_in_place(monkeypatch, World(curves_of=coarse_too))
    cheap = "[fidelity]\ndear_sets = 5\n[fidelity.values]\nparticle_radius = 2e-3\n"
    path = write(tmp_path, ROWS, measured(), OPTIONS + cheap)
    assert main(["all", str(path), "--results", str(tmp_path / "results")]) == 0
    summary = json.loads((tmp_path / "results" / "toy" / "summary.json").read_text())
    for profile in summary["calibrate"]["identifiability"]["parameters"]:
        low, high = profile["interval_95"]
        assert low <= TRUTH[profile["name"]] <= high
        assert profile["pinned"]
    own = [kinds for kinds in summary["calibrate"]["fidelity"] if kinds["key"].startswith(HEAP)]
    assert own and all(kinds["full"] == 10 and kinds["cheap"] == 28 for kinds in own)
    assert own[0]["slope"] == pytest.approx(1 / 1.1, abs=0.1)
    (curve,) = summary["verify"]["candidates"]["compromise"]["curves"]
    assert curve["verdict"] == "met"
