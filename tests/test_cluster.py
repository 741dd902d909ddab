"""--engine slurm on a real SLURM of two nodes on loopback, with the fake YADE."""

import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from calibrator import cluster, runner
from calibrator.case import Cluster
from calibrator.database import Database
from calibrator.errors import CalibratorError
from calibrator.runner import RunFolder
from calibrator.table import Request

REPO = Path(__file__).resolve().parent.parent
SCRIPT = Path(__file__).with_name("slurm_local.sh")
MISSING = [p for p in ("slurmctld", "slurmd", "munged", "sbatch", "squeue") if shutil.which(p) is None]
pytestmark = [
    pytest.mark.cluster,
    pytest.mark.skipif(bool(MISSING), reason=f"{', '.join(MISSING)} not installed: run `make test-cluster`"),
]


@pytest.fixture(scope="module")
def slurm():
    folder = tempfile.mkdtemp(prefix="slurm-")
    os.environ["SLURM_CONF"] = f"{folder}/slurm.conf"
    try:
        subprocess.run(["bash", SCRIPT, "start", folder], check=True)
        yield folder
    finally:
        subprocess.run(["bash", SCRIPT, "stop", folder])
        del os.environ["SLURM_CONF"]


@pytest.fixture
def options(slurm, fake_yade, monkeypatch):
    monkeypatch.setattr(cluster, "POLL", 0.5)
    return Cluster(partition="main", time="5", slice_minutes=0.2, grace=3, modules=(f'export PATH="{fake_yade}:$PATH"',))


def requests(count):
    return [Request.of("hourglass", seed=s) for s in range(count)]


def folder_in(path, **misbehave):
    path.mkdir()
    (path / "misbehave.json").write_text(json.dumps(misbehave))
    return RunFolder(path)


def calls(folder):
    return (folder.path / "calls.txt").read_text().split()


def test_a_plan_done_through_slurm_gives_the_local_database(tmp_path, options):
    there, here = (folder_in(tmp_path / n, **{"1": "crash", "2": "segfault", "3": "clog"}) for n in ("there", "here"))
    Database(cluster.run(there, requests(6), options)).write(tmp_path / "there.csv", "test")
    Database(runner.run(here, requests(6), jobs=1)).write(tmp_path / "here.csv", "test")
    assert (tmp_path / "there.csv").read_bytes() == (tmp_path / "here.csv").read_bytes()
    assert sorted(calls(there)) == sorted(calls(here))
    assert there.failures() == here.failures()


def test_a_driver_killed_and_called_again_runs_nothing_twice(tmp_path, options):
    folder = folder_in(tmp_path / "runs", duration=1)
    code = (
        "from calibrator import cluster; from calibrator.case import Cluster; from calibrator.runner import RunFolder;"
        "from calibrator.table import Request; from pathlib import Path;"
        f"cluster.run(RunFolder(Path({str(folder.path)!r})), [Request.of('hourglass', seed=s) for s in range(6)], {options!r})"
    )
    driver = subprocess.Popen([sys.executable, "-c", code], cwd=REPO)
    end = time.monotonic() + 30
    while not (folder.path / "calls.txt").exists():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    records = cluster.run(folder, requests(6), options)
    assert [r.status for r in records] == ["ok"] * 6
    assert len(calls(folder)) == 6


def test_a_refused_submission_costs_no_attempt(tmp_path, options):
    folder = folder_in(tmp_path / "runs")
    with pytest.raises(CalibratorError, match="SLURM refused.*correct"):
        cluster.run(folder, requests(2), Cluster(partition="nowhere"))
    assert folder.failures() == {}
    assert [r.status for r in cluster.run(folder, requests(2), options)] == ["ok", "ok"]


def test_a_hang_past_its_limit_is_a_timeout(tmp_path, options, monkeypatch):
    monkeypatch.setattr(cluster, "time_limit", lambda cost, patience: 2 * patience)
    folder = folder_in(tmp_path / "runs", **{"1": "hang"})
    assert [r.status for r in cluster.run(folder, requests(2), options)] == ["ok", "timeout"]
    assert len(calls(folder)) == 3


def test_a_run_killed_for_its_memory_is_lost_and_tried_once_more(tmp_path, options):
    folder = folder_in(tmp_path / "runs", **{"1": "memory"})
    records = cluster.run(folder, requests(2), dataclasses.replace(options, memory="200M"))
    assert [r.status for r in records] == ["ok", "lost"]
    assert calls(folder).count(requests(2)[0].run_id) == 1
    assert calls(folder).count(requests(2)[1].run_id) == 2


@pytest.mark.yade
def test_the_real_yade_runs_in_an_array_task(tmp_path, slurm):
    assert shutil.which("yade"), "yade is not on the PATH: run `make yade`"
    small = dict(fill_mass=2e-3, cylinder_diameter=16e-3, neck_diameter=10e-3, young_modulus=1e6, seed=3)
    folder = folder_in(tmp_path / "runs")
    records = cluster.run(folder, [Request.of("hourglass", **small)], Cluster(memory="1G", time="5"))
    assert [r.status for r in records] == ["ok"]
