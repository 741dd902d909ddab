"""Fixtures: a fake YADE on the PATH, and small cases."""

import os
import shutil
import sys
from pathlib import Path

import pytest

from calibrator.case.toml import read_case
from calibrator.runs import workspace
from tests.slurm_cluster import slurm  # noqa: F401 - a fixture for all tests

FAKE = Path(__file__).with_name("fake_yade.py")

CASE = """
name = "toy"
measured = "lab.csv"
[parameters.rolling_friction]
low = 0.05
high = 0.45
samples = 4
[parameters.sliding_friction]
low = 0.2
high = 0.7
samples = 4
[parameters.young_modulus]
low = 0.5e6
high = 4e6
samples = 2
[plan]
design = "sobol"
sets = 14
replicates = 2
[search]
population = 60
generations = 15
[verify]
replicates = 4
spread_replicates = 1
[run]
jobs = 1
"""

LAB = """# made by hand: the fake YADE's formula at mu_r 0.25, mu_s 0.5, E 3 MPa
setup,response,value,scatter,replicates,unit,role
hourglass,bulk_density,1605.6,5,8,kg/m3,calibrate
hourglass,drained_equivalent_angle_deg,46.8,0.2,8,deg,calibrate
hourglass,mass_flow_rate,0.026,0.0001,8,kg/s,calibrate
ledge,ledge_equivalent_angle_deg,37.44,0.2,8,deg,held_out
conical_pile,pile_equivalent_angle_deg,23.4,0.2,8,deg,held_out
"""


# Made once and dear: with several workers, the tests that use one of them stay on one worker.
SHARED = ("measured", "whole", "named")


def pytest_collection_modifyitems(items):
    """A worker takes a file as a whole, as what its module's fixtures make would be made twice.

    There is one SLURM, which is started and stopped by who uses it first.
    """
    for item in items:
        shared = [name for name in SHARED if name in item.fixturenames]
        one = item.get_closest_marker("cluster") and "cluster"
        item.add_marker(pytest.mark.xdist_group(one or (shared or [str(item.path)])[0]))


def processes_in(folder):
    """Process ids whose working folder is this one: the driver's children."""
    found = []
    for link in Path("/proc").glob("[0-9]*/cwd"):
        try:
            if os.readlink(link) == str(folder):
                found.append(int(link.parent.name))
        except OSError:
            continue  # it ended meanwhile
    return found


def programs(folder, fake=FAKE, **calls):
    """Make programs that call a function of a fake YADE: {name: call}; returns their folder."""
    folder.mkdir()
    for name, call in calls.items():
        program = folder / name
        program.write_text(
            # absolute, as an environment may be on the PATH by a relative one
            f"#!{Path(sys.executable).absolute()}\nimport sys\n"
            f"sys.path.insert(0, {str(fake.parent)!r})\nimport fake_yade\nfake_yade.{call}\n"
        )
        program.chmod(0o755)
    return folder


def fake_programs(folder):
    """A fake yade and yade-batch."""
    return programs(folder, **{"yade": "run_line()", "yade-batch": "run_batch()"})


@pytest.fixture
def fake_yade(tmp_path, monkeypatch):
    """Put a fake yade and yade-batch first on the PATH."""
    folder = fake_programs(tmp_path / "bin")
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)
    return folder


@pytest.fixture
def troubled_yade(tmp_path, monkeypatch):
    """Put the real yade on the PATH, apart from the runs that misbehave.json names."""
    real = shutil.which("yade")
    assert real, "yade is not on the PATH: run `make yade`"
    folder = programs(tmp_path / "bin", yade=f"run_real_line({real!r})")
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)
    return folder


@pytest.fixture
def write_case(tmp_path):
    """Write the toy case with replacements [(old, new), ...] and return its path."""

    def write(*changes, lab=LAB):
        text = CASE
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "lab.csv").write_text(lab)
        path = tmp_path / "toy.toml"
        path.write_text(text)
        return path

    return write


def space_for(path, results, fresh=False):
    case = read_case(path)
    return workspace.Workspace(case, results / case.name, fresh)
