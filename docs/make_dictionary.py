"""Write docs/dictionary.md from the scripts' contract: python -m docs.make_dictionary.

tests/docs/test_dictionary.py holds the page to what this writes.
"""

from collections.abc import Iterable
from pathlib import Path

from calibrator.case.vocabulary import (
    DIAGNOSTICS,
    EFFECTS,
    PARAMETERS,
    RESPONSES,
    SCHEMA,
    SETUPS,
    STATUSES,
    Quantity,
)
from calibrator.runs.database import LEADING, TRAILING

PAGE = Path(__file__).parent / "dictionary.md"
HEAD = f"""# Data dictionary

Every name of case files, lab files, tables, records and databases, written by
`python -m docs.make_dictionary` from `yade_scripts/contract.json` (schema {SCHEMA}) and the code.
Values are in SI units, angles in degrees; a unit of 1 is a ratio.
"""
COLUMNS = {
    "run_id": "hash of schema, set-up and all parameters: the same run is never done twice",
    "setup": f"{', '.join(SETUPS[:-1])} or {SETUPS[-1]}",
    "status": "how the run ended, see [above](#statuses)",
    "particles": "grains that were filled in",
    "steps": "time steps of the whole run",
    "yade": "version of YADE that made the run",
    "scripts": "hash of the scripts that made it",
    "error": "why it failed, one line; empty where it did not",
}


def table(head: str, rows: Iterable[Iterable[str]]) -> str:
    """A table; | in a cell would end it."""
    columns = head.split(", ")
    lines = [columns, ["---"] * len(columns), *rows]
    cells = ([str(cell).replace("|", "\\|") for cell in line] for line in lines)
    return "".join(f"| {' | '.join(line)} |\n" for line in cells)


def span(one: Quantity) -> str:
    """The range, or the words that may be chosen."""
    if one.choices:
        return ", ".join(one.choices)
    low, high = ("" if bound is None else f"{bound:g}" for bound in (one.low, one.high))
    return f"{low} to {high}" if low and high else (f"{low} or more" if low else "")


def default(one: Quantity) -> str:
    """The default as it is written in a case."""
    return f"{one.default:g}" if isinstance(one.default, int | float) else str(one.default)


def parameters(chosen: Iterable[Quantity]) -> str:
    """A table of parameters."""
    rows = ([f"`{q.name}`", q.symbol, q.unit, default(q), said(q)] for q in chosen)
    return table("name, symbol, unit, default, meaning", rows)


def said(one: Quantity) -> str:
    """What it is, its range, and which response it is a function of."""
    more = [f"repeats `{one.repeats}`"] if one.repeats else []
    return "; ".join([one.about, *more, *filter(None, [span(one)])])


def effects() -> str:
    """A table of what is off by default, and may be missing."""
    rows = (
        [f"`{q.name}`", q.effect.called, f"{q.effect.scale:g}", q.effect.sign, q.effect.removed_by]
        for q in EFFECTS.values()
        if q.effect
    )
    return table("column, effect, plausible size, sign, what takes it away", rows)


def page() -> str:
    """The whole page."""
    everywhere = [q for q in PARAMETERS.values() if len(q.setups) == len(SETUPS)]
    plain = [q for q in everywhere if not q.effect]
    parts = [HEAD, "## Parameters\n", "### Of all set-ups\n", parameters(plain)]
    for setup in SETUPS:
        own = [q for q in PARAMETERS.values() if setup in q.setups and q not in everywhere]
        parts += [f"### Of {setup}\n", parameters(q for q in own if not q.effect)]
    parts += ["### Effects\n", "Off at their defaults; see [effects.md](effects.md).\n"]
    parts += [parameters(EFFECTS.values()), effects(), "## Responses\n"]
    for setup in SETUPS:
        own = [q for q in RESPONSES.values() if setup in q.setups]
        rows = ([f"`{q.name}`", q.symbol, q.unit, said(q)] for q in own)
        parts += [f"### In {setup}\n", table("name, symbol, unit, meaning", rows)]
    parts += [
        "## Statuses\n",
        "What the driver does about each is in [DESIGN.md](../DESIGN.md#failures).\n",
        table("status, meaning", ([f"`{name}`", words] for name, words in STATUSES.items())),
        "## Columns of a database\n",
        "`database.csv` and the files of `grid/` have a row per run: which it is, its parameters,\n"
        "its responses, and where it came from. Units are in its head.\n",
        table("column, meaning", ([f"`{n}`", COLUMNS[n]] for n in (*LEADING, *TRAILING))),
        "## Diagnostics of a record\n",
        table("name, unit", ([f"`{name}`", unit] for name, unit in DIAGNOSTICS.items())),
    ]
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page())
