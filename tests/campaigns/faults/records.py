"""Records that are spoiled, and runs that crash, lie or write half a record."""

from __future__ import annotations

import contextlib
import json
import random
import re
from collections.abc import Callable
from functools import partial

from tests.campaigns.faults.kind import REPAIRED, RETRIED, Kind, registry
from tests.campaigns.faults.stage import Stage

KINDS: list[Kind] = []
fault = registry(KINDS)


def _half(text: str, rng: random.Random) -> str:
    return text[: len(text) // 2]


def _truncated(text: str, rng: random.Random) -> str:
    return text[: rng.randrange(1, len(text) - 2)]


def _emptied(text: str, rng: random.Random) -> str:
    return ""


def _lying(text: str, rng: random.Random) -> str:
    record = json.loads(text)
    name = rng.choice([n for n, v in record["parameters"].items() if isinstance(v, float)])
    record["parameters"][name] = record["parameters"][name] * (1 + 1e-12) + 1e-15
    return json.dumps(record)


def _of_another_run(text: str, rng: random.Random) -> str:
    return re.sub('"run_id": "[0-9a-f]+"', f'"run_id": "{rng.randbytes(8).hex()}"', text)


def _of_another_version(text: str, rng: random.Random) -> str:
    return json.dumps({**json.loads(text), "schema": rng.choice([0, 2, 99, "1", None, 1.5])})


def _with_nan(text: str, rng: random.Random) -> str:
    name, value = rng.choice(re.findall(r'"(\w+)": (-?[0-9.e-]+)', text))
    return text.replace(
        f'"{name}": {value}', f'"{name}": {rng.choice(["NaN", "Infinity", "-Infinity"])}'
    )


def _with_a_wrong_type(text: str, rng: random.Random) -> str:
    record = json.loads(text)
    key = rng.choice(
        ["setup", "run_id", "parameters", "status", "responses", "diagnostics", "provenance"]
    )
    return json.dumps({**record, key: rng.choice([[], 7, True, None])})


def _without_a_key(text: str, rng: random.Random) -> str:
    record = json.loads(text)
    # records from before there were seals are believed
    del record[rng.choice(sorted(record.keys() - {"seal"}))]
    return json.dumps(record)


def _with_another_number(text: str, rng: random.Random) -> str:
    """A number that could be true, in place of the one that was measured."""
    record = json.loads(text)
    name = rng.choice(sorted(record["responses"]))
    return json.dumps(
        {**record, "responses": {**record["responses"], name: record["responses"][name] * 1.01}}
    )


def _with_a_flipped_bit(text: str, rng: random.Random) -> str:
    """One bit of the file, such that it does not happen to say the same."""
    while True:
        place = rng.randrange(len(text))
        flipped = text[:place] + chr(ord(text[place]) ^ 1 << rng.randrange(7)) + text[place + 1 :]
        with contextlib.suppress(ValueError):
            if json.loads(flipped) == json.loads(text):
                continue
        return flipped


SPOILED = {
    "half written": _half,
    "truncated": _truncated,
    "emptied": _emptied,
    "with a lying echo": _lying,
    "that answers another run": _of_another_run,
    "of an unknown version": _of_another_version,
    "with NaN or infinity": _with_nan,
    "with a wrong type": _with_a_wrong_type,
    "without a key": _without_a_key,
    "with another number": _with_another_number,
    "with a flipped bit": _with_a_flipped_bit,
}


def _spoil(stage: Stage, run_id: str, change: Callable[[str, random.Random], str]) -> None:
    stage.damaged.add(run_id)
    stage.record(run_id).write_text(change(stage.record(run_id).read_text(), stage.rng))


def _spoiled_between_calls(change: Callable[[str, random.Random], str], stage: Stage) -> None:
    stage.finish()
    _spoil(stage, stage.rng.choice(sorted(stage.finished)), change)


KINDS += [
    Kind(
        f"record {name}",
        partial(_spoiled_between_calls, change),
        REPAIRED,
        fake=6,
        real=int(name in ("half written", "emptied")),
    )
    for name, change in SPOILED.items()
]


@fault(REPAIRED, fake=8)
def spoiled_in_mid_run(stage: Stage) -> None:
    """spoiled in mid-run: record of a finished run, while others are under way"""
    driver = stage.start()
    stage.wait_for(lambda: bool(stage.believed()) or not driver.running)
    stage.moment(driver)
    stage.take_stock()
    _spoil(
        stage, stage.rng.choice(sorted(stage.finished)), stage.rng.choice(list(SPOILED.values()))
    )
    stage.end(driver)


@fault(RETRIED, fake=12)
def yade_misbehaves_once(stage: Stage) -> None:
    """YADE crashes, lies, writes half a record or none, once in each of two runs"""
    both = stage.rng.sample(sorted(stage.whole.requests), 2)
    seeds = {
        str(stage.whole.requests[i].parameters["seed"]): stage.rng.choice(
            ["crash", "lie", "half", "nothing"]
        )
        for i in both
    }
    stage.behave(once=True, **seeds)
    stage.expect(
        stage.run().status == 0 and len(stage.believed()) == len(stage.whole.requests),
        "it was not tried again",
    )
