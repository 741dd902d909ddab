"""The stage for tests/campaigns/faults/kinds.py: a small case, a YADE, drivers that can be killed, a file
system of its own, and a judge.

A driver is a process of its own, in a session of its own. With the fake YADE it is forked from this
process, which has imported the calibrator already: importing costs more than all the rest. With the
real YADE it is `python -m calibrator.cli`.
"""

from __future__ import annotations

import contextlib
import json
import logging
import multiprocessing
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.plan.requests import plan_requests
from calibrator.plan.run import collect
from calibrator.plan.seeds import SUBSTITUTE_SEED
from calibrator.runs import workspace
from calibrator.runs.record import InvalidRecord, read_record
from calibrator.runs.request import Request

REPO = Path(__file__).resolve().parents[3]
TOOLS = ("sh", "sed", "mkdir", "flock", "timeout", "setpriv", "unshare", "true")
"""What a run needs beside YADE.

On a PATH of these alone, YADE can be missing although this machine has it.
"""

# seconds for what takes a few, on a machine that may be busy with simulations: a fault that hangs
PATIENCE = 1800.0
DURATION = 0.1  # seconds that a run of the fake YADE lasts
FORK = multiprocessing.get_context("fork")

CASE = """
name = "toy"
measured = "lab.csv"
[parameters.rolling_friction]
low = 0.05
high = 0.45
[parameters.sliding_friction]
low = 0.2
high = 0.7
[parameters.young_modulus]
low = 0.5e6
high = 0.6e6
[setups.hourglass]
fill_mass = 3e-3
cylinder_diameter = 14e-3
neck_diameter = 12e-3
[plan]
design = "sobol"
sets = {sets}
replicates = {replicates}
[run]
jobs = 2
"""
LAB = """setup,response,value,scatter,replicates,unit,role
hourglass,bulk_density,1605.6,5,8,kg/m3,calibrate
hourglass,drained_equivalent_angle_deg,46.8,0.2,8,deg,calibrate
"""


class NotInjected(Exception):
    """The moment for the fault had passed: the plan was finished, or no such process was there.

    Try another moment.
    """


# YADE, fake and real


def install(folder: Path, real: bool) -> str:
    """Put a yade and a yade-batch into folder/bin; returns a PATH with them.

    Both note the runs they start in calls.txt.
    """
    programs, tools = folder / "bin", folder / "tools"
    programs.mkdir(parents=True)
    if real:
        note = 'sed -n "${YADE_BATCH##*:}s/ .*//p" "${YADE_BATCH%:*}" >> calls.txt'
        clock = f"[ ! -d '{folder}/clock' ] || export PYTHONPATH='{folder}/clock'"
        _program(
            programs / "yade", f'#!/bin/sh\n{note}\n{clock}\nexec {shutil.which("yade")} "$@"\n'
        )
        return f"{programs}{os.pathsep}{os.environ['PATH']}"
    for name, function in (("yade", "run_line"), ("yade-batch", "run_batch")):
        code = (
            f"import sys\nsys.path.insert(0, {str(REPO / 'tests')!r})\nimport"
            f" fake_yade\nfake_yade.{function}()\n"
        )
        _program(programs / name, f"#!{sys.executable}\n{code}")
    tools.mkdir()
    for tool in TOOLS:
        (tools / tool).symlink_to(str(shutil.which(tool)))
    return f"{programs}{os.pathsep}{tools}"


def _program(path: Path, text: str) -> None:
    path.write_text(text)
    path.chmod(0o755)


# Drivers


@dataclass(frozen=True)
class Ended:
    """How a driver ended: its status and what it said on stderr."""

    status: int
    said: str  # on stderr
    told: str = ""  # on stdout

    @property
    def refused(self) -> bool:
        """Whether the last line is an error with a remedy, after nothing but warnings and progress."""
        *before, last = self.said.splitlines() or [""]
        plain = all(line.startswith(("WARNING: ", "[")) for line in before)
        return (
            self.status == 2
            and plain
            and last.startswith("calibrator: ")
            and (": " in last[12:] or "; " in last)
        )


@dataclass(frozen=True)
class Driver:
    """A driver under way."""

    process: Any
    errors: Path

    def wait(self) -> Ended:
        """Wait for its end."""
        self.process.join(PATIENCE)
        if self.process.exitcode is None:
            raise TimeoutError(f"a driver did not end in {PATIENCE:g} s: {self.errors.read_text()}")
        return Ended(
            self.process.exitcode,
            self.errors.read_text(),
            self.errors.with_suffix(".out").read_text(),
        )

    @property
    def running(self) -> bool:
        """Whether it is still there."""
        return self.process.is_alive()

    def kill(self) -> None:
        """Kill -9, of the driver alone."""
        self.process.kill()
        self.process.join()


