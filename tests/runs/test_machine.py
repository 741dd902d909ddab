"""`calibrator doctor` says what runs need and what is missing, and `check` asks it."""

import json
import os
import shutil

import jsonschema
import pytest

from calibrator.case.codec import build, plain, schema_of
from calibrator.cli import main
from calibrator.runs import machine
from calibrator.runs.machine import Machine, examine
from tests.conftest import programs


def only(tmp_path, monkeypatch, *names):
    """Let the PATH have these programs of the system's only, and those of tmp_path/bin."""
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in names:
        (tools / name).symlink_to(shutil.which(name))
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}{os.pathsep}{tools}")


AROUND = ("setpriv", "flock", "timeout", "true")


def test_a_machine_with_everything_is_good(tmp_path, fake_yade):
    found = examine(tmp_path / "not" / "there")
    assert found.good and found.yade.features == ("MADE_UP",) and found.yade.python == "3.11"
    assert found.yade.program == str(fake_yade / "yade")
    assert found.yade.batch == str(fake_yade / "yade-batch")
    assert found.cores >= 1 and found.free_space > 0
    assert "runs can be made here" in found.lines()[0]
    assert not (tmp_path / "not").exists()


def test_a_version_that_was_not_tried_is_said_to_be_new(tmp_path, fake_yade, monkeypatch):
    assert any("YADE fake is new here" in w for w in examine(tmp_path).warnings())
    monkeypatch.setattr(machine, "TRIED", ("fake",))
    assert not any("new here" in w for w in examine(tmp_path).warnings())


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("yade", "apt-get install --no-install-recommends yade"),
        ("yade-batch", "apt-get install --no-install-recommends yade"),
        ("setpriv", "apt-get install --no-install-recommends util-linux"),
        ("flock", "apt-get install --no-install-recommends util-linux"),
        ("timeout", "apt-get install --no-install-recommends coreutils"),
    ],
)
def test_what_is_missing_is_named_with_the_command_that_installs_it(
    tmp_path, fake_yade, monkeypatch, capsys, write_case, name, remedy
):
    only(tmp_path, monkeypatch, *(a for a in AROUND if a != name))
    if name.startswith("yade"):
        (fake_yade / name).unlink()
    assert main(["doctor", "--results", str(tmp_path)]) == 1
    (line,) = [s for s in capsys.readouterr().out.splitlines() if s.startswith("  missing: ")]
    assert f"{name} is not installed" in line and remedy in line
    assert main(["check", str(write_case()), "--results", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert f"{name} is not installed" in error and error.count("\n") == 1


def test_a_machine_without_a_network_namespace_is_warned_of(tmp_path, fake_yade, monkeypatch):
    only(tmp_path, monkeypatch, *AROUND)
    found = examine(tmp_path)
    assert found.good and not found.network_namespace
    assert any("no network namespace" in w and "util-linux" in w for w in found.warnings())


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("echo error while loading shared libraries: libx.so >&2; exit 127", "libx.so"),
        ("kill -11 $$", "does not start"),
        ('echo \'calibrator asks: ["1", "3", [], "ImportError: PartialSat"]\'', "PartialSat"),
        ("echo 'calibrator asks: 7'", "does not start"),
    ],
)
def test_a_yade_that_cannot_run_the_scripts_is_found_before_a_run(
    tmp_path, fake_yade, capsys, write_case, text, why
):
    (fake_yade / "yade").write_text(f"#!/bin/sh\n{text}\n")
    found = examine(tmp_path)
    assert not found.good and why in found.yade.trouble
    assert main(["check", str(write_case()), "--results", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert why in error and error.count("\n") == 1


def test_a_yade_that_hangs_is_not_waited_for(tmp_path, fake_yade, monkeypatch):
    monkeypatch.setattr(machine, "PATIENCE", 0.5)
    (fake_yade / "yade").write_text("#!/bin/sh\nexec sleep 60\n")
    assert "did not end within 0.5 s" in examine(tmp_path).yade.trouble


def test_a_disk_that_takes_no_links_is_found(tmp_path, fake_yade, monkeypatch):
    def refuse(*_, **__):
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr(machine.Path, "symlink_to", refuse)
    found = examine(tmp_path)
    (lack,) = [one for one in found.missing if one.essential]
    assert "symbolic links" in lack.why and "--results" in lack.remedy


def test_on_a_cluster_slurm_is_essential_and_yade_is_up_to_the_nodes(tmp_path, monkeypatch):
    only(tmp_path, monkeypatch)
    essential = [one.what for one in examine(tmp_path, "slurm").missing if one.essential]
    assert essential == ["sbatch is not installed", "squeue is not installed"]


def test_a_slurm_that_is_not_set_up_is_found(tmp_path, monkeypatch):
    only(tmp_path, monkeypatch)
    (tmp_path / "bin").mkdir()
    for name in ("sbatch", "squeue"):
        (tmp_path / "bin" / name).write_text("#!/bin/sh\necho no configuration >&2; exit 1\n")
        (tmp_path / "bin" / name).chmod(0o755)
    (lack,) = [one for one in examine(tmp_path, "slurm").missing if one.essential]
    assert "does not answer" in lack.what and "no configuration" in lack.why
    (tmp_path / "bin" / "sbatch").write_text("#!/bin/sh\necho slurm 22.05\n")
    assert examine(tmp_path, "slurm").good
    assert examine(tmp_path, "slurm").slurm == "slurm 22.05"


def test_the_option_json_prints_the_outcome(tmp_path, fake_yade, capsys):
    assert main(["doctor", "--json", "--results", str(tmp_path)]) == 0
    said = json.loads(capsys.readouterr().out)
    jsonschema.validate(said, schema_of(Machine))
    assert said["good"] is True and plain(build(Machine, said, "doctor")) == said


def test_a_case_says_which_yade_is_meant(tmp_path, monkeypatch, capsys, write_case):
    programs(tmp_path / "bin", **{"yade-own": "run_line()", "yade-own-batch": "run_batch()"})
    monkeypatch.setenv("PATH", str(tmp_path / "bin"), prepend=os.pathsep)
    case = write_case(("jobs = 1", 'jobs = 1\nyade = "yade-own"'))
    assert main(["doctor", str(case), "--json", "--results", str(tmp_path)]) == 0
    yade = json.loads(capsys.readouterr().out)["yade"]
    assert yade["program"].endswith("bin/yade-own") and yade["batch"].endswith("bin/yade-own-batch")


@pytest.mark.yade
def test_the_real_yade_answers_and_knows_all_that_the_scripts_take_of_it(tmp_path):
    found = examine(tmp_path)
    assert found.yade.trouble == "" and found.yade.version in machine.TRIED, found.lines()
    assert "OPENMP" in found.yade.features
