"""The rotating drum on the real YADE, small: steady, steeper with friction, similar at any size."""

import json
import os
import subprocess

import numpy as np
import pytest

from calibrator.case.vocabulary import RESPONSES, SCRIPTS
from calibrator.runs.request import Request, write_table

pytestmark = [pytest.mark.yade, pytest.mark.slow]

SMALL = dict(
    drum_diameter=24e-3, drum_depth=7e-3, young_modulus=2.5e5, rotation_rpm=90.0, restitution=0.7,
    sliding_friction=0.5, rolling_friction=0.1, seed=3,
)  # fmt: skip
LARGE = dict(
    drum_diameter=48e-3, drum_depth=14e-3, particle_radius=2e-3, young_modulus=5e5,
    rotation_rpm=90 / 2**0.5, sampling_interval=2e-3 * 2**0.5, longest_time=5 * 2**0.5,
)  # fmt: skip
MIX = "0.9:0.3|1:0.4|1.1:0.3"
RUNS = {
    "small": SMALL,
    "large": {**SMALL, **LARGE},
    "slippery": {**SMALL, "sliding_friction": 0.2, "rolling_friction": 0.02},
    "mixed": {**SMALL, "size_distribution": MIX},
    "hasty": {**SMALL, "settling_turns": 0.0, "measuring_turns": 1, "longest_time": 0.7},
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Record and arrays of each run, which are made when they are asked for."""
    folder, found = tmp_path_factory.mktemp("drums"), {}

    def run(name):
        if name not in found:
            request = Request.of("rotating_drum", **RUNS[name])
            write_table(folder / "runs.table", [request])
            subprocess.run(
                ["yade", "-n", "-x", "-j1", str(SCRIPTS / "rotating_drum.py")],
                cwd=folder,
                env={**os.environ, "YADE_BATCH": "runs.table:2"},
                capture_output=True,
                timeout=1800,
            )
            record = json.loads((folder / "records" / f"{request.run_id}.json").read_text())
            assert record["parameters"] == request.parameters
            arrays = folder / "records" / f"{request.run_id}.npz"
            found[name] = record, dict(np.load(arrays)) if arrays.exists() else {}
        return found[name]

    return run


def test_a_drum_is_steady_and_measures_every_response(made):
    record, arrays = made("small")
    assert (record["status"], record["error"]) == ("ok", None)
    assert set(record["responses"]) == {
        n for n, q in RESPONSES.items() if "rotating_drum" in q.setups
    }
    # whole turns, and a look's length more
    turns = record["diagnostics"]["turns"]
    assert turns >= 3 and turns % 1 < 0.02
    assert np.ptp(arrays["time"]) == pytest.approx((turns - 1) * 60 / 90, abs=0.01)
    # no trend that the scatter of quarter turns does not explain
    late = arrays["angle_deg"][arrays["time"] > arrays["time"][-1] - 2 * 60 / 90]
    first, second = (half.mean() for half in np.array_split(late, 2))
    assert abs(first - second) < 6 * record["responses"]["drum_angle_error_deg"] + 0.25
    assert record["diagnostics"]["particles_left"] == record["diagnostics"]["particles"]


def test_the_picture_of_a_drum_is_that_of_its_grains(made):
    record, arrays = made("small")
    seen, share = arrays["seen"], record["responses"]["drum_filled_share"]
    pixel = 24e-3 / len(seen)
    assert (seen > 0.5).sum() * pixel**2 / (np.pi * 12e-3**2) == pytest.approx(share, abs=0.03)
    reach = np.hypot(arrays["final"][:, 0], arrays["final"][:, 2])
    assert reach.max() < 11.1e-3 and np.abs(arrays["final"][:, 1]).max() < 2.6e-3


def test_the_angle_grows_with_friction(made):
    rough, slippery = (made(n)[0]["responses"] for n in ("small", "slippery"))
    assert rough["drum_angle_deg"] > slippery["drum_angle_deg"] + 3


def test_a_doubled_drum_at_the_same_froude_number_has_the_same_profile(made):
    """Lengths twice, times sqrt(2) times, moduli twice: the same drum, up to its scatter."""
    (small, one), (large, two) = made("small"), made("large")
    assert small["diagnostics"]["particles"] == large["diagnostics"]["particles"]
    a, b = (r["responses"] for r in (small, large))
    error = np.hypot(a["drum_angle_error_deg"], b["drum_angle_error_deg"])
    assert a["drum_angle_deg"] == pytest.approx(b["drum_angle_deg"], abs=3 * error + 0.5)
    assert a["drum_filled_share"] == pytest.approx(b["drum_filled_share"], abs=0.01)
    across = np.linspace(-0.6, 0.7, 27)
    profiles = [
        np.interp(across, c["profile_x"] / r, c["profile_height"] / r)
        for c, r in ((one, 12e-3), (two, 24e-3))
    ]
    assert np.abs(profiles[0] - profiles[1]).max() < 0.06  # a third of a grain


def test_grains_of_given_sizes_turn_too(made):
    record, _ = made("mixed")
    assert record["status"] == "ok"
    cubes = sum(s * d**3 for d, s in ((0.9, 0.3), (1.0, 0.4), (1.1, 0.3)))
    fewer = made("small")[0]["diagnostics"]["particles"] / record["diagnostics"]["particles"]
    assert fewer == pytest.approx(cubes, rel=0.01)


def test_a_drum_that_is_not_steady_in_time_has_no_angle(made):
    record, _ = made("hasty")
    assert (record["status"], record["responses"]) == ("not_settled", {})
    assert record["error"].startswith("turning: not steady after 0.7 s of simulated time")
