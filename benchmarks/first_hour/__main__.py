"""Three users' first hour: what they call, how long it takes, and what comes out.

    python -m benchmarks.first_hour [USER ...]    an hour of a machine with two cores each

users.py says what each has and calls, data.py made their raw data. Each starts in an empty folder
(results/first_hour/<user>, emptied first) with nothing but their own files and the installed
command, and ends with a report, a card and files for other engines. Every command has to end as it
should; a refusal has to say what to do. Writes benchmarks/results/first_hour.json: wall and core
seconds of each command, what it said last, and what was found.
"""

import json
import os
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from benchmarks.common import RESULTS, write
from benchmarks.first_hour.users import USERS, Step, User

HERE = Path(__file__).parent
FOLDERS = HERE.parents[1] / "results" / "first_hour"
COMMAND = Path(sys.executable).with_name("calibrator")


def follow(name: str, user: User) -> dict[str, Any]:
    """Be a user; returns what each command took, and what came out."""
    folder = FOLDERS / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for file, text in user.texts.items():
        (folder / file).write_text(text)
    for file in user.raw:
        shutil.copy(HERE / "data" / file, folder / file)
    steps = [carried_out(step, folder) for step in user.steps]
    summary = json.loads((folder / "results" / name / "summary.json").read_text())
    calibration, verification = summary["calibrate"], summary["verify"]
    return {
        "about": user.about,
        "steps": steps,
        "wall_seconds": sum(s["wall_seconds"] for s in steps),
        "core_seconds": sum(s["core_seconds"] for s in steps),
        "found": calibration["candidates"]["compromise"]["parameters"],
        "intervals_95": {
            p["name"]: p["interval_95"] for p in calibration["identifiability"]["parameters"]
        },
        "verified": verification["passed"],
        "files": sorted(
            str(p.relative_to(folder))
            for d in ("card", "export")
            for p in (folder / d).rglob("*")
            if p.is_file()
        ),
    }


def carried_out(step: Step, folder: Path) -> dict[str, Any]:
    """Call a command, and say what it took; ends the benchmark where it ends otherwise."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run(
        [COMMAND, *step.command], cwd=folder, capture_output=True, text=True, env=os.environ
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != step.status:
        sys.exit(f"{step.command} ended {done.returncode}: {done.stdout}{done.stderr}")
    said = done.stdout if step.status == 0 else done.stderr
    return {
        "command": " ".join(["calibrator", *step.command]),
        "status": step.status,
        "wall_seconds": round(time.monotonic() - began, 1),
        "core_seconds": round(
            after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 1
        ),
        "said": said.strip().splitlines(),
    }


def main() -> None:
    """Be the users that are named, or all."""
    names = sys.argv[1:] or list(USERS)
    path = RESULTS / "first_hour.json"
    results = json.loads(path.read_text())["users"] if path.exists() else {}
    for name in names:
        results[name] = follow(name, USERS[name])
        write("first_hour", {"users": results})


if __name__ == "__main__":
    main()
