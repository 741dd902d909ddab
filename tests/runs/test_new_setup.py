"""A set-up of one's own: its script, its words in the contract, its entry, and nothing else."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import CASE, programs

REPO = Path(__file__).resolve().parents[2]
VERBS = ("check", "plan", "run", "collect", "calibrate", "verify", "report")
NAME, OWN = "funnel", "funnel_opening"
ENTRY = f"""
SETUP_ENTRIES["{NAME}"] = Setup(
    name="{NAME}",
    base=_disc,
    particles=_filling(_disc),
    release=lambda p: 0.5,
    outline=lambda p, top: ((), ()),
    profile=surface("profile_radius", "distance from the axis"),
    mirrored=True,
    doubts=lambda p: [Doubt("funnel", 1, "the funnel is narrow: widen it")] * (p["{OWN}"] < 0.01),
)
"""
LAB = f"""# made by hand: the fake YADE's formula at mu_r 0.25, mu_s 0.5, E 3 MPa
setup,response,value,scatter,replicates,unit,role
{NAME},bulk_density,1605.6,5,8,kg/m3,calibrate
{NAME},pile_equivalent_angle_deg,23.4,0.2,8,deg,calibrate
{NAME},pile_apex_rounding,1.5e-3,1e-5,8,m,calibrate
"""


@pytest.fixture
def project(tmp_path):
    """A copy of the calibrator and of its scripts, with the set-up added; the fake YADE beside."""
    unneeded = shutil.ignore_patterns("__pycache__")
    for folder in ("calibrator", "yade_scripts"):
        shutil.copytree(REPO / folder, tmp_path / folder, ignore=unneeded)
    scripts = tmp_path / "yade_scripts"
    script = (scripts / "conical_pile.py").read_text()
    (scripts / f"{NAME}.py").write_text(script.replace('"conical_pile"', f'"{NAME}"'))
    contract = json.loads((scripts / "contract.json").read_text())
    contract["setups"].append(NAME)
    for quantity in [*contract["parameters"].values(), *contract["responses"].values()]:
        if "conical_pile" in quantity.get("setups", ()):
            quantity["setups"].append(NAME)
    opening = {"symbol": "D_f", "unit": "m", "default": 5e-3, "low": 1e-5, "high": 1.0}
    opening |= {"setups": [NAME], "about": "diameter of the funnel's opening"}
    contract["parameters"][OWN] = opening
    (scripts / "contract.json").write_text(json.dumps(contract))
    with open(tmp_path / "calibrator" / "runs" / "setups.py", "a") as stream:
        stream.write(ENTRY)
    return tmp_path


def test_a_set_up_of_ones_own_is_calibrated_from_the_command_line(project):
    (project / "tests").mkdir()
    fake = shutil.copy(REPO / "tests" / "fake_yade.py", project / "tests")
    calls = {"yade": "run_line()", "yade-batch": "run_batch()"}
    path = f"{programs(project / 'bin', Path(fake), **calls)}:{os.environ['PATH']}"
    (project / "toy.toml").write_text(CASE)
    (project / "lab.csv").write_text(LAB)
    said = ""
    for verb in VERBS:
        ended = subprocess.run(
            [sys.executable, "-m", "calibrator.cli", verb, "toy.toml", "--results", "results"],
            cwd=project,
            env={**os.environ, "PATH": path, "PYTHONPATH": str(project)},
            capture_output=True,
            text=True,
        )
        assert ended.returncode == 0, ended.stdout + ended.stderr
        said += ended.stdout
    assert f"warning: {NAME}: the funnel is narrow: widen it" in said
    assert "28 runs" in said
    database = (project / "results" / "toy" / "database.csv").read_text()
    assert database.count(f",{NAME},ok,") == 28 and OWN in database


def test_every_set_up_of_the_vocabulary_has_an_entry():
    from calibrator.case.vocabulary import SETUPS
    from calibrator.runs.setups import SETUP_ENTRIES

    assert {name: entry.name for name, entry in SETUP_ENTRIES.items()} == {n: n for n in SETUPS}
