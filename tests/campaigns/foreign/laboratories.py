"""The runs of the laboratories: carried out in order, kept in a table, resumed from it."""

import csv
import fcntl
import hashlib
import io
import shutil
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

import numpy as np

from calibrator.case.case import Case
from calibrator.diagnosis import experiments as ex
from calibrator.files import read_text, write_text
from tests.campaigns.foreign import engine
from tests.campaigns.foreign.truths import DRAWN, MOST, REPLICATES, REPO, Laboratory, opened

TABLE = REPO / "grid" / "foreign_laboratories.csv"
COMMAND = "python -m tests.campaigns.foreign run"
WORK = REPO / "results" / "foreign"
FIRST = ("laboratory", "experiment", "seed", "status", "steps", "core_seconds")
Row = dict[str, str]


def responses(case: Case) -> list[str]:
    """All responses that the case's experiments have, in the order of the lab file."""
    return list(dict.fromkeys(o.response for o in case.observables))


def read() -> list[Row]:
    """The finished runs."""
    if not TABLE.exists():
        return []
    lines = [line for line in read_text(TABLE).splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


def write(case: Case, rows: Iterable[Row]) -> None:
    """The table, and the checksums of the shipped files."""
    text = io.StringIO()
    names = [*FIRST, *responses(case), "reason"]
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    head = f"# {COMMAND}; {engine.version()}; responses in the units of yade_scripts/contract.json"
    write_text(TABLE, head + "\n" + text.getvalue())
    files = sorted(TABLE.parent.glob("*.csv"))
    sums = [f"{hashlib.sha256(f.read_bytes()).hexdigest()}  {f.name}\n" for f in files]
    write_text(TABLE.with_name("SHA256SUMS"), "".join(sums))


def of(rows: Iterable[Row], number: int, experiment: str) -> list[Row]:
    """The finished runs of an experiment of a laboratory."""
    return [r for r in rows if r["laboratory"] == str(number) and r["experiment"] == experiment]


def values_of(rows: Iterable[Row], number: int, experiment: ex.Experiment) -> np.ndarray:
    """Responses (runs, n) of the runs that ended well and have all of them, by seed."""
    own = sorted(of(rows, number, experiment.name), key=lambda r: int(r["seed"]))
    good = [
        [float(r[name]) for name in experiment.responses]
        for r in own
        if r["status"] == "ok" and all(r[name] for name in experiment.responses)
    ]
    return np.array(good, float).reshape(-1, len(experiment.responses))


def is_complete(rows: Iterable[Row], number: int, found: Iterable[ex.Experiment]) -> bool:
    """Whether nothing of a laboratory is left to do."""
    rows = list(rows)
    return all(wanted(rows, number, e) <= len(of(rows, number, e.name)) for e in found)


def wanted(rows: list[Row], number: int, experiment: ex.Experiment) -> int:
    """Runs of an experiment: eight, and spare ones as long as fewer than five ended well."""
    good = len(values_of(rows, number, experiment))
    done = len(of(rows, number, experiment.name))
    return min(max(REPLICATES, done + max(DRAWN - good, 0) if done >= REPLICATES else 0), MOST)


def one_run(laboratory: Laboratory, experiment: ex.Experiment, request, folder: Path) -> Row:
    """One run as a row of the table."""
    found = engine.run(request, laboratory.rolling_viscosity, folder)
    shutil.rmtree(folder, ignore_errors=True)
    row = {
        "laboratory": str(laboratory.number),
        "experiment": experiment.name,
        "seed": str(request.parameters["seed"]),
        "status": found.status,
        "steps": str(found.steps),
        "core_seconds": f"{found.core_seconds:.1f}",
        "reason": found.reason,
    }
    kept = [n for n in experiment.responses if n in found.responses]
    return {**row, **{n: f"{found.responses[n]:.6g}" for n in kept}}


def carry_out(case: Case, at_a_time: int) -> None:
    """All runs that are not there yet, laboratory by laboratory, so many at a time."""
    WORK.mkdir(parents=True, exist_ok=True)
    lock = open(WORK / "lock", "w")  # noqa: SIM115 - held until the end
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise SystemExit("another call carries the runs out") from None
    found, rows = ex.experiments(case, case.observables), read()
    with ThreadPoolExecutor(at_a_time) as pool:
        for number, (laboratory, _) in sorted(opened().items()):
            while todo := missing(case, rows, laboratory, found):
                futures = [
                    pool.submit(one_run, laboratory, e, r, WORK / str(r.parameters["seed"]))
                    for e, r in todo
                ]
                for future in as_completed(futures):
                    rows.append(future.result())
                    order = {e.name: i for i, e in enumerate(found)}
                    rows.sort(
                        key=lambda r: (int(r["laboratory"]), order[r["experiment"]], int(r["seed"]))
                    )
                    write(case, rows)
                    print(*list(future.result().values())[:6], flush=True)
            print(f"laboratory {number} is complete", flush=True)


def missing(case: Case, rows: list[Row], laboratory: Laboratory, found: list[ex.Experiment]):
    """Experiments and requests that are still to be carried out, as far as can be said now."""
    todo = []
    for e, own in zip(found, laboratory.requests(case, found), strict=True):
        there = {r["seed"] for r in of(rows, laboratory.number, e.name)}
        asked = own[: wanted(rows, laboratory.number, e)]
        todo += [(e, r) for r in asked if str(r.parameters["seed"]) not in there]
    return todo
