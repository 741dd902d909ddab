"""What the benchmarks of the DEM runs share: hourglasses, earlier scripts, a run without driver."""

import hashlib
import json
import os
import subprocess
from pathlib import Path

import numpy as np

from calibrator.case.vocabulary import SCRIPTS
from calibrator.runs.request import Request, write_table

REPO = Path(__file__).resolve().parents[2]
WORK = REPO / "results" / "dem"
START = "15f9b96"  # the last commit before the cost of a run was worked on
# the defaults of that time
START_NUMERICS = {"rayleigh_fraction": 0.2, "filling_kinetic_energy": 1e-12}
HOURGLASSES = {
    "coarse_sand": dict(
        rolling_friction=0.23, sliding_friction=0.47, young_modulus=2.9e6, particle_radius=1e-3,
        particle_density=2650.0, fill_mass=16e-3, cylinder_diameter=30e-3, neck_diameter=14e-3,
    ),
    "quartz": dict(
        rolling_friction=0.3, sliding_friction=0.45, young_modulus=1e7, particle_radius=0.4e-3,
        particle_density=2700.0, fill_mass=1.013e-3, cylinder_diameter=10e-3, neck_diameter=5e-3,
        sampling_interval=1e-3,
    ),
}  # fmt: skip


def scripts_at(commit: str) -> Path:
    """Folder with the YADE scripts of a commit; "" stands for the work tree."""
    if not commit:
        return SCRIPTS
    folder = WORK / f"scripts_{commit}"
    if not folder.exists():
        folder.mkdir(parents=True)
        archive = subprocess.run(
            ["git", "archive", commit, "yade_scripts"], cwd=REPO, capture_output=True
        )
        if archive.returncode:
            folder.rmdir()
            raise SystemExit(
                f"commit {commit} is not in this clone: fetch the whole history (git fetch"
                " --unshallow)"
            )
        subprocess.run(["tar", "-x", "-C", folder], input=archive.stdout, check=True)
    return folder / "yade_scripts"


def core_seconds(command: list[str], folder: Path, **environment: str) -> float:
    """CPU seconds of a command in a folder; RuntimeError where it fails.

    Its output goes to output.txt.
    """
    with open(folder / "output.txt", "wb") as output:
        child = subprocess.Popen(
            command,
            cwd=folder,
            env={**os.environ, **environment},
            stdout=output,
            stderr=subprocess.STDOUT,
        )
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)  # or Popen would wait again
    if child.returncode:
        raise RuntimeError(
            f"{command[0]} failed: {(folder / 'output.txt').read_text(errors='replace')[-500:]}"
        )
    return usage.ru_utime + usage.ru_stime


def run_hourglass(commit: str, parameters: dict, again: str = "") -> dict:
    """One hourglass with the scripts of a commit: record, `core_seconds` and `curves`.

    A run that is there is not done twice, unless `again` names a repetition.
    """
    request, scripts = Request.of("hourglass", **parameters), scripts_at(commit)
    sources = b"".join(
        p.read_bytes() for p in sorted(scripts.glob("*.py")) + sorted(scripts.glob("*.json"))
    )
    folder = WORK / f"{request.run_id}_{hashlib.sha256(sources).hexdigest()[:8]}{again}"
    found = folder / "found.json"
    if not found.exists():
        folder.mkdir(parents=True, exist_ok=True)
        write_table(folder / "run.table", [request])
        spent = core_seconds(
            ["yade", "-j1", "-n", "-x", str(scripts / "hourglass.py")],
            folder,
            YADE_BATCH="run.table:2",
        )
        record = json.loads((folder / "records" / f"{request.run_id}.json").read_text())
        found.write_text(json.dumps({**record, "core_seconds": spent}))
    curves = folder / "records" / f"{request.run_id}.npz"
    return {
        **json.loads(found.read_text()),
        "curves": dict(np.load(curves)) if curves.exists() else {},
    }
