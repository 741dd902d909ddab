"""Faults on purpose: whatever dies, nothing finished is lost and the answer is the same.

    python -m tests.campaigns.faults                writes benchmarks/results/faults.json
    python -m tests.campaigns.faults --quick        each kind once, on the fake YADE only
    python -m tests.campaigns.faults --only WORDS   kinds with these words in their name

The first takes 10 to 20 minutes, the others print only. Nothing runs twice without need, either.

A fault befalls a results folder of its own. Then `calibrator run` is called again, as a user would,
and the outcome is compared with that of the undisturbed plan. `lost_finished_runs` counts records
that had been good before the fault and are not the same to the byte, `undetected_corruptions`
spoiled records that were not reported and made anew, `wrong_answers` databases that are not the
undisturbed one to the byte, `tracebacks` those on stderr, `repeated_without_need` runs that were
started again although finished, or after a kill although not in flight, and `unexpected` faults
that ended in another way than expected.

Most faults strike the fake YADE of tests/fake_yade.py, some the real one with hourglasses of 270
grains. kinds.py has every kind of fault, stage.py is what they strike.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.common import write
from tests.campaigns.faults.judge import COUNTS, judge
from tests.campaigns.faults.kind import Kind
from tests.campaigns.faults.kinds import KINDS
from tests.campaigns.faults.private import in_private
from tests.campaigns.faults.stage import NotInjected, Stage, Undisturbed, undisturbed

PLANS = {False: (4, 2), True: (2, 2)}  # sets and replicates of the fake and of the real YADE's plan
WORKERS = 3  # faults at a time: most of a fault is waiting


def strike(kind: Kind, whole: Undisturbed, number: int, folder: Path) -> dict[str, Any]:
    """Inject one fault: what was expected, and what happened.

    Where there is nothing to strike any more, it is injected at another moment.
    """
    for attempt in range(20):
        stage = Stage(
            folder / f"attempt-{attempt}",
            whole,
            random.Random(f"{kind.name} {number} {attempt} {whole.real}"),
        )
        try:
            kind.act(stage)
            verdict = asdict(judge(stage))
            stage.orphans_end()
            break
        except NotInjected:
            stage.orphans_end()
        except TimeoutError as error:
            verdict = {**dict.fromkeys(COUNTS, 0), "happened": f"it hangs: {error}"}
            stage.clear()
            break
    else:
        raise RuntimeError(f"{kind.name}: there was never anything to strike")
    yade = "real" if whole.real else "fake"
    return {"kind": kind.name, "yade": yade, "number": number, "expected": kind.expected, **verdict}


def campaign(quick: bool, only: str = "") -> dict[str, Any]:
    """Every fault of every kind with these words in its name; quickly, each kind once and fake."""
    work = Path(tempfile.mkdtemp(prefix="faults-")).resolve()
    asked = [k for k in KINDS if only in k.name]
    able = [k for k in asked if os.environ.get("FAULTS_PRIVATE") == "yes" or not k.needs_mounts]
    found: list[dict[str, Any]] = []
    try:
        for real in [False] if quick else [False, True]:
            jobs = [(k, i) for k in able for i in range(k.real if real else 1 if quick else k.fake)]
            whole = undisturbed(work / f"undisturbed-{real}", real, *PLANS[real])
            with ProcessPoolExecutor(WORKERS) as pool:
                tasks = [
                    pool.submit(strike, k, whole, i, work / f"{real}-{KINDS.index(k)}-{i}")
                    for k, i in jobs
                ]
                for task in tasks:
                    found.append(task.result())
                    print(
                        *(found[-1][key] for key in ("yade", "kind", "number", "happened")),
                        sep=" | ",
                        flush=True,
                    )
    finally:
        shutil.rmtree(work)
    return {
        **counted(found),
        "not_possible_here": [k.name for k in asked if k not in able],
        "faults": found,
    }


def counted(found: list[dict[str, Any]]) -> dict[str, Any]:
    """The sums over all faults."""
    sums = {key: sum(f[key] for f in found) for key in COUNTS}
    unexpected = sum(f["happened"] != "as expected" for f in found)
    return {
        "injected": len(found),
        "on_real_yade": sum(f["yade"] == "real" for f in found),
        **sums,
        "unexpected": unexpected,
    }


def main() -> None:
    """Carry out the campaign, print its counts, and write them where it was the whole one."""
    in_private("tests.campaigns.faults", sys.argv[1:])
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument(
        "--quick", action="store_true", help="each kind once, on the fake YADE only"
    )
    parser.add_argument(
        "--only", default="", metavar="WORDS", help="kinds with these words in their name"
    )
    parser.add_argument(
        "--to",
        type=Path,
        metavar="FILE",
        help="where results go that are not those of the whole campaign",
    )
    options = parser.parse_args()
    found = campaign(options.quick, options.only)
    print(json.dumps({k: v for k, v in found.items() if k != "faults"}, indent=1))
    if options.to:
        options.to.write_text(json.dumps(found, indent=1) + "\n")
    elif not options.quick and not options.only:
        write("faults", found)
