"""The driver, yade-batch, YADE or the wrapper around it dies."""

from __future__ import annotations

import time

from tests.campaigns.faults.kind import REFUSED, RETRIED, SAME, Kind, registry
from tests.campaigns.faults.stage import Stage

KINDS: list[Kind] = []
fault = registry(KINDS)


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
