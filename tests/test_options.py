"""Dry runs, and completion in a shell."""

import json
import subprocess
import sys

import pytest

from calibrator.cli import main
from calibrator.options import MAKE_RUNS, parser


def test_a_dry_run_says_what_would_be_made_and_makes_nothing(
    write_case, tmp_path, fake_yade, capsys
):
    case, results = str(write_case()), tmp_path / "results"
    assert main(["run", case, "--results", str(results), "--dry-run"]) == 0
    assert "dry run: would make 28 runs on this machine, " in capsys.readouterr().out
    assert not list(results.rglob("*.npz")) and not list(results.rglob("*.table"))
    assert main(["run", case, "--results", str(results)]) == 0
    capsys.readouterr()
    assert main(["run", case, "--results", str(results), "--dry-run"]) == 0
    assert "would make" not in capsys.readouterr().out


def test_a_dry_run_of_the_whole_way_ends_at_the_first_runs_and_is_json_on_demand(
    write_case, tmp_path, fake_yade, capsys
):
    case, results = str(write_case()), str(tmp_path / "results")
    assert main(["all", case, "--results", results, "--dry-run", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["runs"] == 28 and said["engine"] == "local" and not said["refused"]


def test_a_dry_run_says_that_the_budget_would_refuse(write_case, tmp_path, fake_yade, capsys):
    case = str(write_case(("jobs = 1", "jobs = 1\nbudget_core_hours = 1e-6")))
    assert main(["run", case, "--results", str(tmp_path), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "it would be refused: " in said and "run.budget_core_hours = 1e-06" in said


def test_every_verb_that_makes_runs_can_be_rehearsed_and_no_other():
    (verbs,) = (a for a in parser()._actions if a.dest == "verb")
    assert {"run", "verify", "validate", "diagnose", "preflight", "all", "demo"} <= set(MAKE_RUNS)
    for name, own in verbs.choices.items():
        has = any("--dry-run" in a.option_strings for a in own._actions)
        assert has == (name in MAKE_RUNS), name


@pytest.mark.parametrize(
    ("typed", "completed"), [("ver", "verify"), ("doc", "doctor"), ("verify --dry", "--dry-run")]
)
def test_bash_completes_verbs_and_options(typed, completed):
    script = subprocess.run(
        [sys.executable, "-m", "calibrator.cli", "--print-completion", "bash"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    words = f"calibrator {typed}".split()
    ask = f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}"
    end = '_shtab_calibrator; echo "${COMPREPLY[@]}"'
    found = subprocess.run(
        ["bash", "-c", f"{script}\n{ask}; {end}"], capture_output=True, text=True, check=True
    )
    assert found.stdout.split() == [completed]
