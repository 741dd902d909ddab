"""The example of docs/effects.md, carried out as a reader would.

It is an entry in the contract and a function in effects.py.
"""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parent.parent
pytestmark = pytest.mark.yade


def blocks():
    """The fenced blocks of the page: an entry of the contract, and a function."""
    text = (REPO / "docs" / "effects.md").read_text()
    return re.findall(r"^```(?:json|python)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def scripts(tmp_path_factory):
    """A copy of the scripts with the example's effect."""
    folder = tmp_path_factory.mktemp("own_effect") / "yade_scripts"
    shutil.copytree(REPO / "yade_scripts", folder)
    entry, function = blocks()
    contract = json.loads((folder / "contract.json").read_text())
    contract["parameters"] |= json.loads("{" + entry + "}")
    (folder / "contract.json").write_text(json.dumps(contract))
    with open(folder / "effects.py", "a") as stream:
        stream.write("\n\n" + function)
    return folder


def run_by_hand(scripts, folder, **columns):
    """Record of a small ledge with these columns."""
    folder.mkdir()
    given = dict(
        description="run",
        box_length=12e-3,
        box_width=6e-3,
        fill_height=6e-3,
        young_modulus=1e6,
        **columns,
    )
    (folder / "t.table").write_text(
        " ".join(given) + "\n" + " ".join(map(str, given.values())) + "\n"
    )
    environment = {"PATH": "/usr/bin:/bin", "YADE_BATCH": "t.table:2", "HOME": str(folder)}
    subprocess.run(
        ["yade", "-n", "-x", str(scripts / "ledge.py")],
        cwd=folder,
        env=environment,
        capture_output=True,
        timeout=120,
    )
    return json.loads((folder / "records" / "run.json").read_text())


def test_the_example_of_an_own_effect_acts_as_it_says(scripts, tmp_path):
    """Gravity four times as strong: the same grains fall in half the time, then settle.

    When so few of them come to rest is chance, so that single seeds say little.
    """
    filling = {0.0: 0.0, 3.0: 0.0}
    for seed in range(1, 5):
        for pull in filling:
            folder = tmp_path / f"{pull}_{seed}"
            record = run_by_hand(scripts, folder, base_attraction=pull, seed=seed)
            assert record["status"] == "ok"
            assert record["parameters"].get("base_attraction", 0.0) == pull
            assert ("base_attraction" in record["parameters"]) is (pull > 0)
            filling[pull] += record["diagnostics"]["filling_time"]
    assert filling[3.0] < 0.75 * filling[0.0]
