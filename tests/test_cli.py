"""The command line: a mistake of the user is one line on stderr and a status that is not 0."""

import ast
import errno
import io
import json
import os
import re
import shlex
from pathlib import Path

import pytest

from calibrator.cli import main
from calibrator.runs.batch import Progress
from calibrator.terminal import ProgressBar
from calibrator.verbs import DIAGNOSIS, HANDED_ON, LOOKED_AT, VERBS
from tests.conftest import LAB


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["chek", "a.toml"],
        ["plan"],
        ["plan", ""],
        ["plan", "a.toml", "--results", ""],
        ["plan", "a\nb", "-x\ny"],
    ],
)
def test_a_mistake_on_the_command_line_is_one_line(capsys, arguments):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    error = capsys.readouterr().err
    assert caught.value.code == 2 and error.count("\n") == 1 and error.endswith("--help\n")


@pytest.mark.parametrize("name", ["no\nsuch\rfile", "caf\udce9.toml", "x" * 300, "a" * 5000])
def test_a_case_path_of_any_name_is_shown_on_one_line(capsys, name):
    assert main(["plan", name]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_name_that_is_no_text_is_printed_all_the_same(write_case, tmp_path, capsys):
    path = write_case(("sets = 14", "sets = 2")).rename(tmp_path / "caf\udce9.toml")
    assert main(["plan", str(path), "--results", str(tmp_path / "out")]) == 0
    assert "caf\\udce9.toml" in capsys.readouterr().out


def test_a_verb_out_of_order_names_the_one_to_run_first(write_case, tmp_path, fake_yade, capsys):
    path = write_case()
    assert main(["verify", str(path), "--results", str(tmp_path)]) == 2
    assert "calibrator calibrate" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (("population", "popolation"), "did you mean population"),
        (("low = 0.2", "low = 0.9"), "is not below high"),
        (("[parameters.sliding_friction]", "[parameters.sliding]"), "unknown parameter"),
    ],
)
def test_bad_input_is_one_line_on_stderr_and_a_non_zero_exit(
    write_case, tmp_path, capsys, change, why
):
    assert main(["check", str(write_case(change)), "--results", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert why in error and error.count("\n") == 1


def test_a_nan_target_is_one_line_on_stderr_and_a_non_zero_exit(write_case, tmp_path, capsys):
    assert (
        main(
            ["check", str(write_case(lab=LAB.replace("1605.6", "nan"))), "--results", str(tmp_path)]
        )
        == 2
    )
    assert "give a finite value" in capsys.readouterr().err


def test_a_missing_yade_is_one_line_on_stderr_and_a_non_zero_exit(
    write_case, tmp_path, capsys, monkeypatch
):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["run", str(write_case()), "--results", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "is not installed" in error and error.count("\n") == 1


def misbehaving(tmp_path, **how):
    """The options of a results folder in which the fake YADE misbehaves."""
    (tmp_path / "results" / "toy").mkdir(parents=True)
    (tmp_path / "results" / "toy" / "misbehave.json").write_text(json.dumps(how))
    return ["--results", str(tmp_path / "results")]


def test_a_plan_of_which_every_run_failed_is_no_success(write_case, tmp_path, fake_yade, capsys):
    few, results = ("sets = 14", "sets = 3"), misbehaving(tmp_path, all="unstable")
    assert main(["run", str(write_case(few)), *results]) == 1
    said = capsys.readouterr()
    assert "6 unstable" in said.out and "database: [" in said.err


def test_a_plan_whose_first_runs_fail_alike_is_given_up_and_made_only_where_that_is_asked_for(
    write_case, tmp_path, fake_yade, capsys
):
    path, results = str(write_case()), misbehaving(tmp_path, all="unstable", duration=0.2)
    for _ in range(2):
        assert main(["run", path, *results]) == 2
        error = capsys.readouterr().err
        assert "all failed alike, unstable" in error and "lower rayleigh_fraction" in error
    made = (tmp_path / "results" / "toy" / "calls.txt").read_text().split()
    assert 8 <= len(made) < 28
    assert main(["run", path, "--go-on", *results]) == 1
    made = (tmp_path / "results" / "toy" / "calls.txt").read_text().split()
    assert len(set(made)) >= 28 and len(made) <= 29  # the one in flight was ended, and made again


def test_the_progress_names_its_stage_and_what_is_tried_again():
    stream = io.StringIO()
    ProgressBar(stream, "validation")(Progress(12, 1, 56, 65.0, 240.0, 2))
    assert stream.getvalue().startswith("validation: [")
    assert "12 of 56 runs, 1 failed, 2 tried again, 1:05 gone, 4:00 left" in stream.getvalue()


def test_messages_name_commands_through_the_workspace_alone():
    """Only it knows the options that a command needs, and quotes for the shell."""
    verbs = [*VERBS, *DIAGNOSIS, *LOOKED_AT, *HANDED_ON, "all"]
    command = re.compile(rf"\bcalibrator ({'|'.join(verbs)})\b")
    for path in sorted((Path(__file__).parents[1] / "calibrator").rglob("*.py")):
        tree = ast.parse(path.read_text())
        documented = (ast.Module, ast.FunctionDef, ast.ClassDef)
        notes = {ast.get_docstring(n, False) for n in ast.walk(tree) if isinstance(n, documented)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found = node.value not in notes and command.search(node.value)
                assert not found, f"{path}:{node.lineno}: use Workspace.command"


def test_after_another_lab_file_the_next_command_reads_it_too(
    write_case, tmp_path, capsys, fake_yade
):
    other, results = tmp_path / "other lab.csv", tmp_path / "my results"
    other.write_text(LAB)
    path = str(write_case())
    assert main(["check", path, "--lab", str(other), "--results", str(results)]) == 0
    following = capsys.readouterr().out.splitlines()[-1].removeprefix("next: ")
    assert shlex.split(following) == [
        "calibrator", "preflight", path, "--results", str(results), "--lab", str(other),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("number", "remedy"),
    [
        (errno.ENOSPC, "free space"),
        (errno.EROFS, "the drive is read-only"),
        (errno.EACCES, "mend the permissions"),
        (errno.EIO, "give another with --results"),
    ],
)
def test_an_error_of_the_system_is_one_line_with_its_own_remedy(
    write_case, tmp_path, capsys, monkeypatch, number, remedy
):
    def fails(*_):
        raise OSError(number, os.strerror(number), "somewhere")

    monkeypatch.setattr("calibrator.cli._do", fails)
    assert main(["check", str(write_case()), "--results", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert remedy in error and error.count("\n") == 1
