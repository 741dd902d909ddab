"""How the calibrator takes bad input: 100,000 damaged files, values and command lines.

    python -m tests.campaigns.bad_input.campaign            writes benchmarks/results/fuzz.json
    python -m tests.campaigns.bad_input.campaign --quick    1 % of the inputs, prints only

The first takes some minutes; kinds.py has what is damaged. `tracebacks` counts inputs that were
neither accepted as they stand nor refused with one line, `hangs` those that took longer than 20 s,
`code_executed` the marks that code in an input has left. `wrong` lists the first of each sort of
what went wrong.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.errors import HypothesisWarning

from benchmarks.common import asked_for_quick, write
from tests.campaigns.bad_input.damage import TOML_VALUES, WORDS
from tests.campaigns.bad_input.kinds import KINDS, SECONDS, Hang, use
from tests.campaigns.bad_input.yard import CASE, Yard

INPUTS = 102_000
BATCH = 1000  # inputs of one call of hypothesis, whose memory of what it has drawn grows with them
PARTS = 5  # of a kind, each in a process and folder of its own
PROCESSES = 100  # command lines that are called in a process of their own


def in_a_yard(name: str, part: int, inputs: int) -> tuple[str, dict[str, Any]]:
    """Inputs of one kind in a folder of their own, in memory where the machine has such a place."""
    warnings.simplefilter("ignore", HypothesisWarning)
    folder = Path(tempfile.mkdtemp(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
    try:
        yard = Yard(folder / "yard")
        counts = fuzz(yard, name, inputs, part) if name in KINDS else fuzz_processes(yard, inputs)
        return name, {**counts, "code_executed": yard.executed()}
    finally:
        shutil.rmtree(folder)


def fuzz(yard: Yard, name: str, inputs: int, part: int = 0) -> dict[str, Any]:
    """Use so many inputs of one kind; counts what went wrong. Other parts draw other inputs."""
    counts: Counter[str] = Counter()
    wrong: dict[str, str] = {}

    def one(drawn: Any) -> None:
        counts["inputs"] += 1
        try:
            use(yard, name, drawn)
        except Hang:
            counts["hangs"] += 1
            wrong.setdefault("hang", repr(drawn)[:300])
        except Exception as error:
            counts["tracebacks"] += 1
            place = traceback.extract_tb(error.__traceback__)[-1]
            wrong.setdefault(
                f"{type(error).__name__} in {Path(place.filename).name}:{place.lineno}",
                f"{error} {drawn!r}"[:600],
            )

    quietly = dict(
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    start = 10_000 * part
    while counts["inputs"] < inputs:
        test = given(KINDS[name].draw(yard))(one)
        seed(start)(settings(max_examples=min(BATCH, inputs - counts["inputs"]), **quietly)(test))()
        start += 1
    return {
        "inputs": counts["inputs"],
        "tracebacks": counts["tracebacks"],
        "hangs": counts["hangs"],
        "wrong": wrong,
    }


def fuzz_processes(yard: Yard, inputs: int) -> dict[str, Any]:
    """The command line in processes of its own: status 0, or status 2 and one line."""
    tracebacks = hangs = 0
    wrong: dict[str, str] = {}
    for i in range(inputs):
        value, word = TOML_VALUES[i % len(TOML_VALUES)], WORDS[i % len(WORDS)].replace("\0", "")
        lines = CASE.splitlines()
        key, separator, _ = lines[i % len(lines)].partition(" = ")
        lines[i % len(lines)] = f"{key} = {value}" if separator else word
        (yard.cases / "input.toml").write_text("\n".join(lines), "utf-8", "replace")
        command = [
            sys.executable,
            "-m",
            "calibrator.cli",
            "plan",
            str(yard.cases / "input.toml"),
            "--results",
            word or "x",
        ]
        if word.startswith(("/", "~", "..")):
            command[-1] = str(yard.path / "out")
        here = {"cwd": yard.path, "env": {**os.environ, "PYTHONPATH": os.getcwd()}}
        try:
            done = subprocess.run(command, capture_output=True, timeout=9 * SECONDS, **here)
        except subprocess.TimeoutExpired:
            hangs += 1
            wrong.setdefault("hang", f"{value!r} {word!r}"[:600])
            continue
        if done.returncode not in (0, 2) or (
            done.returncode == 2 and done.stderr.count(b"\n") != 1
        ):
            tracebacks += 1
            wrong.setdefault(f"status {done.returncode}", f"{command!r} {done.stderr!r}"[-600:])
    return {"inputs": inputs, "tracebacks": tracebacks, "hangs": hangs, "wrong": wrong}


def main() -> None:
    """Run every kind, in parts on all cores, and write the counts."""
    quick = asked_for_quick(__doc__, "1 % of the inputs, prints only")
    jobs = [
        (name, part, round(INPUTS * kind.share / PARTS))
        for name, kind in KINDS.items()
        for part in range(PARTS)
    ]
    jobs.append(("command_line_process", 0, PROCESSES))
    if quick:
        jobs = [(name, part, count // 20) for name, part, count in jobs if part == 0]
    found: dict[str, Any] = {
        "inputs": 0,
        "tracebacks": 0,
        "hangs": 0,
        "code_executed": 0,
        "kinds": {},
    }
    with ProcessPoolExecutor(2 * len(os.sched_getaffinity(0))) as pool:
        for name, counts in pool.map(in_a_yard, *zip(*jobs, strict=True)):
            own = found["kinds"].setdefault(
                name, {"inputs": 0, "tracebacks": 0, "hangs": 0, "wrong": {}}
            )
            own["wrong"].update(counts.pop("wrong"))
            for key, count in counts.items():
                found[key] += count
                if key in own:
                    own[key] += count
            print(name, own, flush=True)
    if not quick:
        write("fuzz", found)


if __name__ == "__main__":
    main()
