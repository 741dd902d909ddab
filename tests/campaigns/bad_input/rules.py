"""What must hold of every input, and what a kind of input is."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from calibrator.case.vocabulary import PARAMETERS, SETUPS
from calibrator.errors import CalibratorError
from calibrator.runs.record import InvalidRecord
from tests.campaigns.bad_input.damage import WORDS
from tests.campaigns.bad_input.yard import Yard


class Broken(AssertionError):
    """An input that was neither accepted rightly nor refused properly."""


def require(condition: bool, what: str) -> None:
    """Raise Broken unless the condition holds."""
    if not condition:
        raise Broken(what)


def refusal(error: Exception) -> None:
    """A refusal is a printable line of bounded length that ends with what to do.

    Where several things are wrong at once it is their number, and then such a line for each, no
    more than a terminal shows.
    """
    messages = getattr(error, "messages", (str(error),))
    for line in messages:
        require(line.isprintable() and 10 < len(line) < 1100, f"not one line: {line!r}")
        require(
            isinstance(error, InvalidRecord) or ": " in line or "; " in line, f"no remedy: {line!r}"
        )
    lines_of_a_refusal(str(error))


def lines_of_a_refusal(text: str) -> None:
    """One line, or the number of mistakes and a line, set in, for each of the first of them."""
    first, *others = text.rstrip("\n").split("\n")
    require(
        not others or re.search(r"\b\d+ mistakes:$", first) is not None, f"not one line: {text!r}"
    )
    require(len(others) <= 21 and len(others) != 1, f"{len(others)} lines")
    require(all(line.startswith("  ") for line in others), f"not set in: {text!r}")


def ask(call: Callable[[], Any]) -> Any:
    """What the call returns; None where it is refused."""
    try:
        return call()
    except (CalibratorError, InvalidRecord) as error:
        refusal(error)
        return None


def only_data(text: str) -> bool:
    """Whether a table's cell is a number, a word of the vocabulary or a list of sizes.

    The latter two in quotes; also for Python.
    """
    choices = {c for q in PARAMETERS.values() for c in q.choices or ()}
    tree = ast.parse(text, mode="eval").body
    inner = (
        tree.operand if isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.USub) else tree
    )
    if not isinstance(inner, ast.Constant) or any(c.isspace() for c in text):
        return False
    return (
        inner.value in choices or re.fullmatch(r"[0-9.e:|-]*", inner.value) is not None
        if isinstance(inner.value, str)
        else type(inner.value) in (int, float)
    )


def safe_table(path: Path) -> None:
    """Every cell of a written table is data, and every line complete."""
    header, *lines = path.read_text().splitlines()
    for line in lines:
        run_id, *cells = line.split(" ")
        require(
            len(cells) == len(header.split()) - 1 and run_id.isalnum(), f"a broken line: {line!r}"
        )
        require(
            all(only_data(c) for c in cells if not c.startswith("scripts/")),
            f"code in a table: {line!r}",
        )
        scripts = [c for c in cells if c.startswith("scripts/")]
        require(
            all(s in [f"scripts/{x}.py" for x in SETUPS] for s in scripts),
            f"a strange script: {line!r}",
        )


Draw = Callable[[Yard], st.SearchStrategy[Any]]
Use = Callable[[Yard, Any], None]


@dataclass(frozen=True)
class Kind:
    """How an input is drawn in a yard, what is done with it, and its share of all inputs."""

    draw: Draw
    use: Use
    share: float


def registry(kinds: dict[str, Kind]) -> Callable[[float, Draw], Callable[[Use], Use]]:
    """A decorator that adds functions to a table of kinds."""

    def kind(share: float, draw: Draw) -> Callable[[Use], Use]:
        """Register what is done with an input under the function's name."""

        def register(use: Use) -> Use:
            kinds[use.__name__] = Kind(draw, use, share)
            return use

        return register

    return kind


def texts(yard: Yard) -> list[str]:
    """Free texts, code among them."""
    return [*WORDS, *yard.spells()]
