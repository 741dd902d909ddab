"""Faults on purpose: whatever dies, nothing finished is lost, nothing runs twice without need, the
answer is the same.

    python -m tests.campaigns.faults                writes benchmarks/results/faults.json; 10-20 minutes
    python -m tests.campaigns.faults --quick        each kind once, on the fake YADE only, prints only
    python -m tests.campaigns.faults --only WORDS   kinds with these words in their name, prints only

A fault befalls a results folder of its own. Then `calibrator run` is called again, as a user would,
and the outcome is compared with that of the undisturbed plan. `lost_finished_runs` counts records
that had been good before the fault and are not the same to the byte, `undetected_corruptions`
spoiled records that were not reported and made anew, `wrong_answers` databases that are not the
undisturbed one to the byte, `tracebacks` those on stderr, `repeated_without_need` runs that were
started again although finished, or after a kill although not in flight, and `unexpected` faults
that ended in another way than expected.

Most faults strike the fake YADE of tests/fake_yade.py, some the real one with hourglasses of 270
grains. Each function below is one kind of fault; its first line is its name,
`tests/campaigns/faults/stage.py` is its stage.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.common import write
from tests.campaigns.faults.stage import (
    NotInjected,
    Stage,
    Undisturbed,
    in_private,
    judge,
    undisturbed,
    with_substitutes,
)

COUNTS = (
    "lost_finished_runs",
    "undetected_corruptions",
    "wrong_answers",
    "tracebacks",
    "repeated_without_need",
)
SAME = "the next call finishes the plan"
REFUSED = "one line with a remedy, and once the cause is gone the next call finishes the plan"
REPAIRED = "the damaged record is reported and its run done again"
RETRIED = "the run is done again in the same call"
KEPT = "the run is kept with its reason and left out, and no call tries it again"
PLANS = {False: (4, 2), True: (2, 2)}  # sets and replicates of the fake and of the real YADE's plan
WORKERS = 3  # faults at a time: most of a fault is waiting


@dataclass(frozen=True)
class Kind:
    """A kind of fault: what it does to a stage, what is expected, and how often it strikes the fake
    and the real YADE.
    """

    name: str
    act: Callable[[Stage], None]
    expected: str
    fake: int
    real: int
    needs_mounts: bool = False


KINDS: list[Kind] = []


def fault(
    expected: str, fake: int, real: int = 0, needs_mounts: bool = False
) -> Callable[[Callable[[Stage], None]], Any]:
    """Register a function as a kind of fault, under the first line of its docstring."""

    def register(act: Callable[[Stage], None]) -> Callable[[Stage], None]:
        KINDS.append(
            Kind(str(act.__doc__).splitlines()[0], act, expected, fake, real, needs_mounts)
        )
        return act

    return register


# Death


@fault(SAME, fake=30, real=2)
def driver_killed(stage: Stage) -> None:
    """kill -9 of the driver"""
    driver = stage.start()
    stage.moment(driver)
    stage.kill(driver, "driver")
    if stage.rng.random() < 0.5:  # else the next driver meets the runs that outlived this one
        stage.orphans_end()


@fault(SAME, fake=10)
def drivers_killed_in_a_row(stage: Stage) -> None:
    """kill -9 of three drivers in a row"""
    for _ in range(3):
        driver = stage.start()
        time.sleep(stage.rng.uniform(0.1, 1.0))
        if driver.running:
            stage.kill(driver, "driver")


def _killed(stage: Stage, who: str) -> None:
    driver = stage.start()
    stage.moment(driver)
    stage.kill(driver, who)
    stage.expect(stage.end(driver).status == 0, "the driver did not go on by itself")
    stage.expect(
        len(stage.believed()) == len(stage.whole.requests),
        "the driver did not finish the plan by itself",
    )


@fault(RETRIED, fake=25, real=2)
def yade_batch_killed(stage: Stage) -> None:
    """kill -9 of yade-batch"""
    _killed(stage, "yade-batch")


@fault(RETRIED, fake=25, real=2)
def yade_killed(stage: Stage) -> None:
    """kill -9 of yade"""
    _killed(stage, "yade")


@fault(RETRIED, fake=25, real=2)
def wrapper_killed(stage: Stage) -> None:
    """kill -9 of the wrapper, or of the shell or time limit around it"""
    _killed(stage, "wrapper")


@fault(REFUSED, fake=8)
def yade_batch_killed_twice(stage: Stage) -> None:
    """two yade-batches in a row killed -9"""
    driver = stage.start()
    for _ in range(2):
        stage.kill(driver, "yade-batch")
        gone = set(stage.processes())
        stage.wait_for(lambda gone=gone: not driver.running or not gone & set(stage.processes()))
    stage.refused(stage.end(driver))


# Records


def _half(text: str, rng: random.Random) -> str:
    return text[: len(text) // 2]


def _truncated(text: str, rng: random.Random) -> str:
    return text[: rng.randrange(1, len(text) - 2)]


def _emptied(text: str, rng: random.Random) -> str:
    return ""


def _lying(text: str, rng: random.Random) -> str:
    record = json.loads(text)
    name = rng.choice([n for n, v in record["parameters"].items() if isinstance(v, float)])
    record["parameters"][name] = record["parameters"][name] * (1 + 1e-12) + 1e-15
    return json.dumps(record)


def _of_another_run(text: str, rng: random.Random) -> str:
    return re.sub('"run_id": "[0-9a-f]+"', f'"run_id": "{rng.randbytes(8).hex()}"', text)


def _of_another_version(text: str, rng: random.Random) -> str:
    return json.dumps({**json.loads(text), "schema": rng.choice([0, 2, 99, "1", None, 1.5])})


def _with_nan(text: str, rng: random.Random) -> str:
    name, value = rng.choice(re.findall(r'"(\w+)": (-?[0-9.e-]+)', text))
    return text.replace(
        f'"{name}": {value}', f'"{name}": {rng.choice(["NaN", "Infinity", "-Infinity"])}'
    )


def _with_a_wrong_type(text: str, rng: random.Random) -> str:
    record = json.loads(text)
    key = rng.choice(
        ["setup", "run_id", "parameters", "status", "responses", "diagnostics", "provenance"]
    )
    return json.dumps({**record, key: rng.choice([[], 7, True, None])})


def _without_a_key(text: str, rng: random.Random) -> str:
    record = json.loads(text)
    # records from before there were seals are believed
    del record[rng.choice(sorted(record.keys() - {"seal"}))]
    return json.dumps(record)


def _with_another_number(text: str, rng: random.Random) -> str:
    """A number that could be true, in place of the one that was measured."""
    record = json.loads(text)
    name = rng.choice(sorted(record["responses"]))
    return json.dumps(
        {**record, "responses": {**record["responses"], name: record["responses"][name] * 1.01}}
    )


def _with_a_flipped_bit(text: str, rng: random.Random) -> str:
    """One bit of the file, such that it does not happen to say the same."""
    while True:
        place = rng.randrange(len(text))
        flipped = text[:place] + chr(ord(text[place]) ^ 1 << rng.randrange(7)) + text[place + 1 :]
        with contextlib.suppress(ValueError):
            if json.loads(flipped) == json.loads(text):
                continue
        return flipped


SPOILED = {
    "half written": _half,
    "truncated": _truncated,
    "emptied": _emptied,
    "with a lying echo": _lying,
    "that answers another run": _of_another_run,
    "of an unknown version": _of_another_version,
    "with NaN or infinity": _with_nan,
    "with a wrong type": _with_a_wrong_type,
    "without a key": _without_a_key,
    "with another number": _with_another_number,
    "with a flipped bit": _with_a_flipped_bit,
}


def _spoil(stage: Stage, run_id: str, change: Callable[[str, random.Random], str]) -> None:
    stage.damaged.add(run_id)
    stage.record(run_id).write_text(change(stage.record(run_id).read_text(), stage.rng))


def _spoiled_between_calls(change: Callable[[str, random.Random], str], stage: Stage) -> None:
    stage.finish()
    _spoil(stage, stage.rng.choice(sorted(stage.finished)), change)


KINDS += [
    Kind(
        f"record {name}",
        partial(_spoiled_between_calls, change),
        REPAIRED,
        fake=6,
        real=int(name in ("half written", "emptied")),
    )
    for name, change in SPOILED.items()
]


@fault(REPAIRED, fake=8)
def spoiled_in_mid_run(stage: Stage) -> None:
    """spoiled in mid-run: record of a finished run, while others are under way"""
    driver = stage.start()
    stage.wait_for(lambda: bool(stage.believed()) or not driver.running)
    stage.moment(driver)
    stage.take_stock()
    _spoil(
        stage, stage.rng.choice(sorted(stage.finished)), stage.rng.choice(list(SPOILED.values()))
    )
    stage.end(driver)


@fault(RETRIED, fake=12)
def yade_misbehaves_once(stage: Stage) -> None:
    """YADE crashes, lies, writes half a record or none, once in each of two runs"""
    both = stage.rng.sample(sorted(stage.whole.requests), 2)
    seeds = {
        str(stage.whole.requests[i].parameters["seed"]): stage.rng.choice(
            ["crash", "lie", "half", "nothing"]
        )
        for i in both
    }
    stage.behave(once=True, **seeds)
    stage.expect(
        stage.run().status == 0 and len(stage.believed()) == len(stage.whole.requests),
        "it was not tried again",
    )


# Places


def _fill(path: Path, leave: int) -> None:
    """Write until the disk is full, but for so many bytes."""
    with contextlib.suppress(OSError), open(path, "wb", buffering=0) as stream:
        while stream.write(bytes(4096)):
            pass
    with open(path, "r+b") as stream:
        stream.truncate(max(0, path.stat().st_size - leave))


def _crowd(folder: Path, leave: int) -> None:
    """Make files until there is no room for another, but for so many."""
    folder.mkdir()
    with contextlib.suppress(OSError):
        for i in range(10**6):
            (folder / str(i)).touch()
    for path in list(folder.iterdir())[:leave]:
        path.unlink()


def _short_of(stage: Stage, use_up: Callable[[Path], None]) -> None:
    with stage.file_system() as folder:
        driver = stage.start()
        stage.moment(driver)
        stage.take_stock()
        use_up(folder / "ballast")
        ended = stage.end(driver)
        if ended.status == 0:  # what was left was enough
            raise NotInjected
        stage.refused(ended)
        stage.expect(
            not [p for p in folder.rglob("*.tmp") if p.parent.name != "records"],
            "half a file is left on the full disk",
        )
        # else only notes about the runs were missing
        if len(stage.believed()) < len(stage.whole.requests):
            stage.refused(stage.run())
        subprocess.run(["rm", "-r", folder / "ballast"], check=True)


@fault(REFUSED, fake=14, real=2, needs_mounts=True)
def disk_full(stage: Stage) -> None:
    """disk full in mid-run, to the last byte or nearly so"""
    leave = stage.rng.choice([0, 1, 2, 3, 5, 8]) * (16384 if stage.whole.real else 4096)
    _short_of(stage, partial(_fill, leave=leave))


@fault(REFUSED, fake=6, needs_mounts=True)
def no_inodes(stage: Stage) -> None:
    """no room for another file in mid-run"""
    _short_of(stage, partial(_crowd, leave=stage.rng.randrange(6)))


@fault(REFUSED, fake=10, real=1, needs_mounts=True)
def read_only(stage: Stage) -> None:
    """results folder, or a folder in it, that cannot be written, with a part of the plan finished"""
    stage.finish(stage.rng.randrange(len(stage.whole.requests)))
    folder = stage.results / stage.rng.choice(["", "records", "logs", "locks", "batches"])
    folder.mkdir(exist_ok=True)
    with stage.read_only(folder):
        stage.refused(stage.run())


# Time


@fault(SAME, fake=10, real=1)
def clock_jumps(stage: Stage) -> None:
    """clock that jumps by hours or years in mid-run, and files dated in the past and in the future"""
    jump = stage.rng.choice([-1, 1]) * 10 ** stage.rng.uniform(4, 9)
    stage.move_clock(jump)
    driver = stage.start()
    stage.moment(driver)
    stage.take_stock()
    for path in stage.results.glob("*/*"):
        if path.is_file():
            os.utime(path, times=(max(0.0, time.time() + jump),) * 2)
    stage.expect(stage.end(driver).status == 0, "the driver did not finish the plan")
    about = [json.loads(data)["provenance"] for data in stage.believed().values()]
    stage.expect(
        any(abs(p["started"] - time.time()) > 5e3 or abs(p["wall_time"]) > 5e3 for p in about),
        "no clock has jumped",
    )


# Company


@fault(SAME, fake=12, real=1)
def two_drivers(stage: Stage) -> None:
    """two drivers on one case, the second at a random moment, the first one killed every other time"""
    first = stage.start()
    time.sleep(stage.rng.choice([0.0, stage.rng.uniform(0, 2)]))
    second = stage.start()
    if stage.rng.random() < 0.5:
        stage.moment(first)
        stage.kill(first, "driver")
    else:
        stage.killed = True  # nothing may run twice
        stage.expect(stage.end(first).status == 0, "the first driver failed")
    stage.expect(stage.end(second).status == 0, "the second driver failed")
    stage.take_stock()


def _another_value(lines: list[str], rng: random.Random) -> None:
    row = rng.randrange(1, len(lines))
    cells = lines[row].split(" ")
    cells[lines[0].split(" ").index("sliding_friction")] = "0.123"
    lines[row] = " ".join(cells)


def _rows_swapped(lines: list[str], rng: random.Random) -> None:
    lines[1:] = rng.sample(lines[1:], len(lines) - 1)


def _ids_swapped(lines: list[str], rng: random.Random) -> None:
    ids = [line.split(" ")[0] for line in lines[1:]]
    rng.shuffle(ids)
    lines[1:] = [
        " ".join([run_id, *line.split(" ")[1:]])
        for run_id, line in zip(ids, lines[1:], strict=True)
    ]


def _row_doubled(lines: list[str], rng: random.Random) -> None:
    lines[rng.randrange(1, len(lines))] = lines[rng.randrange(1, len(lines))]


def _table_emptied(lines: list[str], rng: random.Random) -> None:
    lines[:] = []


EDITS = (_another_value, _rows_swapped, _ids_swapped, _row_doubled, _table_emptied)


@fault(RETRIED, fake=15, real=1)
def table_edited(stage: Stage) -> None:
    """table of the batch edited in mid-run: a value, rows or run ids swapped, a row doubled,
    emptied
    """
    driver = stage.start()
    stage.moment(driver)
    stage.take_stock()
    (table,) = list(stage.results.glob("batches/*.table"))[:1] or [None]
    if table is None:
        raise NotInjected
    lines = table.read_text().splitlines()
    stage.rng.choice(EDITS)(lines, stage.rng)
    table.write_text("".join(f"{line}\n" for line in lines))
    stage.expect(stage.end(driver).status == 0, "the driver did not go on by itself")


@fault(SAME, fake=4)
def case_edited(stage: Stage) -> None:
    """case file emptied in mid-run, and restored"""
    stage.case = stage.path / "toy.toml"
    for name in ("toy.toml", "lab.csv"):
        shutil.copy(stage.whole.case.with_name(name), stage.path)
    driver = stage.start()
    stage.moment(driver)
    stage.take_stock()
    text = stage.case.read_text()
    stage.case.write_text("")
    stage.expect(stage.end(driver).status == 0, "the driver had not read the case to its end")
    stage.refused(stage.run())
    stage.case.write_text(text)


# State that the driver keeps


@fault(REFUSED, fake=6)
def state_damaged(stage: Stage) -> None:
    """list of failures or summary truncated, deleted when the driver asks for that"""
    stage.finish(stage.rng.randrange(len(stage.whole.requests)))
    path = stage.results / stage.rng.choice(["failures.json", "summary.json"])
    path.write_text('{"0": {"kind": "cra')
    ended = stage.run()
    stage.refused(ended)
    stage.expect("delete it" in ended.said, "the remedy is not to delete it")
    path.unlink()


# YADE


@fault(REFUSED, fake=4)
def yade_missing(stage: Stage) -> None:
    """yade or yade-batch missing"""
    stage.finish(stage.rng.randrange(len(stage.whole.requests)))
    program = stage.path / "bin" / stage.rng.choice(["yade", "yade-batch"])
    program.rename(program.with_name("away"))
    stage.refused(stage.run())
    program.with_name("away").rename(program)


@fault(REFUSED, fake=6)
def yade_goes_missing(stage: Stage) -> None:
    """yade removed in mid-run"""
    driver = stage.start()
    stage.wait_for(lambda: not driver.running or bool(stage.calls()))
    time.sleep(stage.rng.uniform(0, 4 * 0.15))
    stage.take_stock()
    program = stage.path / "bin" / "yade"
    program.rename(program.with_name("away"))
    stage.refused(stage.end(driver))
    program.with_name("away").rename(program)


@fault(REFUSED, fake=3)
def yade_batch_is_broken(stage: Stage) -> None:
    """yade-batch that cannot start, as with a missing library"""
    program = stage.path / "bin" / "yade-batch"
    text = program.read_text()
    program.write_text("#!/bin/sh\necho no library >&2\nexit 1\n")
    stage.refused(stage.run())
    program.write_text(text)


@fault("the two versions are named in a warning, and each row of the database says its own", fake=4)
def another_yade(stage: Stage) -> None:
    """another version of YADE for the rest of the plan"""
    stage.finish(stage.rng.randrange(1, len(stage.whole.requests)))
    stage.behave(yade="fake-2")
    ended = stage.run()
    stage.expect(
        "fake, fake-2" in ended.told and ended.status == 0, "nobody said that versions are mixed"
    )
    rows = stage.database().splitlines()
    stage.expect(
        sum(",fake-2," in row for row in rows) == len(set(stage.calls())),
        "a row does not say its version",
    )
    stage.versions = {"fake-2": "fake"}


# Runs that cannot succeed


@fault(KEPT, fake=4)
def clogs_for_ever(stage: Stage) -> None:
    """seed that clogs for ever, and so does its substitute"""
    run_ids = stage.rng.sample(sorted(stage.whole.requests), stage.rng.randrange(1, 4))
    clogging = with_substitutes([stage.whole.requests[i] for i in run_ids])
    stage.forsaken = {r.run_id: "clogged" for r in clogging}
    stage.behave(**{str(r.parameters["seed"]): "clog" for r in clogging})
    stage.expect(stage.run().status == 0, "the driver failed")
    stage.same_again()


@fault(KEPT, fake=4)
def never_succeeds(stage: Stage) -> None:
    """run that crashes, lies, or leaves half a record or none for ever"""
    run_id = stage.rng.choice(sorted(stage.whole.requests))
    what = stage.rng.choice(["crash", "lie", "half", "nothing"])
    stage.forsaken = {run_id: "crash" if what == "crash" else "lost"}
    stage.behave(**{str(stage.whole.requests[run_id].parameters["seed"]): what})
    stage.expect(stage.run().status == 0, "the driver failed")
    stage.same_again()


@fault(KEPT, fake=2)
def hangs_for_ever(stage: Stage) -> None:
    """run that never ends, with a short time limit"""
    run_id = stage.rng.choice(sorted(stage.whole.requests))
    stage.forsaken = {run_id: "timeout"}
    stage.behave(**{str(stage.whole.requests[run_id].parameters["seed"]): "hang"})
    clock = stage.path / "bin" / "timeout"  # its fourth argument is the limit
    clock.write_text(
        f'#!/bin/sh\nshift 3\nexec {shutil.which("timeout")} --foreground --kill-after=1 1.5 "$@"\n'
    )
    clock.chmod(0o755)
    stage.expect(stage.run().status == 0, "the driver failed")
    stage.same_again()


# The campaign


def strike(kind: Kind, whole: Undisturbed, number: int, folder: Path) -> dict[str, Any]:
    """Inject one fault, at another moment where there was nothing to strike any more; what was
    expected and what happened.
    """
    for attempt in range(20):
        stage = Stage(
            folder / f"attempt-{attempt}",
            whole,
            random.Random(f"{kind.name} {number} {attempt} {whole.real}"),
        )
        try:
            kind.act(stage)
            verdict = asdict(judge(stage))
            stage.orphans_end()
            break
        except NotInjected:
            stage.orphans_end()
        except TimeoutError as error:
            verdict = {**dict.fromkeys(COUNTS, 0), "happened": f"it hangs: {error}"}
            stage.clear()
            break
    else:
        raise RuntimeError(f"{kind.name}: there was never anything to strike")
    yade = "real" if whole.real else "fake"
    return {"kind": kind.name, "yade": yade, "number": number, "expected": kind.expected, **verdict}


def campaign(quick: bool, only: str = "") -> dict[str, Any]:
    """Every fault of every kind with these words in its name; quickly, each kind once, on the fake
    YADE.
    """
    work = Path(tempfile.mkdtemp(prefix="faults-")).resolve()
    asked = [k for k in KINDS if only in k.name]
    able = [k for k in asked if os.environ.get("FAULTS_PRIVATE") == "yes" or not k.needs_mounts]
    found: list[dict[str, Any]] = []
    try:
        for real in [False] if quick else [False, True]:
            jobs = [(k, i) for k in able for i in range(k.real if real else 1 if quick else k.fake)]
            whole = undisturbed(work / f"undisturbed-{real}", real, *PLANS[real])
            with ProcessPoolExecutor(WORKERS) as pool:
                tasks = [
                    pool.submit(strike, k, whole, i, work / f"{real}-{KINDS.index(k)}-{i}")
                    for k, i in jobs
                ]
                for task in tasks:
                    found.append(task.result())
                    print(
                        *(found[-1][key] for key in ("yade", "kind", "number", "happened")),
                        sep=" | ",
                        flush=True,
                    )
    finally:
        shutil.rmtree(work)
    return {
        **counted(found),
        "not_possible_here": [k.name for k in asked if k not in able],
        "faults": found,
    }


def counted(found: list[dict[str, Any]]) -> dict[str, Any]:
    """The sums over all faults."""
    sums = {key: sum(f[key] for f in found) for key in COUNTS}
    unexpected = sum(f["happened"] != "as expected" for f in found)
    return {
        "injected": len(found),
        "on_real_yade": sum(f["yade"] == "real" for f in found),
        **sums,
        "unexpected": unexpected,
    }


def main() -> None:
    """Carry out the campaign, print its counts, and write them where it was the whole one."""
    in_private("tests.campaigns.faults", sys.argv[1:])
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument(
        "--quick", action="store_true", help="each kind once, on the fake YADE only"
    )
    parser.add_argument(
        "--only", default="", metavar="WORDS", help="kinds with these words in their name"
    )
    parser.add_argument(
        "--to",
        type=Path,
        metavar="FILE",
        help="where results go that are not those of the whole campaign",
    )
    options = parser.parse_args()
    found = campaign(options.quick, options.only)
    print(json.dumps({k: v for k, v in found.items() if k != "faults"}, indent=1))
    if options.to:
        options.to.write_text(json.dumps(found, indent=1) + "\n")
    elif not options.quick and not options.only:
        write("faults", found)


if __name__ == "__main__":
    main()
