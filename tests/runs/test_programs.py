"""Another build of YADE than the one on the PATH makes single runs and batches alike."""

import os

import pytest

from calibrator.case.settings import Running
from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.runs import engine
from calibrator.runs.engines import ENGINES
from calibrator.runs.programs import chosen
from calibrator.runs.slurm import Slurm
from tests.conftest import programs
from tests.runs.toy_runs import folder_with, requests
from tests.slurm_cluster import NEEDS_SLURM, options_for


def own_build(folder, name="yade-trunk"):
    """A build of another name; each of its programs notes that it was called."""
    programs(folder, **{name: "run_line()", f"{name}-batch": "run_batch()"})
    for program in (name, f"{name}-batch"):
        text = (folder / program).read_text()
        note = f"open({str(folder / 'called')!r}, 'a').write({program!r} + '\\n')\n"
        (folder / program).write_text(
            text.replace("import fake_yade\n", f"import fake_yade\n{note}")
        )
    return folder / name


def called(program):
    return (program.parent / "called").read_text().split()


@pytest.fixture
def no_yade(tmp_path, monkeypatch):
    """A PATH whose yade and yade-batch must not be called."""
    folder = tmp_path / "usual"
    folder.mkdir()
    for name in ("yade", "yade-batch"):
        (folder / name).write_text("#!/bin/sh\nexit 1\n")
        (folder / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)


def engine_of(case):
    return ENGINES["local"](read_case(case))


@pytest.mark.parametrize(
    "way", ["case, path", "case, name", "environment", "environment, relative"]
)
def test_another_build_makes_single_runs_and_batches(
    tmp_path, no_yade, monkeypatch, write_case, way
):
    program = own_build(tmp_path / "own")
    change = ("jobs = 1", f'jobs = 1\nyade = "{program if "path" in way else program.name}"')
    if "name" in way:
        monkeypatch.setenv("PATH", str(program.parent), prepend=os.pathsep)
    if "environment" in way:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setenv("YADE", "own/yade-trunk" if "relative" in way else str(program))
        change = ("jobs = 1", 'jobs = 1\nyade = "yade-nowhere"')  # the environment goes before it
    folder = folder_with(tmp_path)
    records = engine.run(engine_of(write_case(change)), folder, requests())
    assert [r.status for r in records] == ["ok"] * 4
    assert sorted(called(program)) == ["yade-trunk"] * 4 + ["yade-trunk-batch"]


@pytest.mark.parametrize("gone", ["yade-trunk", "yade-trunk-batch"])
@pytest.mark.parametrize("way", ["case", "environment"])
def test_a_build_that_is_not_there_is_one_line_that_says_who_named_it(
    tmp_path, no_yade, monkeypatch, write_case, capsys, gone, way
):
    program = own_build(tmp_path / "own")
    (program.parent / gone).unlink()
    change = ("jobs = 1", "jobs = 1")
    if way == "case":
        change = ("jobs = 1", f'jobs = 1\nyade = "{program}"')
    else:
        monkeypatch.setenv("YADE", str(program))
    for verb in ("check", "run"):
        assert main([verb, str(write_case(change)), "--results", str(tmp_path / "results")]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and f"{program.parent / gone} is not installed" in error
        assert ("YADE=" if way == "environment" else "under [run]") in error


@pytest.mark.parametrize(
    "name", ["yadedaily", "yade-2025.2.0", "/opt/yade/bin/yade-trunk", "/usr/bin/yade", ""]
)
def test_a_case_may_name_a_yade(name):
    assert Running(yade=name).yade == name


@pytest.mark.parametrize(
    "name",
    [
        "rm",
        "/bin/sh",
        "yade; rm",
        "../yade",
        "bin/yade",
        "/opt/ya de/yade",
        "$(yade)",
        "yade\n",
        "/",
    ],
)
def test_a_case_may_name_no_other_program(name):
    with pytest.raises(CalibratorError, match="yadedaily"):
        Running(yade=name)


def test_whoever_sits_at_the_machine_has_the_last_word(monkeypatch):
    monkeypatch.delenv("YADE", raising=False)
    assert (chosen().yade, chosen("yadedaily").yade) == ("yade", "yadedaily")
    monkeypatch.setenv("YADE", "/my own/yade")
    assert chosen("yadedaily").batch == "/my own/yade-batch"


@pytest.mark.parametrize("cluster", [pytest.param("slurm", marks=NEEDS_SLURM)])
def test_a_cluster_takes_the_build_that_the_case_names(tmp_path, request, no_yade, cluster):
    request.getfixturevalue(cluster)
    program = own_build(tmp_path / "bin")
    folder = folder_with(tmp_path)
    records = engine.run(Slurm(options_for(tmp_path / "bin"), str(program)), folder, requests())
    assert [r.status for r in records] == ["ok"] * 4
    assert called(program).count("yade-trunk") == 4 and "yade-trunk-batch" in called(program)
