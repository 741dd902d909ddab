"""The wheel, installed outside the checkout: one package, with all that the demo needs inside."""

import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from calibrator.demo import FILES, lay_out
from calibrator.errors import CalibratorError
from tests.conftest import fake_programs

REPO = Path(__file__).resolve().parent.parent


def clean_environment(**more):
    """The environment of somebody who has no checkout."""
    kept = {n: v for n, v in os.environ.items() if not n.startswith(("PYTHON", "VIRTUAL_ENV"))}
    return {**kept, **more}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of this checkout."""
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=REPO, check=True, capture_output=True)
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """The programs of a new environment that has the wheel.

    Its dependencies are those that the tests run with: nothing is fetched.
    """
    place = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", place], check=True)
    python = place / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", python, "--disable-pip-version-check"]
    subprocess.run(
        [*pip, "install", "--quiet", "--no-deps", "--no-index", wheel],
        check=True,
        env=clean_environment(),
    )
    (own,) = place.glob("lib/python*/site-packages")
    (own / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return place / "bin"


def call(program, *arguments, cwd, **environment):
    return subprocess.run(
        [program, *arguments],
        cwd=cwd,
        env=clean_environment(**environment),
        capture_output=True,
        text=True,
    )


def test_the_wheel_installs_one_package(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        mode = archive.getinfo("calibrator/yade_scripts/run_yade.sh").external_attr >> 16
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"calibrator"}
    assert mode & 0o111 == 0o111, "yade-batch could not call its wrapper"


def test_the_wheel_has_scripts_cases_and_shipped_runs(wheel):
    folders = {"yade_scripts": ("*.py", "*.json", "*.sh"), "grid": ("*",), "cases": ("*.[tc]*",)}
    wanted = {
        f"calibrator/{path.relative_to(REPO)}"
        for folder, patterns in folders.items()
        for pattern in patterns
        for path in (REPO / folder).glob(pattern)
    }
    with zipfile.ZipFile(wheel) as archive:
        assert wanted <= set(archive.namelist())


def test_an_installed_calibrator_uses_nothing_of_the_checkout(installed, tmp_path):
    ask = "import calibrator.case.vocabulary as v; print(v.__file__, v.SCRIPTS)"
    answer = call(installed / "python", "-c", ask, cwd=tmp_path)
    assert answer.returncode == 0, answer.stderr
    assert all(path.startswith(str(installed.parent)) for path in answer.stdout.split())


@pytest.mark.slow
def test_the_demo_of_an_installed_calibrator_goes_its_whole_way(installed, tmp_path):
    """The fake YADE is no sand: the verification misses, with status 1, and the page is there."""
    fake = fake_programs(tmp_path / "bin")
    place = tmp_path / "sand box"
    place.mkdir()
    path = f"{fake}{os.pathsep}{os.environ['PATH']}"
    answer = call(installed / "calibrator", "demo", cwd=place, PATH=path)
    assert answer.returncode in (0, 1), answer.stderr
    assert "wrote cases/coarse_sand.toml" in answer.stdout
    assert (place / "results/coarse_sand/report.html").exists()
    link = (place / "results/coarse_sand/scripts").resolve()
    assert link.is_relative_to(installed.parent)


def test_the_demo_is_laid_out_once_and_leaves_what_is_the_same(tmp_path):
    case, written = lay_out(tmp_path)
    assert written == list(FILES) and case == tmp_path / "cases/coarse_sand.toml"
    assert lay_out(tmp_path) == (case, [])
    assert all((tmp_path / name).read_bytes() == (REPO / name).read_bytes() for name in FILES)
    assert lay_out(REPO)[1] == []


@pytest.mark.parametrize("name", FILES)
def test_the_demo_overwrites_nothing_that_is_not_its_own(tmp_path, name):
    (tmp_path / name).parent.mkdir()
    (tmp_path / name).write_text("mine")
    with pytest.raises(CalibratorError, match="not overwritten"):
        lay_out(tmp_path)
    assert [p for p in tmp_path.rglob("*") if p.is_file()] == [tmp_path / name]
    assert (tmp_path / name).read_text() == "mine"
