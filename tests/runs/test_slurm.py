"""--engine slurm on a real SLURM of two nodes on loopback, with the fake and the real YADE."""

import dataclasses
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.runs import cost, local
from calibrator.runs import slurm as engine
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.request import Request
from tests.conftest import fake_programs
from tests.slurm_cluster import NEEDS_SLURM, SCRIPT, options_for

REPO = Path(__file__).resolve().parents[2]
pytestmark = NEEDS_SLURM


@pytest.fixture
def options(slurm, tmp_path, monkeypatch):
    """Options for the programs that another fixture puts into tmp_path/bin."""
    monkeypatch.setattr(engine, "POLL", 0.5)
    return options_for(tmp_path / "bin")


@pytest.fixture(scope="module", autouse=True)
def walled(slurm, tmp_path_factory):
    """A driver whose tasks may take a minute: folder, requests and process.

    Begun before all tests, as SLURM knows no less.
    """
    path = tmp_path_factory.mktemp("walled")
    folder = folder_in(path / "runs", **{"1": "hang once", "2": "hang", "duration": 1})
    options = options_for(fake_programs(path / "bin"), partition="kept", time="1")
    driver = start_driver(folder, requests(3), two_runs_each(options, requests(3)), attempts=1)
    yield folder, requests(3), driver
    driver.kill()


def requests(count):
    return [Request.of("hourglass", seed=s) for s in range(count)]


def folder_in(path, **misbehave):
    path.mkdir()
    (path / "misbehave.json").write_text(json.dumps(misbehave))
    return RunFolder(path)


def calls(folder):
    """Run ids in the order in which they were started."""
    return [line.split()[0] for line in (folder.path / "calls.txt").read_text().splitlines()]


def wait_for(condition, seconds=120):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.1)


def bytes_of(records, path):
    Database(records).write(path)
    return path.read_bytes()


def test_a_plan_done_through_slurm_gives_the_local_database(tmp_path, options, fake_yade):
    there, here = (
        folder_in(tmp_path / n, **{"1": "crash", "2": "segfault", "3": "clog"})
        for n in ("there", "here")
    )
    through_slurm = engine.run(there, requests(6), options)
    assert [r.status for r in through_slurm] == ["ok", "crash", "crash", "clogged", "ok", "ok"]
    assert bytes_of(through_slurm, tmp_path / "a") == bytes_of(
        local.run(here, requests(6), jobs=1), tmp_path / "b"
    )
    assert sorted(calls(there)) == sorted(calls(here))
    assert there.failures() == here.failures()


def test_the_command_line_takes_a_case_to_slurm_with_the_settings_of_a_site(
    tmp_path, options, fake_yade, write_case
):
    case, site = write_case(("sets = 14", "sets = 2")), tmp_path / "site.toml"
    site.write_text(f"[cluster]\npartition = 'main'\ngrace = 5\nshell = ['{options.shell[0]}']\n")
    for name, more in (("slurm", ["--engine", "slurm", "--site", str(site)]), ("local", [])):
        for verb in ("run", "collect"):
            assert main([verb, str(case), "--results", str(tmp_path / name), *more]) == 0
    assert list((tmp_path / "slurm" / "toy").glob("batches/calibrator-*"))
    one, other = (
        (tmp_path / name / "toy" / "database.csv").read_bytes() for name in ("slurm", "local")
    )
    assert one == other


def test_more_slices_than_may_be_submitted_are_done_in_turns(tmp_path, options, fake_yade):
    folder = folder_in(tmp_path / "runs")
    few = dataclasses.replace(options, slice_minutes=0, most_tasks=2)
    assert [r.status for r in engine.run(folder, requests(5), few)] == ["ok"] * 5
    tables = [len(list(batch.glob("*.table"))) for batch in folder.path.glob("batches/*")]
    assert sorted(tables) == [1, 2, 2] and len(calls(folder)) == 5


def test_a_refused_submission_costs_no_attempt(tmp_path, options, fake_yade):
    folder = folder_in(tmp_path / "runs")
    with pytest.raises(CalibratorError, match=r"did not take the job.*correct"):
        engine.run(folder, requests(2), dataclasses.replace(options, partition="nowhere"))
    assert folder.failures() == {}
    assert [r.status for r in engine.run(folder, requests(2), options, attempts=1)] == ["ok", "ok"]


def test_a_run_that_is_cut_off_goes_on_in_the_next_task_while_it_gets_further(
    tmp_path, options, fake_yade
):
    folder = folder_in(tmp_path / "runs", **{"0": "walk", "1": "killed"})
    both = requests(2)
    own_task = dataclasses.replace(options, slice_minutes=0)  # each is the first of its task
    records = engine.run(folder, both, own_task, attempts=1)
    assert [r.status for r in records] == ["ok", "lost"]
    assert [calls(folder).count(r.run_id) for r in both] == [3, 1]
    assert list(folder.failures()) == [both[1].run_id]


def replace_sbatch(tmp_path, text):
    """An sbatch of another kind, ahead of the real one on the driver's PATH."""
    program = tmp_path / "bin" / "sbatch"
    program.write_text(
        f"#!/bin/bash\n{text}\necho 'Socket timed out on send/recv operation' >&2\nexit 1\n"
    )
    program.chmod(0o755)


def test_a_job_that_was_taken_although_sbatch_reports_an_error_is_not_submitted_again(
    tmp_path, options, fake_yade
):
    folder = folder_in(tmp_path / "runs", duration=1)
    replace_sbatch(tmp_path, f'{shutil.which("sbatch")} "$@"')
    assert [r.status for r in engine.run(folder, requests(2), options)] == ["ok", "ok"]
    assert len(calls(folder)) == 2 and len(list(folder.path.glob("batches/*"))) == 1


