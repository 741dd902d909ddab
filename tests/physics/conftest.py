"""The measurements of scenes.py, made inside YADE once for all tests."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

SCENES = Path(__file__).with_name("scenes.py")


@pytest.fixture(scope="session")
def measured(tmp_path_factory):
    """Look up what an experiment of scenes.py measured: measured("pressed", "grain")."""
    if shutil.which("yade") is None:
        pytest.fail("yade is not on PATH: install the Debian package 'yade'", pytrace=False)
    folder = tmp_path_factory.mktemp("contact_law")
    record = folder / "record.json"
    done = subprocess.run(
        ["yade", "-n", "-x", "-j1", str(SCENES)],
        cwd=folder,
        env={**os.environ, "CONTACT_LAW_RECORD": str(record)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=600,
    )
    if not record.exists():
        pytest.fail(
            f"{SCENES.name} left no record; YADE said:\n{done.stdout[-4000:]}", pytrace=False
        )
    numbers = json.loads(record.read_text())
    return lambda *name: numbers[" ".join(map(str, name))]
