"""A hourglass that clogs beyond a friction, from its runs to the page."""

import json

import numpy as np
import pytest

from calibrator.cli import main
from calibrator.plan.run import run_plan
from calibrator.search.calibrate import calibrate
from tests.conftest import space_for
from tests.stand_in import World, put_in_place

TRUTH = 0.25  # rolling friction behind the toy case's laboratory


def clogging_beyond(friction):
    return World(
        status_of=lambda setup, p, seed: (
            "clogged" if setup == "hourglass" and p["rolling_friction"] > friction else "ok"
        )
    )


def test_candidates_and_intervals_stay_where_runs_succeed(write_case, tmp_path, monkeypatch):
    put_in_place(monkeypatch, clogging_beyond(0.3))
    path, results = write_case(), tmp_path / "results"
    assert main(["all", str(path), "--results", str(results)]) == 0
    found = json.loads((results / "toy" / "summary.json").read_text())["calibrate"]
    chosen = [c["parameters"]["rolling_friction"] for c in found["candidates"].values()]
    assert max(chosen) < 0.31 and abs(chosen[0] - TRUTH) < 0.05
    profile = found["identifiability"]["parameters"][0]
    assert profile["interval_95"][0] < TRUTH + 0.01 and profile["interval_95"][1] < 0.32
    assert "hourglass runs clogged: candidates keep to where" in found["failures"][0]
    assert "candidates keep to where" in (results / "toy" / "report.html").read_text()


def test_what_is_met_only_where_runs_clog_is_not_within_reach(write_case, tmp_path, monkeypatch):
    put_in_place(monkeypatch, clogging_beyond(0.15))
    space = space_for(write_case(("sets = 14", "sets = 30")), tmp_path)
    run_plan(space)
    found = calibrate(space)
    assert not found.reachability.all
    assert any("only where runs fail" in s for s in found.reachability.alarms)
    assert max(c.parameters["rolling_friction"] for c in found.candidates.values()) < 0.18
    assert np.all(found.identifiability.accepted[:, 0] < 0.18)


@pytest.mark.parametrize("beyond", [0.3, 0.15])
def test_an_adaptive_design_learns_where_to_make_its_runs(
    write_case, tmp_path, monkeypatch, beyond
):
    made = put_in_place(monkeypatch, clogging_beyond(beyond))
    adaptive = (
        'design = "sobol"\nsets = 14\nreplicates = 2',
        'design = "adaptive"\nsets = 10\nreplicates = 3\nmost_runs = 40',
    )
    outcome = run_plan(space_for(write_case(adaptive), tmp_path))
    assert outcome.ended == ("confirmed" if beyond == 0.3 else "unreachable")
    proposed = [r for r in made.made if r.parameters["seed"] >= 10_000_000]
    clogged = [r for r in proposed if r.parameters["rolling_friction"] > beyond]
    assert len(clogged) <= 6
