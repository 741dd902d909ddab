"""A SLURM of two nodes on loopback, and what tests need to speak to it."""

import contextlib
import os
import random
import shutil
import socket
import subprocess
import tempfile
from pathlib import Path

import pytest

from calibrator.case.settings import Cluster

SCRIPT = Path(__file__).with_name("slurm_local.sh")
PROGRAMS = ("slurmctld", "slurmd", "munged", "sbatch", "squeue")
MISSING = [
    p for p in PROGRAMS if shutil.which(p, path=f"{os.environ['PATH']}:/usr/sbin:/sbin") is None
]
# `make test` installs SLURM, which takes root; elsewhere these tests are shown as skipped, with
# what is missing and the command.
NEEDS_SLURM = [
    pytest.mark.cluster,
    pytest.mark.skipif(
        bool(MISSING),
        reason=f"{', '.join(MISSING)} not installed: run `make slurm` as root or with sudo",
    ),
]


def three_free_ports():
    """The first of three, below those that the system hands out for outgoing connections."""
    for port in random.sample(range(20_000, 30_000, 3), 100):
        with contextlib.ExitStack() as held, contextlib.suppress(OSError):
            for one in range(port, port + 3):
                held.enter_context(socket.socket()).bind(("", one))
            return port
    raise AssertionError("no three ports in a row are free")


@pytest.fixture(scope="session")
def slurm():
    """The controller's folder; SLURM's commands find it by the environment."""
    folder = tempfile.mkdtemp(prefix="slurm-")
    os.environ["SLURM_CONF"] = f"{folder}/slurm.conf"
    try:
        subprocess.run(["bash", SCRIPT, "start", folder, str(three_free_ports())], check=True)
        yield folder
    finally:
        subprocess.run(["bash", SCRIPT, "stop", folder])
        shutil.rmtree(folder, ignore_errors=True)
        del os.environ["SLURM_CONF"]


def options_for(programs, **changes):
    """Short slices, and these programs first on the PATH of the nodes."""
    shell = (f'export PATH="{programs}:$PATH"',)
    short = {"partition": "main", "time": "10", "slice_minutes": 0.2, "grace": 5, "shell": shell}
    return Cluster(**{**short, **changes})
