"""What a fault has done: the judge, who compares with the undisturbed plan."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from tests.campaigns.faults.stage import Stage

COUNTS = (
    "lost_finished_runs",
    "undetected_corruptions",
    "wrong_answers",
    "tracebacks",
    "repeated_without_need",
)


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
    """Call the driver once more, as a user would, and compare with the undisturbed plan."""
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
    """Runs started again although finished, or after a kill although not in flight."""
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
    """Whether the database is the undisturbed one to the byte; runs that were to fail say so."""
    database = stage.database()
    for other, version in stage.versions.items():
        database = database.replace(f",{other},", f",{version},")
    own, whole = _rows(database), _rows(stage.whole.database)
    for run_id, status in stage.forsaken.items():
        asked_for = whole.pop(run_id, None) is not None or run_id in own
        if asked_for and (run_id not in own or own.pop(run_id).split(",")[2] != status):
            return False
    return own == whole


def _rows(database: str) -> dict[str, str]:
    """{run id: line} of a database, and its header under ""."""
    lines = [line for line in database.splitlines() if not line.startswith("#")]
    return {"": lines[0], **{line.split(",")[0]: line for line in lines[1:]}}
