"""What an engine is, and how runs are carried out by any of them."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path

from calibrator.case.settings import PARTICLE_STEPS_PER_SECOND
from calibrator.errors import CalibratorError
from calibrator.runs.batch import Batch, Progress, note_ended, pending_requests
from calibrator.runs.cost import core_seconds
from calibrator.runs.failures import failed_attempts
from calibrator.runs.folder import RunFolder, gather
from calibrator.runs.futile import refuse_futile
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.watch import Watch


class Engine(ABC):
    """Where runs are made.

    `run` asks for four things only, and believes nothing but records: an engine may die, or be
    killed, at any time.
    """

    cores: int | None = None
    """Runs that are made at a time; None where that is up to a queue."""

    rate: float = PARTICLE_STEPS_PER_SECOND
    """Particle-steps a second and core that are counted on until runs have said it."""

    early_ends: int | None = None
    """Batches of a call that may end before all their runs have started; None where a batch is not
    always taken whole. Then a call gives up once nothing at all came of one.
    """

    @property
    @abstractmethod
    def pause(self) -> float:
        """Seconds between two polls."""

    @property
    @abstractmethod
    def advice(self) -> str:
        """Why runs that were submitted may not even have started, and what to do."""

    @abstractmethod
    def require(self) -> None:
        """Raise CalibratorError, with the remedy, where a program is missing."""

    @abstractmethod
    def submit(self, folder: RunFolder, batch: Batch) -> None:
        """Start the runs of a batch, or as many of the first ones as can be taken at a time.

        What their failed attempts left is removed before (`batch.clear`). Raises CalibratorError
        where they are not taken.
        """

    @abstractmethod
    def poll(self, folder: RunFolder, requests: Sequence[Request]) -> bool:
        """Whether any of these runs is in flight, those of a driver that died included.

        Notes what became of runs that have ended since the last poll (`batch.note_ended`). Raises
        CalibratorError where that cannot be found out, OSError where the disk is full.
        """

    @abstractmethod
    def end(self) -> None:
        """End what must not outlive the driver, whichever way that ends."""

    @abstractmethod
    def give_up(self, folder: RunFolder, requests: Sequence[Request]) -> None:
        """Start no further one of these runs; `end` follows."""


def run(
    engine: Engine,
    folder: RunFolder,
    requests: Sequence[Request],
    attempts: int = 2,
    report: Callable[[Progress], None] = lambda progress: None,
    go_on: bool = False,
) -> list[Record]:
    """Carry out the requests that have no good record yet, longest first.

    A run that failed is tried again, up to so many attempts, where another one may end otherwise.
    Whatever is interrupted, calling again goes on from the records that exist. Two drivers at once
    would make the same runs: the caller holds `RunFolder.alone`. Where the first runs all fail
    alike no further one is started, now or by another call, unless it is to go on.

    Returns
    -------
    A record for each request, in their order; a run without a valid one has its failure's.

    Raises
    ------
    CalibratorError where a program is missing, submitted runs do not even start, or the first ones
    all failed alike; OSError where the disk is full or read-only.
    """
    folder.prepare()
    total = None if go_on else len(requests)
    try:
        pending = _made(engine, folder, requests, attempts, report, total)
    finally:
        engine.end()
    records = gather(folder, requests)
    if pending or len(records) < len(requests):
        left = max(len(pending), len(requests) - len(records))
        raise CalibratorError(f"{left} runs are still to be done: {engine.advice}")
    return records


def _made(
    engine: Engine,
    folder: RunFolder,
    requests: Sequence[Request],
    attempts: int,
    report: Callable[[Progress], None],
    total: int | None,
) -> list[Request]:
    """Make the runs, batch after batch; returns those that could not even be started.

    total : see `refuse_futile`.
    """
    call = pending = pending_requests(folder, requests, attempts)
    ended_early = 0
    if pending:  # a call that has nothing to do needs no programs
        engine.require()
    if pending and engine.poll(folder, requests):
        watch = _watch(engine, folder, requests, (call, pending), attempts)
        _wait(engine, folder, requests, watch, report, total)
        pending = pending_requests(folder, requests, attempts)
    while pending:
        before, known = pending, _traces(folder, pending)
        watch = _watch(engine, folder, requests, (call, pending), attempts)
        refuse_futile(watch.ends(), total)
        folder.check_room()
        engine.submit(folder, watch.batch)
        _wait(engine, folder, requests, watch, report, total)
        pending = pending_requests(folder, requests, attempts)
        traces = _traces(folder, pending)
        idle = sum(known[r.run_id] == traces[r.run_id] for r in pending)
        ended_early += bool(idle)
        fruitless = engine.early_ends is None and idle == len(before)
        if fruitless or ended_early == engine.early_ends:
            break
    return pending


def _traces(folder: RunFolder, pending: Sequence[Request]) -> dict[str, tuple[int, list[Path]]]:
    """Attempts and checkpoints of pending runs: where both stay, a run never began."""
    failures = folder.failures()
    return {r.run_id: (failed_attempts(failures, r), folder.checkpoints(r)) for r in pending}


def _watch(
    engine: Engine,
    folder: RunFolder,
    requests: Sequence[Request],
    to_make: tuple[Sequence[Request], Sequence[Request]],
    attempts: int,
) -> Watch:
    """The pending ones of all requests, whose finished runs say what they will cost.

    to_make : those that were pending when the call began, and those that are now.
    """
    call, pending = to_make
    failures, records = folder.failures(), gather(folder, requests)
    seconds = core_seconds(pending, records, engine.rate)
    cost = dict(zip((r.run_id for r in pending), seconds, strict=True))
    failed = {r.run_id: failed_attempts(failures, r) for r in pending}
    batch = Batch(sorted(pending, key=lambda r: -cost[r.run_id]), cost, failed)
    ids = {r.run_id for r in call}
    return Watch(folder, batch, engine.cores, ids, records, attempts)


def _wait(
    engine: Engine,
    folder: RunFolder,
    requests: Sequence[Request],
    watch: Watch,
    report: Callable[[Progress], None],
    total: int | None,
) -> None:
    """Wait until none of the requests is in flight; reports the progress of the batch.

    Gives up where the first of `total` runs have failed alike; None: whatever becomes of them.
    """
    watch.start()
    while engine.poll(folder, requests):
        report(watch.look())
        try:
            refuse_futile(watch.ends(), total)
        except CalibratorError:
            engine.give_up(folder, requests)
            note_ended(folder, watch.ended)
            raise
        time.sleep(engine.pause)
    report(watch.look())
