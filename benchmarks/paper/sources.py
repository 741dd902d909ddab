"""The files that the page is made of, and how its tables are written."""

import json
import tomllib
from pathlib import Path
from typing import Any

from benchmarks.common import RESULTS
from calibrator.case.case import Case
from calibrator.case.toml import read_case
from calibrator.runs.workspace import Workspace

REPO = Path(__file__).resolve().parents[2]
CASE = REPO / "cases" / "quartz_sand_reduced.toml"
GRID = REPO / "cases" / "quartz_sand_reduced_grid.toml"
ADAPTIVE = REPO / "cases" / "quartz_sand_adaptive.toml"


class Sources:
    """The files that the blocks are made of."""

    def __init__(self) -> None:
        self.case: Case = read_case(CASE)
        self.space = Workspace(self.case, REPO / "results" / self.case.name)
        self.summary = self.space.summary()
        self.paper = tomllib.loads((REPO / "cases" / "reference_paper.toml").read_text())

    def measured(self, name: str) -> dict[str, Any]:
        """Results of a benchmark; FileNotFoundError where it has not been run."""
        found: dict[str, Any] = json.loads((RESULTS / f"{name}.json").read_text())
        return found


def table(head: list[str], rows: list[list[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def with_error(value: float, error: float | None, digits: int = 4) -> str:
    """A value and its error, the latter with two digits."""
    return f"{value:.{digits}g}" + (f" ± {error:.2g}" if error else "")


def workspace(path: Path) -> Workspace:
    """Another case with its results."""
    case = read_case(path)
    return Workspace(case, REPO / "results" / case.name)
