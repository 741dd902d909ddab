"""docs/own_setup.md, followed step by step."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from tests.docs.blocks import REPO, blocks_of

SCRIPT, ENTRY = [b.text for b in blocks_of(REPO / "docs" / "own_setup.md") if b.kind == "python"]
(WORDS,) = [
    json.loads(b.text) for b in blocks_of(REPO / "docs" / "own_setup.md") if b.kind == "json"
]
CASE = """
name = "cup"
measured = "lab.csv"
[parameters.rolling_friction]
low = 0.05
high = 0.4
[fixed]
young_modulus = 1e6
[setups.cup]
cylinder_diameter = 16e-3
fill_height = 10e-3
[plan]
sets = 4
replicates = 1
"""
LAB = """setup,response,value,scatter,replicates,unit,role
cup,bulk_density,1550,5,5,kg/m3,calibrate
"""


def test_the_script_has_40_lines_at_most():
    assert len(SCRIPT.splitlines()) <= 40


@pytest.fixture
def project(tmp_path):
    """A copy of calibrator and scripts with what the page adds, and a case that uses it."""
    for folder in ("calibrator", "yade_scripts"):
        shutil.copytree(
            REPO / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__")
        )
    scripts = tmp_path / "yade_scripts"
    (scripts / "cup.py").write_text(SCRIPT)
    contract = json.loads((scripts / "contract.json").read_text())
    contract["setups"].append("cup")
    for section, names in WORDS.items():
        for name in names:
            contract[section][name]["setups"].append("cup")
    (scripts / "contract.json").write_text(json.dumps(contract))
    with open(tmp_path / "calibrator" / "runs" / "setups.py", "a") as stream:
        stream.write(ENTRY)
    (tmp_path / "case.toml").write_text(CASE)
    (tmp_path / "lab.csv").write_text(LAB)
    return tmp_path


@pytest.mark.yade
def test_the_set_up_of_the_page_is_run_by_the_real_yade(project):
    for verb in ("check", "run", "collect"):
        ended = subprocess.run(
            [sys.executable, "-m", "calibrator.cli", verb, "case.toml", "--results", "results"],
            cwd=project,
            env={**os.environ, "PYTHONPATH": str(project)},
            capture_output=True,
            text=True,
        )
        assert ended.returncode == 0, ended.stdout + ended.stderr
    head, *rows = [
        line.split(",")
        for line in (project / "results" / "cup" / "database.csv").read_text().splitlines()
        if not line.startswith("#")
    ]
    densities = [float(row[head.index("bulk_density")]) for row in rows if row[2] == "ok"]
    assert len(densities) == 4 and all(1400 < d < 1700 for d in densities)
