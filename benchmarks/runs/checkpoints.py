"""A run of eight minutes, killed at three moments, beside the undisturbed one.

    python -m benchmarks.runs.checkpoints    half an hour of a core

It writes benchmarks/results/checkpoints.json: whether the two records and all their arrays are the
same, where the killed run went on, and what was made twice.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.common import rounded, write
from calibrator.case.vocabulary import SCRIPTS
from calibrator.runs.local import clean_environment
from calibrator.runs.programs import chosen
from calibrator.runs.record import Record, read_record
from calibrator.runs.request import Request, write_table

# some 3,500 grains of quartz; the modulus makes it last
REQUEST = Request.of(
    "hourglass",
    particle_radius=0.4e-3,
    particle_density=2650.0,
    young_modulus=1e8,
    fill_mass=2.5e-3,
    cylinder_diameter=14e-3,
    neck_diameter=6.5e-3,
    seed=870_001,
)
MOMENTS = (0.3, 0.6, 0.9)  # of the CPU time of the undisturbed run


def started(folder: Path) -> subprocess.Popen[bytes]:
    """YADE over the request."""
    folder.mkdir(exist_ok=True)
    write_table(folder / "one.table", [REQUEST])
    environment = {**clean_environment(9e4, 9e4), "YADE_BATCH": "one.table:2"}
    command = [chosen().yade, "-n", "-x", str(SCRIPTS / f"{REQUEST.setup}.py")]
    return subprocess.Popen(command, cwd=folder, env=environment, stdout=sys.stderr)


def undisturbed(folder: Path) -> Record:
    """The record of a run that is left alone."""
    started(folder).wait()
    return record_in(folder)


def record_in(folder: Path) -> Record:
    """The record that the run left in a folder."""
    return read_record(folder / "records" / f"{REQUEST.run_id}.json", REQUEST)


def killed(folder: Path, moments: list[float]) -> tuple[Record, float]:
    """The record of a run that is killed at these moments, and the CPU time of all processes [s].

    moments : CPU time [s] of the run itself, which one that goes on counts from its checkpoint.
    """
    spent = 0.0
    for moment in (*moments, float("inf")):
        process, own, before = started(folder), 0.0, saved_cpu_time(folder)
        while process.poll() is None:
            time.sleep(0.5)
            own = cpu_time(process.pid) or own
            if before + own > moment:
                process.kill()
                process.wait()
        spent += own
    return record_in(folder), spent


def saved_cpu_time(folder: Path) -> float:
    """CPU time [s] of the run up to its last checkpoint, 0 where there is none."""
    try:
        text = (folder / "checkpoints" / REQUEST.run_id / "state.json").read_text()
    except FileNotFoundError:
        return 0.0
    return float(json.loads(text)["cpu"])


def cpu_time(pid: int) -> float | None:
    """CPU time [s] of a process, None where it has ended (proc(5): fields 14 and 15 of stat)."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / 100 if len(fields) > 12 else None


def stepping(record: Record) -> float:
    """CPU time [s] of a run's waits."""
    return float(record.diagnostics["filling_cpu"]) + float(record.diagnostics["release_cpu"])


def same_arrays(one: Path, other: Path) -> bool:
    """Whether the arrays that two runs left are equal, each to its last bit."""
    name = Path("records", f"{REQUEST.run_id}.npz")
    with np.load(one / name) as a, np.load(other / name) as b:
        return a.files == b.files and all(np.array_equal(a[n], b[n]) for n in a.files)


def measure(folder: Path) -> dict:
    """Both runs, compared."""
    alone = undisturbed(folder / "alone")
    moments = [share * stepping(alone) for share in MOMENTS]
    again, spent = killed(folder / "killed", moments)
    return {
        "particles": alone.diagnostics["particles"],
        "steps": alone.diagnostics["steps"],
        "core_seconds": rounded(stepping(alone), 3),
        "killed_at_core_seconds": [rounded(m, 3) for m in moments],
        "went_on": again.provenance.get("resumed", "never"),
        "core_seconds_of_all_processes": rounded(spent, 3),
        "same_status_and_responses": (alone.status, alone.responses)
        == (again.status, again.responses),
        "same_arrays": same_arrays(folder / "alone", folder / "killed"),
        "yade": alone.provenance["yade"],
    }


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        write("checkpoints", measure(Path(place)))
