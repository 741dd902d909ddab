"""The fenced blocks of the documents."""

import re
from dataclasses import dataclass
from pathlib import Path

REPO = Path(__file__).resolve().parents[2]
PAGES = sorted([*REPO.glob("*.md"), *(REPO / "docs").rglob("*.md"), *(REPO / "grid").glob("*.md")])
FENCE = re.compile(r"^( *)```([^\n`]*)\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block: where it begins, its kind, and what is in it."""

    page: str
    line: int
    kind: str
    text: str

    def __str__(self):
        return f"{self.page}:{self.line}:{self.kind}"


def blocks_of(page):
    """The fenced blocks of a page, in its order."""
    text, name = page.read_text(), str(page.relative_to(REPO))
    return [
        Block(name, text[: found.start()].count("\n") + 1, found[2].strip(), found[3])
        for found in FENCE.finditer(text)
    ]


def blocks(*kinds):
    """The blocks of these kinds, of all pages."""
    return [b for page in PAGES for b in blocks_of(page) if b.kind in kinds]
