"""What others do meanwhile: a second driver, and files that somebody edits or cuts."""

from __future__ import annotations

import random
import shutil
import time

from tests.campaigns.faults.kind import REFUSED, RETRIED, SAME, Kind, registry
from tests.campaigns.faults.stage import NotInjected, Stage

KINDS: list[Kind] = []
fault = registry(KINDS)


@fault(
    SAME,
    fake=12,
    real=1,
    name="two drivers on one case, the second at a random moment, the first one killed every other"
    " time",
)
def two_drivers(stage: Stage) -> None:
    """Two drivers in one folder."""
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


@fault(
    RETRIED,
    fake=15,
    real=1,
    name="table of the batch edited in mid-run: a value, rows or run ids swapped, a row doubled,"
    " emptied",
)
def table_edited(stage: Stage) -> None:
    """The table of a batch that is under way is another one."""
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