CLOCK = """import time
_now, _start = time.time, {start}
time.time = lambda: _now() + ({jump} if _now() > _start else 0.0)
"""


def _drive(arguments: list[str], path: str, errors: Path, real: bool, clock: Path) -> None:
    """What a driver's process does; a folder `clock` holds the clock of another time."""
    os.setsid()
    os.environ["PATH"] = path
    with open(errors.with_suffix(".out"), "wb") as out, open(errors, "wb") as err:
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
    if real:
        os.environ["PYTHONPATH"] = f"{clock}{os.pathsep}{REPO}"
        os.execv(sys.executable, [sys.executable, "-m", "calibrator.cli", *arguments])
    sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)
    logging.getLogger().handlers.clear()
    if clock.exists():
        exec((clock / "sitecustomize.py").read_text(), {})
    sys.exit(main(arguments))


def descendants(pid: int) -> list[int]:
    """Process ids of the children of a process, of their children, and so on."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it ended meanwhile
            parent = int(stat.read_text().rpartition(")")[2].split()[1])
            children.setdefault(parent, []).append(int(stat.parent.name))
    found, left = [], [pid]
    while left:
        left += (own := children.get(left.pop(), []))
        found += own
    return found


def role(pid: int) -> str:
    """Which part of a run a driver's descendant is: yade-batch, yade, or the wrapper with shell and
    time limit.
    """
    try:
        line = Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return "ended"
    words = [Path(word).name for word in line.split("\0")]
    if words[0].startswith("python") and words[1] in ("yade", "yade-batch"):
        return words[1]
    return (
        "wrapper"
        if "run_yade.sh" in line and words[0] == "sh" or words[0] in ("timeout", "flock")
        else "other"
    )


# The stage


@dataclass(frozen=True)
class Undisturbed:
    """The plan carried out without a fault: the case, a finished results folder, and the database
    that it gives.
    """

    case: Path
    results: Path
    database: str
    requests: dict[str, Request]
    real: bool


def undisturbed(folder: Path, real: bool, sets: int, replicates: int) -> Undisturbed:
    """Carry out the plan once. Raises RuntimeError if that alone goes wrong."""
    folder.mkdir(parents=True)
    (folder / "lab.csv").write_text(LAB)
    (folder / "toy.toml").write_text(CASE.format(sets=sets, replicates=replicates))
    requests = {r.run_id: r for r in plan_requests(read_case(folder / "toy.toml"))}
    whole = Undisturbed(folder / "toy.toml", folder / "results", "", requests, real)
    stage = Stage(folder, whole, random.Random(0))
    ended = stage.run()
    if ended.status or len(stage.believed()) < len(requests) or len(stage.calls()) != len(requests):
        raise RuntimeError(f"the undisturbed plan failed: {ended}")
    return Undisturbed(whole.case, whole.results, stage.database(), requests, real)


@dataclass
class Stage:
    """One results folder and the fault that befalls it."""

    path: Path
    whole: Undisturbed
    rng: random.Random
    case: Path = Path()
    search_path: str = ""
    finished: dict[str, bytes] = field(default_factory=dict)  # {run id: record} before the fault
    # {run id: how often it had been started by then}
    started: Counter[str] = field(default_factory=Counter)
    # {run id: how many kills it was in flight at}
    in_flight: Counter[str] = field(default_factory=Counter)
    damaged: set[str] = field(default_factory=set)  # records that the fault has spoiled
    # {another version of YADE: the undisturbed plan's}
    versions: dict[str, str] = field(default_factory=dict)
    # {run id: status} of runs that must fail, whatever is done
    forsaken: dict[str, str] = field(default_factory=dict)
    # whether the fault was a kill, after which only runs in flight may be done again
    killed: bool = False
    ends: list[Ended] = field(default_factory=list)
    unexpected: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.path.mkdir(parents=True, exist_ok=True)
        self.case = self.whole.case
        self.search_path = install(self.path, self.whole.real)
        self.results.mkdir(parents=True)
        self.behave()

    @property
    def results(self) -> Path:
        """The folder of the case's results."""
        return self.path / "results" / "toy"

    def record(self, run_id: str) -> Path:
        """The record file of a run."""
        return self.results / "records" / f"{run_id}.json"

    def behave(self, **how: Any) -> None:
        """What the fake YADE does; see tests/fake_yade.py."""
        (self.results / "misbehave.json").write_text(json.dumps({"duration": DURATION, **how}))

    def expect(self, holds: bool, what: str) -> None:
        """Note what should have happened and did not."""
        if not holds:
            self.unexpected.append(what)

    def move_clock(self, jump: float) -> None:
        """Let the clock of drivers and of the real YADE jump by so many seconds, a second from now.

        The machine's stays.
        """
        (self.path / "clock").mkdir()  # Python runs a sitecustomize.py that it finds on its path
        (self.path / "clock" / "sitecustomize.py").write_text(
            CLOCK.format(start=time.time() + 1, jump=jump)
        )
        self.behave(clock=jump)

    # Drivers

    def start(self) -> Driver:
        """`calibrator run`, as a user calls it."""
        errors = self.path / f"driver-{len(list(self.path.glob('*.err')))}.err"
        errors.touch()
        arguments = ["run", str(self.case), "--results", str(self.path / "results")]
        process = FORK.Process(
            target=_drive,
            args=(arguments, self.search_path, errors, self.whole.real, self.path / "clock"),
        )
        process.start()
        return Driver(process, errors)

    def end(self, driver: Driver) -> Ended:
        """Wait for a driver, keep what it said for the judge."""
        self.ends.append(driver.wait())
        return self.ends[-1]

    def run(self) -> Ended:
        """Call the driver and wait for it."""
        return self.end(self.start())

    def refused(self, ended: Ended) -> None:
        """Expect an error of one line with a remedy."""
        self.expect(
            ended.refused, f"no error of one line: status {ended.status}, {ended.said[-200:]!r}"
        )

    def same_again(self) -> None:
        """Expect that one more call finds everything done."""
        before = self.calls()
        self.expect(
            self.run().status == 0 and self.calls() == before, "a finished plan was run again"
        )

    # What is there

    def calls(self) -> list[str]:
        """Ids of the runs that were started, in order."""
        path = self.results / "calls.txt"
        return path.read_text().split() if path.exists() else []

    def believed(self) -> dict[str, bytes]:
        """{run id: bytes} of the plan's records that can be believed."""
        found = {}
        for run_id, request in self.whole.requests.items():
            with contextlib.suppress(FileNotFoundError, InvalidRecord):
                read_record(self.record(run_id), request)
                found[run_id] = self.record(run_id).read_bytes()
        return found

    def database(self) -> str:
        """The database that `calibrator collect` makes of the records."""
        case = read_case(self.case)
        collect(workspace.Workspace(case, self.results))
        return (self.results / "database.csv").read_text()

    # Moments

    def moment(self, driver: Driver) -> None:
        """Wait for a random moment of the plan: so many runs finished, and a little more."""
        wanted = self.rng.randrange(len(self.whole.requests))
        self.wait_for(
            lambda: not driver.running or len(list(self.results.glob("records/*.json"))) >= wanted
        )
        time.sleep(self.rng.uniform(0, 3 * DURATION) * (10 if self.whole.real else 1))
        if not driver.running:
            raise NotInjected

    def wait_for(self, condition: Callable[[], bool]) -> None:
        """Wait until the condition holds; TimeoutError if it never does."""
        end = time.monotonic() + PATIENCE
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError("waited in vain")
            time.sleep(0.01)

    def processes(self) -> list[int]:
        """Processes that work in the results folder: yade-batch and all below it, also without
        their driver.
        """
        found = []
        for link in Path("/proc").glob("[0-9]*/cwd"):
            with contextlib.suppress(OSError):
                if os.readlink(link) == str(self.results):
                    found.append(int(link.parent.name))
        return found

    def clear(self) -> None:
        """End what is left of a fault that hangs: the processes in its own results folder, by their
        ids.
        """
        for pid in self.processes():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def take_stock(self) -> None:
        """Note what is finished; called right before a fault strikes.

        What an earlier fault has lost stays noted.
        """
        self.finished = {**self.believed(), **self.finished}
        self.started = Counter(self.calls())

    def kill(self, driver: Driver, who: str) -> None:
        """Kill -9 the driver, or one of its descendants by its role.

        NotInjected where there is none.
        """
        victims: list[int] = []

        def found() -> bool:
            victims[:] = [p for p in descendants(driver.process.pid) if role(p) == who]
            return bool(victims) or not driver.running

        if who != "driver":
            self.wait_for(found)
        if not driver.running:
            raise NotInjected
        self.take_stock()
        if who == "driver":
            driver.kill()
        else:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.rng.choice(victims), signal.SIGKILL)
        self.killed = True  # yade-batch makes a run's log before anything else of it
        self.in_flight.update(
            {path.stem for path in self.results.glob("logs/*.log")} - set(self.finished)
        )

    def orphans_end(self) -> None:
        """Wait until the runs of a driver that is gone have ended."""
        self.wait_for(lambda: not self.processes())

    # Places

    def finish(self, how_many: int | None = None) -> None:
        """Put finished runs of the undisturbed plan into the results: all, or so many at random."""
        run_ids = sorted(self.whole.requests)
        chosen = run_ids if how_many is None else self.rng.sample(run_ids, how_many)
        shutil.copytree(
            self.whole.results / "toy" / "records", self.results / "records", dirs_exist_ok=True
        )
        for run_id in set(run_ids) - set(chosen):
            for path in self.results.glob(f"records/{run_id}.*"):
                path.unlink()
        self.take_stock()

    @contextlib.contextmanager
    def file_system(self) -> Iterator[Path]:
        """A file system of 8 MB of its own under the results; what it holds at the end is kept."""
        kept = self.path / "kept"
        mount("-t", "tmpfs", "-o", "size=8m,nr_inodes=300", "tmpfs", str(self.results))
        try:
            self.behave()
            yield self.results
            shutil.copytree(self.results, kept, symlinks=True)
        finally:
            self.orphans_end()
            subprocess.run(["umount", str(self.results)], check=True)
        shutil.copytree(kept, self.results, symlinks=True, dirs_exist_ok=True)

    @contextlib.contextmanager
    def read_only(self, folder: Path) -> Iterator[None]:
        """A folder in which nobody can write, root neither."""
        mount("--bind", str(folder), str(folder))
        try:
            mount("-o", "remount,bind,ro", str(folder))
            yield
        finally:
            subprocess.run(["umount", str(folder)], check=True)


