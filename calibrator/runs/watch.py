"""Which runs of a batch have ended, how, and how long the others will take."""

from __future__ import annotations

import time
from collections.abc import Sequence, Set

from calibrator.runs.batch import Batch, Progress
from calibrator.runs.failures import has_ended, verdict_on
from calibrator.runs.folder import RETRIED, RunFolder
from calibrator.runs.futile import End
from calibrator.runs.record import Record
from calibrator.runs.request import Request


class Watch:
    """A batch of the runs that a call is to make.

    Parameters
    ----------
    cores : how many runs are made at a time; None where that is up to a queue.
    call : run ids that the call began with, those of the batch among them.
    records : of all runs of the plan that have ended before; attempts : at a run that fails.
    """

    def __init__(
        self,
        folder: RunFolder,
        batch: Batch,
        cores: int | None,
        call: Set[str],
        records: Sequence[Record],
        attempts: int,
    ) -> None:
        self.call = call
        self.folder, self.batch, self.cores, self.attempts = folder, batch, cores, attempts
        self.before = {r.run_id: End(r.status, r.error) for r in records}
        self.now: dict[str, End] = {}
        self.ended: list[Request] = []
        self.start()

    def start(self) -> None:
        """Let the clock begin: the batch has been submitted."""
        self.begin = time.monotonic()

    def ends(self) -> list[End]:
        """How the plan's runs have ended so far, each by its last attempt."""
        return list({**self.before, **self.now}.values())

    def look(self) -> Progress:
        """The call as its records and logs show it now."""
        for request in self.batch.requests:
            if request.run_id in self.now or not has_ended(self.folder, request):
                continue
            if (verdict := verdict_on(self.folder, request)) is not None:
                self.now[request.run_id] = End(*verdict)
                self.ended.append(request)
        elapsed, pending = time.monotonic() - self.begin, {r.run_id for r in self.batch.requests}
        final = [self.before[i] for i in self.call - pending if i in self.before]
        open_ends, retried = pending - self.now.keys(), 0
        for run_id, end in self.now.items():
            again = end.status in RETRIED and self.batch.failed[run_id] + 1 < self.attempts
            retried += again
            final += [] if again else [end]
        retried += sum(self.batch.failed[i] > 0 for i in open_ends)
        failed = sum(e.status != "ok" for e in final)
        left = self._left(elapsed)
        return Progress(len(final), failed, len(self.call), elapsed, left, retried)

    def _left(self, elapsed: float) -> float:
        """Seconds until the batch has ended, by the pace of what has, and of what has not yet.

        The runs in flight are taken to be half done, unless they began just now; none of their
        predicted times is trusted once it has passed.
        """
        cost, cores = self.batch.cost, self.cores or 1
        waiting = [cost[r.run_id] for r in self.batch.requests if r.run_id not in self.now]
        if not waiting:
            return 0.0
        done, flying = sum(cost.values()) - sum(waiting), sum(waiting[:cores])
        if self.cores is None:  # how long jobs queue is not known: the rate is all there is
            return elapsed * sum(waiting) / max(done, flying)
        under_way = 0.5 * flying if done else min(0.5 * flying, elapsed * cores)
        measured = elapsed / max(done + under_way, 1e-9)
        if not done:
            measured = max(1 / cores, 1.25 * elapsed / flying)
        trust = len(self.now) / (len(self.now) + cores)
        pace = max(trust * measured + (1 - trust) / cores, 1.25 * elapsed / (done + flying))
        return pace * (sum(waiting) - under_way)
