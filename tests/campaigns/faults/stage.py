"""The stage that faults strike: a small case and its results, drivers, a file system of its own."""

from __future__ import annotations

import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from calibrator.case.toml import read_case
from calibrator.plan.requests import plan_requests
from calibrator.plan.run import collect
from calibrator.runs import workspace
from calibrator.runs.record import InvalidRecord, read_record
from calibrator.runs.request import Request
from tests.campaigns.faults.driver import (
    CLOCK,
    FORK,
    PATIENCE,
    Driver,
    Ended,
    descendants,
    drive,
    install,
    role,
)
from tests.campaigns.faults.private import mount

DURATION = 0.1  # seconds that a run of the fake YADE lasts

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


# The stage


@dataclass(frozen=True)
class Undisturbed:
    """The plan carried out without a fault: the case, its results, and their database."""

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
            target=drive,
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
        """Processes in the results folder: yade-batch and all below it, with or without driver."""
        found = []
        for link in Path("/proc").glob("[0-9]*/cwd"):
            with contextlib.suppress(OSError):
                if os.readlink(link) == str(self.results):
                    found.append(int(link.parent.name))
        return found

    def clear(self) -> None:
        """End what a fault that hangs has left: the processes in its results, by their ids."""
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


# The judge