def mount(*arguments: str) -> None:
    """Mount something; it is seen by this process and its children only, see `in_private`."""
    subprocess.run(["mount", *arguments], check=True)


def in_private(module: str, arguments: list[str]) -> None:
    """Start a module again where mounts are its own business; returns only where that has been
    done, or cannot be.

    Sets FAULTS_PRIVATE to "yes" or "no".
    """
    if "FAULTS_PRIVATE" in os.environ:
        return
    os.environ["FAULTS_PRIVATE"] = "no"
    for namespace in (["unshare", "--map-root-user", "--mount"], ["unshare", "--mount"]):
        if (
            shutil.which("unshare")
            and subprocess.run([*namespace, "true"], capture_output=True).returncode == 0
        ):
            os.environ["FAULTS_PRIVATE"] = "yes"
            os.execvp("unshare", [*namespace, sys.executable, "-m", module, *arguments])


# The judge


@dataclass(frozen=True)
class Verdict:
    """What a fault did: the counts that must be 0, and in words what was not as expected."""

    lost_finished_runs: int
    undetected_corruptions: int
    wrong_answers: int
    tracebacks: int
    repeated_without_need: int
    happened: str


def judge(stage: Stage) -> Verdict:
    """Call the driver once more, as a user would after a fault, and compare with the undisturbed
    plan.
    """
    last = stage.run()
    stage.expect(
        last.status == 0, f"the next call ended with status {last.status}: {last.said[-200:]!r}"
    )
    said = "".join(e.said for e in stage.ends)
    kept = {run_id: data for run_id, data in stage.finished.items() if run_id not in stage.damaged}
    lost = [
        i
        for i, data in kept.items()
        if not stage.record(i).exists() or stage.record(i).read_bytes() != data
    ]
    unnoticed = [i for i in stage.damaged if f"record {i}" not in said or i not in stage.believed()]
    return Verdict(
        lost_finished_runs=len(lost),
        undetected_corruptions=len(unnoticed),
        wrong_answers=int(not same_answer(stage)),
        tracebacks=said.count("Traceback"),
        repeated_without_need=len(_repeated(stage)),
        happened="; ".join(stage.unexpected) or "as expected",
    )


