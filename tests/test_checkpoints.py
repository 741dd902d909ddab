"""Long runs on the real YADE, killed and gone on with: the same to the last bit."""

import json
import shutil
import signal
import subprocess
import time

import numpy as np
import pytest

from calibrator.case.vocabulary import SCRIPTS
from calibrator.runs.local import clean_environment
from calibrator.runs.record import read_record
from calibrator.runs.request import Request, write_table
from tests.test_real_yade import SMALL
from tests.test_rotating_drum import SMALL as DRUM

pytestmark = pytest.mark.yade
EVERY = 3e5  # particle-steps: a second of these runs


@pytest.fixture(scope="module")
def scripts(tmp_path_factory):
    """The scripts, with checkpoints after a second instead of minutes."""
    folder = tmp_path_factory.mktemp("scripts") / "scripts"
    shutil.copytree(SCRIPTS, folder, ignore=shutil.ignore_patterns("__pycache__"))
    module = folder / "checkpoint.py"
    text = module.read_text()
    assert text.count("EVERY = 1e8") == 1
    module.write_text(text.replace("EVERY = 1e8", f"EVERY = {EVERY}"))
    return folder


def request_of(setup, **more):
    if setup == "rotating_drum":
        return Request.of(setup, **{**DRUM, **more})
    return Request.of(setup, **{**SMALL[setup], "young_modulus": 2e7, **more})


def start(scripts, folder, request):
    """YADE over the request, in a folder."""
    folder.mkdir(exist_ok=True)
    write_table(folder / "one.table", [request])
    environment = {**clean_environment(600, 600), "YADE_BATCH": "one.table:2"}
    command = ["yade", "-n", "-x", str(scripts / f"{request.setup}.py")]
    return subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )


def finish(scripts, folder, request):
    """Output, record and curves of a run that is left alone."""
    output = start(scripts, folder, request).communicate()[0].decode()
    record = read_record(folder / "records" / f"{request.run_id}.json", request)
    with np.load(folder / "records" / f"{request.run_id}.npz") as curves:
        return output, record, dict(curves)


def kill_at(scripts, folder, request, count):
    """Kill a run once it has written so many checkpoints; the steps of the last one."""
    process, seen = start(scripts, folder, request), []
    state = folder / "checkpoints" / request.run_id / "state.json"
    before = json.loads(state.read_text())["scene"] if state.exists() else None
    while len(seen) < count:
        assert process.poll() is None, "ended before it could be killed"
        time.sleep(0.01)
        if state.exists():
            scene = json.loads(state.read_text())["scene"]
            if scene not in (before, *seen):
                seen.append(scene)
    process.send_signal(signal.SIGKILL)
    process.wait()
    return json.loads(state.read_text())["last"]


def assert_same(one, other):
    (_, record, curves), (_, record2, curves2) = one, other
    assert record.status == record2.status and record.responses == record2.responses
    assert curves.keys() == curves2.keys()
    for name, values in curves.items():
        np.testing.assert_array_equal(values, curves2[name])
    assert record.diagnostics["steps"] == record2.diagnostics["steps"]


@pytest.mark.parametrize(
    ("setup", "effects"),
    [
        ("hourglass", {"bed_viscosity": 0.01, "shaking": 0.2, "shaking_time": 0.2}),
        ("ledge", {"size_spread": 0.2}),
        ("conical_pile", {"clump_aspect": 1.4, "bond_number": 0.2}),
        ("rotating_drum", {"size_distribution": "0.9:0.5|1.1:0.5", "face_friction_ratio": 0.5}),
    ],
)
def test_a_run_that_was_killed_twice_is_the_undisturbed_one_bit_for_bit(
    scripts, tmp_path, setup, effects
):
    request = request_of(setup, **effects)
    undisturbed = finish(scripts, tmp_path / "undisturbed", request)
    steps = [kill_at(scripts, tmp_path / "killed", request, count) for count in (1, 2)]
    killed = finish(scripts, tmp_path / "killed", request)
    assert_same(undisturbed, killed)
    assert killed[1].provenance["resumed"] == "from step {}, {}".format(*steps)
    assert "resumed" not in undisturbed[1].provenance
    for record in (undisturbed[1], killed[1]):
        cpu = record.diagnostics["filling_cpu"] + record.diagnostics["release_cpu"]
        assert 0 < cpu < record.provenance["wall_time"]
    for folder in ("undisturbed", "killed"):
        assert not list((tmp_path / folder / "checkpoints").iterdir())


def test_a_run_that_ends_early_is_that_of_scripts_without_checkpoints(scripts, tmp_path):
    request = request_of("hourglass")
    with_them = finish(SCRIPTS, tmp_path / "with", request)
    without = tmp_path / "without_scripts"
    shutil.copytree(scripts, without)
    module = without / "checkpoint.py"
    module.write_text(module.read_text().replace(f"EVERY = {EVERY}", "EVERY = float('inf')"))
    assert_same(with_them, finish(without, tmp_path / "without", request))
    own = finish(scripts, tmp_path / "own", request)[1]
    assert own.status == "ok" and own.responses != with_them[1].responses  # EVERY was small


@pytest.mark.parametrize("damage", ["another request", "three tries", "cut off", "no number"])
def test_a_checkpoint_that_does_not_serve_is_passed_over(scripts, tmp_path, damage):
    request = request_of("conical_pile")
    folder = tmp_path / "runs"
    kill_at(scripts, folder, request, 1)
    (scene,) = (folder / "checkpoints" / request.run_id).glob("step_*")
    state = scene.with_name("state.json")
    known = json.loads(state.read_text())
    if damage == "another request":
        known["about"]["parameters"]["seed"] = 4
    if damage == "three tries":
        known["tries"] = 3
    state.write_text(json.dumps(known) if damage != "no number" else '{"about": ')
    if damage == "cut off":
        scene.write_bytes(scene.read_bytes()[:-20])
    output, record, _ = finish(scripts, folder, request)
    assert record.status == "ok" and "resumed" not in record.provenance
    assert "goes on" not in output


def test_where_no_checkpoint_can_be_written_the_run_goes_on(scripts, tmp_path):
    request = request_of("conical_pile")
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "checkpoints").write_text("in the way")
    output, record, _ = finish(scripts, tmp_path / "runs", request)
    assert record.status == "ok" and "no checkpoint: " in output
