"""Fills the marked blocks of docs/paper_case.md: the paper's tables beside ours.

    calibrator all cases/quartz_sand_reduced.toml && python -m benchmarks.paper.page

`make paper` does both. Everything comes from files: the case's summary and shipped database, the
paper's printed numbers (cases/reference_paper.toml), and the results of the benchmarks named in
each block. A block whose source is missing says which command makes it.
"""

import re
import shutil
from collections.abc import Callable

from benchmarks.paper.needed import (
    adaptive_block,
    ratios_block,
    runs_block,
    unreachable_block,
)
from benchmarks.paper.numbers import (
    coverage_block,
    interpolation_block,
    sensitivity_block,
    similarity_block,
)
from benchmarks.paper.setting import database_block, scale_block, targets_block
from benchmarks.paper.sources import REPO, Sources
from benchmarks.paper.tables import (
    pile_block,
    table6_block,
    table7_block,
    table8_full_block,
    table89_block,
)

PAGE = REPO / "docs" / "paper_case.md"
PICTURES = REPO / "docs" / "figures"
COPIED = (
    "front_evolution",
    "generational_distance",
    "sensitivity",
    "ridge",
    "profile_likelihood",
    "parity",
)


# Set-up and database


# The paper's tables


# Statistics


BLOCKS: dict[str, tuple[Callable[[Sources], str], str]] = {
    "scale": (scale_block, "python -m benchmarks.runs.hourglass_scale"),
    "targets": (targets_block, "make paper"),
    "database": (database_block, "make paper"),
    "table 6": (table6_block, "make paper"),
    "table 7": (table7_block, "make paper"),
    "tables 8 and 9": (table89_block, "make paper"),
    "pile": (pile_block, "python -m benchmarks.runs.pile_scale"),
    "table 8 at full scale": (table8_full_block, "python -m benchmarks.runs.ledge_full_scale"),
    "sensitivity": (sensitivity_block, "make paper"),
    "coverage": (coverage_block, "python -m benchmarks.numerics.coverage"),
    "interpolation": (interpolation_block, "calibrator run cases/quartz_sand_reduced_grid.toml"),
    "similarity": (similarity_block, "python -m benchmarks.runs.similarity"),
    "runs needed": (runs_block, "python -m benchmarks.peers.runs_needed"),
    "runs beside peers": (ratios_block, "python -m benchmarks.peers.runs_needed"),
    "adaptive": (adaptive_block, "calibrator run cases/quartz_sand_adaptive.toml"),
    "out of reach": (unreachable_block, "python -m benchmarks.peers.runs_needed"),
}


def filled(page: str, sources: Sources) -> str:
    """The page with every marked block made anew; ValueError names a block that does not exist."""

    def block(match: re.Match[str]) -> str:
        name = match[1]
        make, command = BLOCKS[name]
        try:
            body = make(sources)
        except (FileNotFoundError, KeyError):
            body = f"*Not measured yet: run `{command}`.*"
        return f"<!-- {name} -->\n{body}\n<!-- end -->"

    names = re.findall(r"<!-- (?!end)(.*?) -->", page)
    if set(names) != set(BLOCKS):
        raise ValueError(
            f"blocks of the page and of this script differ: {set(names) ^ set(BLOCKS)}"
        )
    return re.sub(r"<!-- (?!end)(.*?) -->\n.*?<!-- end -->", block, page, flags=re.DOTALL)


def main() -> None:
    """Fill the page, copy the figures, and keep the numbers."""
    sources = Sources()
    page = filled(PAGE.read_text(), sources)
    PAGE.write_text(page)
    PICTURES.mkdir(exist_ok=True)
    for name in COPIED:
        shutil.copy(sources.space.path / "figures" / f"{name}.png", PICTURES / f"paper_{name}.png")
    print(
        f"{PAGE.relative_to(REPO)}: {len(BLOCKS)} blocks, {page.count('Not measured yet')} not"
        " measured yet"
    )


if __name__ == "__main__":
    main()