def _repeated(stage: Stage) -> list[str]:
    """Runs that were started again although they had finished, or after a kill although they were
    not in flight.
    """
    calls = Counter(stage.calls())
    again = [i for i in stage.finished if i not in stage.damaged and calls[i] > stage.started[i]]
    if stage.killed:
        again += [
            i
            for i in stage.whole.requests
            if i not in stage.finished and calls[i] > 1 + stage.in_flight[i]
        ]
    return again


def same_answer(stage: Stage) -> bool:
    """Whether the database is the undisturbed one to the byte, apart from the runs that were to
    fail, which must say so.
    """
    database = stage.database()
    for other, version in stage.versions.items():
        database = database.replace(f",{other},", f",{version},")
    own, whole = _rows(database), _rows(stage.whole.database)
    for run_id, status in stage.forsaken.items():
        if whole.pop(run_id, None) is not None or run_id in own:
            if run_id not in own or own.pop(run_id).split(",")[2] != status:
                return False
    return own == whole


def _rows(database: str) -> dict[str, str]:
    """{run id: line} of a database, and its header under ""."""
    lines = [line for line in database.splitlines() if not line.startswith("#")]
    return {"": lines[0], **{line.split(",")[0]: line for line in lines[1:]}}


def with_substitutes(requests: list[Request]) -> list[Request]:
    """These requests and the ones that take their place where they clog."""
    return [
        *requests,
        *(r.with_seed(int(r.parameters["seed"]) + SUBSTITUTE_SEED) for r in requests),
    ]
