"""On the real YADE: a run that is watched is the run that nobody watched, bit for bit."""

import json
import shutil
import signal
import subprocess
import time
from types import SimpleNamespace

import numpy as np
import pytest

from calibrator.case.settings import Running
from calibrator.case.vocabulary import SCRIPTS
from calibrator.files import read_arrays
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import clean_environment, run
from calibrator.runs.record import read_record
from calibrator.runs.request import Request, write_table
from calibrator.runs.workspace import silent
from calibrator.view.snapshots import Film, read_snapshot
from calibrator.view.watched import SNAPSHOTS, WATCHED, differences, watch
from tests.test_real_yade import SMALL

pytestmark = pytest.mark.yade
SPACE = SimpleNamespace(case=SimpleNamespace(run=Running(attempts=1)))
EVERY = 3e5  # particle-steps between checkpoints: a second of these runs
BY_THE_CLOCK = ("filling_cpu", "release_cpu", "settling_cpu")


def without_clock(record):
    return {n: v for n, v in record.diagnostics.items() if n not in BY_THE_CLOCK}


def assert_same(record, curves, watched, watched_curves):
    """All that a record and its arrays say, apart from when and how fast it was made."""
    assert differences(record, watched) == []
    assert (record.run_id, record.status, record.error) == (
        watched.run_id, watched.status, watched.error,
    )  # fmt: skip
    assert record.responses == watched.responses
    assert without_clock(record) == without_clock(watched)
    for name in ("yade", "scripts", "host"):
        assert record.provenance[name] == watched.provenance[name]
    arrays, others = read_arrays(curves), read_arrays(watched_curves)
    assert arrays.keys() == others.keys()
    for name, values in arrays.items():
        np.testing.assert_array_equal(values, others[name])


@pytest.mark.parametrize(
    ("setup", "effects"),
    [
        ("hourglass", {"shaking": 0.2, "shaking_time": 0.1}),
        ("ledge", {"size_spread": 0.2, "tilt_deg": 3.0}),
        ("conical_pile", {"clump_aspect": 1.4}),
    ],
)
def test_a_run_that_is_watched_is_the_one_that_nobody_watched(tmp_path, setup, effects):
    request = Request.of(setup, **SMALL[setup], **effects)
    plain, folder = RunFolder(tmp_path / "plain"), RunFolder(tmp_path / "watched")
    (record,) = run(plain, [request], jobs=1)
    watched = watch(SPACE, request, folder.path, silent)
    assert record.status == "ok"
    curves = (plain.curves(request.run_id), folder.curves(request.run_id))
    assert_same(record, curves[0], watched, curves[1])
    film = Film.read(folder.path / SNAPSHOTS)
    assert np.all(np.diff(film.times) > 0) and max(np.bincount(film.stages)) <= 129
    step = record.diagnostics["time_step"]  # YADE counts it once its engines are through
    assert film.released == pytest.approx(record.diagnostics["filling_time"], abs=1.5 * step)
    filled, last = (read_snapshot(film.paths[i]) for i in (film.filled, -1))
    shift, arrays = np.zeros(3), read_arrays(curves[0])
    if setup == "ledge":  # its record has the axes of the ledge, its scene those of YADE's cell
        shift = arrays["filled"].min(axis=0) - filled.centres.min(axis=0)
    for shot, name in ((filled, "filled"), (last, "final")):
        centres = shot.centres[last_inside(shot, setup)] + shift
        np.testing.assert_allclose(sorted(centres[:, 2]), sorted(arrays[name][:, 2]), atol=1e-8)
    assert (len(set(filled.clumps)) < len(filled.ids)) == (setup == "conical_pile")
    assert (len(set(filled.radii)) > 1) == (setup == "ledge")
    assert len(filled.facets) and (len(filled.planes) == 1) == (setup == "conical_pile")


def last_inside(shot, setup):
    """The spheres that the record counts: those in the neck of an hourglass are on their way."""
    return shot.centres[:, 2] >= (0 if setup == "hourglass" else -1)


def by_hand(folder, request, script):
    """YADE over a request, with a script of a folder of runs."""
    write_table(folder / "one.table", [request])
    environment = {**clean_environment(600, 600), "YADE_BATCH": "one.table:2"}
    command = ["yade", "-n", "-x", f"{script}/{request.setup}.py"]
    return subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )


def scripts_with_checkpoints(folder, setup):
    """A folder of runs whose scripts keep checkpoints after a second, watched or not."""
    shutil.copytree(SCRIPTS, folder / "scripts", ignore=shutil.ignore_patterns("__pycache__"))
    module = folder / "scripts" / "checkpoint.py"
    assert "EVERY = 1e8" in module.read_text()
    module.write_text(module.read_text().replace("EVERY = 1e8", f"EVERY = {EVERY}"))
    (folder / WATCHED).mkdir()
    shutil.copy(SCRIPTS / "watch" / "watch.py", folder / WATCHED / f"{setup}.py")


def record_of(folder, request):
    return read_record(folder / "records" / f"{request.run_id}.json", request)


def test_one_that_is_killed_goes_on_and_has_all_snapshots(tmp_path):
    request = Request.of("conical_pile", **{**SMALL["conical_pile"], "young_modulus": 5e6})
    folders = [tmp_path / "plain", tmp_path / "killed"]
    for folder in folders:
        scripts_with_checkpoints(folder, "conical_pile")
    assert by_hand(folders[0], request, "scripts").wait() == 0
    process = by_hand(folders[1], request, WATCHED)
    state = folders[1] / "checkpoints" / request.run_id / "state.json"
    while not (state.exists() and json.loads(state.read_text())["wait"] > 0):
        assert process.poll() is None, "ended before it could be killed"
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert by_hand(folders[1], request, WATCHED).wait() == 0
    records = [record_of(folder, request) for folder in folders]
    assert "resumed" in records[1].provenance
    curves = [folder / "records" / f"{request.run_id}.npz" for folder in folders]
    assert_same(records[0], curves[0], records[1], curves[1])
    film = Film.read(folders[1] / SNAPSHOTS)
    assert set(film.stages) == {0, 1, 2} and not list((folders[1] / SNAPSHOTS).glob("*.tmp"))
    for stage in (1, 2):
        times = film.times[film.stages == stage]
        assert len(times) > 20 and np.diff(times).max() < 0.2 * np.ptp(times)
