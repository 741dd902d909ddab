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
        # what earlier attempts left, where they have not been submitted again, says nothing new
        tried = [r for r in batch.requests if batch.failed[r.run_id] > 0]
        self.stale = {r.run_id: self._left_by(r) for r in tried}
        self.start()

    def start(self) -> None:
        """Let the clock begin: the batch has been submitted."""
        self.begin, self.seen = time.monotonic(), 0.0
        self.began: dict[str, float] = {}
        self.took: dict[str, float] = {}

    def ends(self) -> list[End]:
        """How the plan's runs have ended so far, each by its last attempt."""
        return list({**self.before, **self.now}.values())

    def look(self) -> Progress:
        """The call as its records and logs show it now."""
        elapsed = time.monotonic() - self.begin
        for request in self.batch.requests:
            if request.run_id not in self.now:
                self._look_at(request, elapsed)
        self.seen, pending = elapsed, {r.run_id for r in self.batch.requests}
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

    def _look_at(self, request: Request, elapsed: float) -> None:
        """Note whether a run has begun, or ended, since the last look."""
        run_id = request.run_id
        if run_id in self.stale and self._left_by(request) == self.stale[run_id]:
            return
        if has_ended(self.folder, request):
            if (verdict := verdict_on(self.folder, request)) is not None:
                self.now[run_id] = End(*verdict)
                self.took[run_id] = elapsed - self.began.get(run_id, self.seen)
                self.ended.append(request)
        elif run_id not in self.began and self.folder.log(request).exists():
            self.began[run_id] = elapsed

    def _left_by(self, request: Request) -> list[int]:
        """When the files of a run's last attempt were written; 0 where there is none."""
        files = self.folder.record(request), self.folder.log(request)
        return [f.stat().st_mtime_ns if f.exists() else 0 for f in files]

    def _left(self, elapsed: float) -> float:
        """Seconds until the batch has ended, by what its runs have taken over what was predicted.

        A run that has outlived its prediction is taken to need a quarter of its time once more, and
        what it says of the pace holds for those that have not begun.
        """
        cost = self.batch.cost
        left = {r.run_id: cost[r.run_id] for r in self.batch.requests if r.run_id not in self.now}
        if not left:
            return 0.0
        spent, mean = sum(cost.values()) - sum(left.values()), sum(cost.values()) / len(cost)
        if self.cores is None:  # how long jobs queue is not known: the rate is all there is
            return elapsed * max(sum(left.values()), mean / 4) / max(spent, mean)
        ages = {i: elapsed - self.began[i] for i in left if i in self.began}
        pace = (sum(self.took.values()) + mean) / (spent + mean)
        late = [i for i, age in ages.items() if age > pace * cost[i]]
        pace = (pace * (spent + mean) + sum(1.25 * ages[i] for i in late)) / (
            spent + mean + sum(cost[i] for i in late)
        )
        left = {i: pace * seconds for i, seconds in left.items()}
        left |= {i: max(left[i] - age, age / 4) for i, age in ages.items()}
        return max([sum(left.values()) / self.cores, *(left[i] for i in ages)])
