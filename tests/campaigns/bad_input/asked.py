"""What is asked for: requests by name and value, and command lines."""

from __future__ import annotations

import contextlib
import io
import os
import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from hypothesis import strategies as st

from calibrator import check
from calibrator.case.vocabulary import PARAMETERS, SETUPS
from calibrator.cli import main
from calibrator.runs.request import Request, cell
from tests.campaigns.bad_input.damage import TOML_VALUES, VALUES, damaged_bytes
from tests.campaigns.bad_input.rules import (
    Kind,
    ask,
    lines_of_a_refusal,
    only_data,
    registry,
    require,
    texts,
)
from tests.campaigns.bad_input.yard import CASE, Yard

KINDS: dict[str, Kind] = {}
kind = registry(KINDS)
HEALTHY = SimpleNamespace(warnings=list)  # a machine that lacks nothing


def _settings(yard: Yard) -> st.SearchStrategy[Any]:
    return st.tuples(
        st.sampled_from(SETUPS),
        st.dictionaries(st.sampled_from([*PARAMETERS, "x", "setup"]), VALUES, max_size=4),
    )


@kind(0.12, _settings)
def request(yard: Yard, given: tuple[str, dict[str, Any]]) -> None:
    """A request is a number or a known word for each parameter, in its range, or is refused."""
    setup, values = given
    made = ask(lambda: Request.of(setup, **values))
    if made is not None:
        for name, value in values.items():
            # an effect that is off is left out
            require(made.value(name) == value, f"{name} became another value")
        require(all(only_data(cell(n, v)) for n, v in made.parameters.items()), "code in a cell")
    for name, value in values.items():
        text = ask(lambda name=name, value=value: cell(name, value)) if name in PARAMETERS else None
        require(text is None or only_data(text), f"code in a cell: {text!r}")


def _arguments(yard: Yard) -> st.SearchStrategy[Any]:
    words = [w for w in [*texts(yard), *TOML_VALUES] if len(w) < 1000]
    verbs = [
        "check",
        "plan",
        "plan",
        "run",
        "collect",
        "verify",
        "validate",
        "report",
        "preflight",
        "diagnose",
        "calibrat",
    ]
    names = ("input.toml", "input.toml", "toy.toml", "pipe", "loop", "zero", "folder", "lab.csv")
    cases = [*(str(yard.cases / n) for n in names), *words]
    results = [
        str(yard.path / n)
        for n in ("out", "out", "secret.csv", "a b;c'd\"e", "new\nline", "caf\udce9")
    ]
    known = [
        "--fresh",
        "--verify-afresh",
        "--help",
        "--version",
        "--results",
        "-x",
        "--",
        "--yes",
        "--lab",
        "--engine",
        "--site",
    ]
    options = st.sampled_from([*known, *words])
    arguments = st.tuples(
        st.sampled_from([*verbs, *words]),
        st.sampled_from(cases),
        st.sampled_from([*results, *(w for w in words if not _leads_away(w))]),
    )
    contents = damaged_bytes([CASE.encode()], [*TOML_VALUES, *words])
    return st.tuples(arguments, st.lists(options, max_size=2), st.just(None) | contents)


def _leads_away(word: str) -> bool:
    """Whether a results folder of that name would be made outside the yard."""
    return word.startswith(("/", "~", "..")) or not word


@kind(0.05, _arguments)
def command_line(yard: Yard, given: tuple[tuple[str, str, str], list[str], bytes | None]) -> None:
    """Status 0, or status 2 and a line for each mistake; no file is left half-written."""
    (verb, case, results), options, contents = given
    (yard.cases / "input.toml").write_bytes(CASE.encode() if contents is None else contents)
    code, said = called([verb, case, "--results", results, *options], yard.path / "cwd")
    require(code in (0, 2), f"status {code}: {said!r}")
    require(code == 0 or said.endswith("\n"), f"no whole line: {said!r}")
    if code:
        lines_of_a_refusal(said)
    require(not list(yard.path.rglob("*.tmp")), "half a file")


def called(arguments: list[str], folder: Path) -> tuple[int, str]:
    """Status and stderr of the command line, in this process and without any YADE."""
    out = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="strict")
    err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="backslashreplace")
    folder.mkdir(exist_ok=True)
    # which `check` asks for
    before, path, look = os.getcwd(), os.environ["PATH"], check.examine
    handler = signal.getsignal(signal.SIGTERM)
    os.environ["PATH"], check.examine = "/nowhere", lambda *_: HEALTHY
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = main(arguments)
            except SystemExit as end:
                code = int(end.code or 0)
    finally:
        os.chdir(before)
        os.environ["PATH"], check.examine = path, look
        signal.signal(signal.SIGTERM, handler)
    err.flush()
    return code, err.buffer.getvalue().decode()
