"""The container's recipe and `make test-debian13` take the same steps, and name what is there."""

import re
import subprocess
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parent.parent
SCRIPT = REPO / "delivery" / "debian.sh"
RECIPE = (REPO / "Containerfile").read_text()


def steps(text):
    """The steps of the script that a text calls, in order."""
    return re.findall(r"delivery/debian\.sh (\w+)", text)


def test_a_shell_can_read_the_script():
    subprocess.run(["sh", "-n", SCRIPT], check=True)


def test_a_container_and_the_test_take_the_same_steps():
    function = SCRIPT.read_text().split("container() {")[1].split("\n}")[0]
    assert steps(RECIPE) == steps(function) == ["system", "install"]
    assert RECIPE.rstrip().endswith('CMD ["calibrator", "demo"]')
    assert function.rstrip().endswith("calibrator demo")


def test_the_recipe_is_of_the_debian_that_is_tested():
    assert "FROM debian:13\n" in RECIPE
    assert "sh delivery/debian.sh root trixie" in (REPO / "Makefile").read_text()


@pytest.mark.parametrize("arguments", [[], ["unknown"]])
def test_the_script_does_nothing_unless_told_what(arguments):
    said = subprocess.run(["sh", SCRIPT, *arguments], capture_output=True, text=True)
    assert said.returncode == 2 and "debian.sh inside" in said.stderr and not said.stdout
