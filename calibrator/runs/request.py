"""Requests and native yade-batch tables."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from calibrator.case.values import Value, checked_value, known
from calibrator.case.vocabulary import PARAMETERS, SCHEMA, SETUPS, parameters_of
from calibrator.errors import CalibratorError
from calibrator.files import write_text


@dataclass(frozen=True)
class Request:
    """One run: a set-up and a value for each of its parameters, the seed among them.

    An effect or an option that is off is not mentioned.
    """

    setup: str
    parameters: dict[str, Value]

    @classmethod
    def of(cls, setup: str, /, **given: Value) -> Request:
        """Complete the given parameters with the contract's defaults.

        Raises CalibratorError for bad names or values.
        """
        own = parameters_of(known(setup, SETUPS, "set-up"))
        for name in given:
            known(name, own, f"parameter of {setup}")
        values = {n: checked_value(n, given.get(n, q.default)) for n, q in own.items()}
        return cls(
            setup,
            {n: v for n, v in values.items() if not own[n].unmentioned or v != own[n].default},
        )

    @property
    def run_id(self) -> str:
        """Short hash of schema, set-up and parameters: the same run is never done twice."""
        key = json.dumps([SCHEMA, self.setup, self.parameters], sort_keys=True, allow_nan=False)
        return hashlib.sha256(key.encode()).hexdigest()[:16]

    def value(self, name: str) -> Value:
        """Value of a parameter of the set-up, the default of an effect that is off."""
        return self.parameters.get(name, PARAMETERS[name].default)  # type: ignore[return-value]

    def with_seed(self, seed: int) -> Request:
        """The same run with another seed."""
        return Request.of(self.setup, **{**self.parameters, "seed": seed})


def cell(name: str, value: Value | None) -> str:
    """One table cell.

    YADE evaluates cells as Python, so only a number or a word of the vocabulary may pass.
    """
    checked = checked_value(name, value)
    text = repr(checked)
    # a word of the vocabulary, or a list of sizes
    words = r"'([a-z0-9_]+|[0-9.e:|-]*)'"
    allowed = words if isinstance(checked, str) else r"-?[0-9]+(\.[0-9]+)?(e[-+]?[0-9]+)?"
    if not re.fullmatch(allowed, text):
        raise CalibratorError(
            f"{name} = {text} cannot be written into a yade-batch table: give a plain number"
        )
    return text


def write_table(path: Path, requests: Sequence[Request]) -> None:
    """Write a table, atomically; line i + 2 is requests[i].

    A table of several set-ups says in yade-batch's column !SCRIPT which script runs a line,
    relative to the result folder, and holds the columns of all of them; a script passes over what
    it does not take. Every cell is complete (YADE copies neighbours into empty ones) and the file
    ends in a newline (YADE drops the last character otherwise). The run id is the description,
    which yade-batch also uses for the log's name.
    """
    setups = {r.setup for r in requests}
    used = set().union(*(r.parameters for r in requests))
    names = [
        n
        for n, q in PARAMETERS.items()
        if setups & set(q.setups) and (not q.unmentioned or n in used)
    ]
    script = ["!SCRIPT"] * (len(setups) > 1)
    lines = [" ".join(["description", *script, *names])]
    for r in requests:
        values = [cell(n, r.parameters.get(n, PARAMETERS[n].default)) for n in names]
        lines.append(" ".join([r.run_id, *(f"scripts/{r.setup}.py" for _ in script), *values]))
    write_text(path, "\n".join(lines) + "\n")