def test_a_job_that_comes_up_after_its_driver_has_given_it_up_does_nothing(
    tmp_path, options, fake_yade
):
    folder = folder_in(tmp_path / "runs")
    replace_sbatch(tmp_path, f'printf "%q " {shutil.which("sbatch")} "$@" > {tmp_path}/late.sh')
    with pytest.raises(CalibratorError, match="Socket timed out"):
        engine.run(folder, requests(2), options)
    subprocess.run(["bash", tmp_path / "late.sh"], check=True, capture_output=True)
    (batch,) = folder.path.glob("batches/*")
    wait_for(
        lambda: (batch / "0.out").exists() and "nothing to do" in (batch / "0.out").read_text()
    )
    assert not (folder.path / "calls.txt").exists()


def test_where_no_run_can_start_the_user_is_told_where_to_read_why(tmp_path, options, fake_yade):
    folder = folder_in(tmp_path / "runs")
    with pytest.raises(CalibratorError, match=r"still to be done: no run started.* read .*out"):
        engine.run(folder, requests(1), dataclasses.replace(options, shell=("exit 1",), grace=1))
    assert folder.failures() == {}


def two_runs_each(options, asked):
    """Slices of two of these runs, which are predicted to take equally long."""
    return dataclasses.replace(
        options, slice_minutes=2.01 * float(cost.core_seconds(asked)[0]) / 60
    )


def start_driver(folder, asked, options, patch="pass", **more):
    """A driver in a process of its own; `patch` is a statement that it begins with."""
    code = (
        "from calibrator.runs import slurm as engine; from calibrator.case.settings import Cluster;"
        "from calibrator.runs.folder import RunFolder;"
        "from calibrator.runs.request import Request; from pathlib import Path; engine.POLL = 0.5;"
        f"{patch};"
        f"engine.run(RunFolder(Path({str(folder.path)!r})), {asked!r}, {options!r}, **{more!r})"
    )
    return subprocess.Popen([sys.executable, "-c", code], cwd=REPO)


def held_by(folder, node, asked):
    """The run ids that a node has started, and that have no record."""
    if not (folder.path / "calls.txt").exists():
        return set()
    started = [line.split() for line in (folder.path / "calls.txt").read_text().splitlines()]
    known = {r.run_id for r in asked}
    return {
        i
        for i, on in started
        if on == node and i in known and not (folder.path / "records" / f"{i}.json").exists()
    }


@pytest.mark.yade
@pytest.mark.slow
def test_whatever_dies_every_run_gets_its_verdict_and_the_database_is_the_undisturbed_one(
    tmp_path, slurm, options, troubled_yade, monkeypatch
):
    """Real runs beside a crash, a segfault, a lack of memory and a hang.

    The driver is killed, then a node lost. Two runs to a task, and the last, the hang with its
    short limit, by itself.
    """
    box = dict(box_length=16e-3, box_width=8e-3, fill_height=10e-3, young_modulus=1e6)
    good = [Request.of("ledge", **box, seed=seed) for seed in range(1, 6)]
    crash, segfault, memory, hang = bad = [
        Request.of("ledge", **box, seed=seed) for seed in (11, 12, 13, 14)
    ]
    trouble = {"11": "crash", "12": "segfault", "13": "memory", "14": "hang", "duration": 1}
    limit = f"lambda cost, patience: (4 if {hang.run_id!r} in cost else 300) * patience"
    for module in (engine, local):
        monkeypatch.setattr(module, "time_limit", eval(limit))
    options = two_runs_each(dataclasses.replace(options, memory="500M"), good)
    folder = folder_in(tmp_path / "disturbed", **trouble)

    driver = start_driver(folder, [*good, *bad], options, patch=f"engine.time_limit = {limit}")
    wait_for(lambda: held_by(folder, "n2", good) or driver.poll() is not None)
    driver.kill()
    driver.wait()
    subprocess.run(["bash", SCRIPT, "kill-node", slurm, "n2"], check=True)
    held = held_by(folder, "n2", good)
    assert held, "the node held nothing when it was lost"
    verdicts = {r.run_id: (r.status, r.error) for r in engine.run(folder, [*good, *bad], options)}
    subprocess.run(["bash", SCRIPT, "start-node", slurm, "n2"], check=True)

    assert [verdicts[r.run_id] for r in good] == [("ok", "")] * len(good)
    assert {r.run_id: calls(folder).count(r.run_id) for r in good} == {
        r.run_id: 1 + (r.run_id in held) for r in good
    }
    assert [verdicts[r.run_id][0] for r in bad] == ["crash", "crash", "lost", "timeout"]
    assert verdicts[memory.run_id][1] == "its array task ran out of memory: raise cluster.memory"

    undisturbed = folder_in(tmp_path / "undisturbed", **trouble)
    # with a time limit of its own, and without the run that nothing on this machine would end
    local.run(undisturbed, [hang])
    local.run(undisturbed, [*good, crash, segfault])
    here, there = (gather(f, [*good, crash, segfault, hang]) for f in (undisturbed, folder))
    assert bytes_of(there, tmp_path / "there.csv") == bytes_of(here, tmp_path / "here.csv")


def test_the_end_of_the_wall_time_costs_an_attempt_only_where_a_run_had_all_of_it(walled):
    """Two runs to a task: one hangs, and one would have ended, had it had all the time."""
    folder, asked, driver = walled
    assert driver.wait(180) == 0
    records = gather(folder, asked)
    assert [r.status for r in records] == ["ok", "ok", "timeout"]
    assert records[2].error == "the wall time of its array task ended: raise cluster.time"
    assert [calls(folder).count(r.run_id) for r in asked] == [1, 2, 1]
