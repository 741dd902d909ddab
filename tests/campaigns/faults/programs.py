"""YADE missing, broken or of another version, and runs that cannot succeed."""

from __future__ import annotations

import shutil
import time

from calibrator.plan.seeds import SUBSTITUTE_SEED
from calibrator.runs.request import Request
from tests.campaigns.faults.kind import KEPT, REFUSED, Kind, registry
from tests.campaigns.faults.stage import Stage

KINDS: list[Kind] = []
fault = registry(KINDS)


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


def with_substitutes(requests: list[Request]) -> list[Request]:
    """These requests and the ones that take their place where they clog."""
    return [
        *requests,
        *(r.with_seed(int(r.parameters["seed"]) + SUBSTITUTE_SEED) for r in requests),
    ]
