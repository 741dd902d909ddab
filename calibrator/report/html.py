"""Pieces of a self-contained HTML page: tables, embedded figures, and the style sheet.

Arguments named `body`, `cells` or `rows` are HTML already, all others are escaped here.
"""

from __future__ import annotations

import base64
import csv
import html
import io
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from calibrator.errors import CalibratorError
from calibrator.report.figures.data import csv_of
from calibrator.report.figures.style import Draw, png
from calibrator.report.words import text

DOTS, CSS_PIXELS = 160, 104  # per inch of a figure: in the PNG and on the page
NUMBER = r"[+-]?[0-9.]+(?:e-?[0-9]+)?"
LONGEST_NUMBER = 26
"""Characters of a cell from which it counts as a sentence."""
CSS = "\n" + (Path(__file__).parent / "style.css").read_text(encoding="utf-8")


class Album:
    """Keeps each figure as a PNG, and its numbers, in a folder and embeds it in the page."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.paths: list[Path] = []

    def figure(self, name: str, caption: str, draw: Draw, seen: str = "") -> str:
        """A figure element; where there is nothing to draw, a sentence that says so.

        seen : the finding, for who cannot see the figure; the caption where that states it.
        """
        try:
            drawn = draw()
        except CalibratorError as error:
            return note(f"Figure left out: {error}")
        path, picture = self.folder / f"{name}.png", png(drawn, DOTS)
        path.write_bytes(picture)
        self.paths.append(path)
        return embedded(picture, seen or caption, caption, self._numbers(csv_of(drawn), path))

    def _numbers(self, table: bytes, path: Path) -> str:
        """A link to the numbers of a figure, which are written beside its picture."""
        if not table:
            return ""
        beside = path.with_suffix(".csv")
        beside.write_bytes(table)
        where = f"{beside.parent.name}/{beside.name}"
        return f' <a class="csv" download="{beside.name}" href="{text(where)}">CSV</a>'


def embedded(picture: bytes, seen: str, caption: str, link: str = "") -> str:
    """A figure element of a PNG of `DOTS` per inch.

    seen : what it shows, for who cannot see it; link : to its numbers, in HTML.
    """
    source = base64.b64encode(picture).decode()
    # of the PNG header: the same text size in all figures
    width = int.from_bytes(picture[16:20], "big") * CSS_PIXELS // DOTS
    return (
        f'<figure><img alt="{text(seen)}" style="width:{width}px"'
        f' src="data:image/png;base64,{source}">'
        f"<figcaption>{text(caption)}{link}</figcaption></figure>"
    )


def section(title: str, *body: str) -> str:
    """A part of the page with its heading; empty parts of the body are left out."""
    parts = "\n".join(part for part in body if part)
    return f'<section id="{_anchor(title)}"><h2>{text(title)}</h2>\n{parts}\n</section>'


def folded(summary: str, *body: str) -> str:
    """A part that opens when its summary is chosen; empty parts of the body are left out."""
    parts = "\n".join(part for part in body if part)
    return f"<details><summary>{text(summary)}</summary>\n{parts}\n</details>"


def _anchor(title: str) -> str:
    """A title as the end of a link."""
    return "-".join(re.findall(r"\w+", title.lower()))


def paragraph(body: str, kind: str = "") -> str:
    """A paragraph of a class of the style sheet."""
    return f'<p class="{kind}">{body}</p>' if kind else f"<p>{body}</p>"


def note(words: str) -> str:
    """A quiet paragraph."""
    return paragraph(text(words), "note")


def table(
    caption: str, head: Sequence[str], rows: Iterable[Sequence[str]], strong: int | None = None
) -> str:
    """A table of HTML cells, the first of a row its heading, with a link to it as CSV.

    strong : the number of a column to be stressed. Columns of sentences are set as sentences, the
    others as numbers.
    """
    body = [list(row) for row in rows]
    wordy = {
        i for row in body for i, cell in enumerate(row) if i and len(_bare(cell)) > LONGEST_NUMBER
    }

    def cells(row: Sequence[str], tag: str) -> str:
        kinds = ["strong" if i == strong else "words" * (i in wordy) for i in range(len(row))]
        marks = [f' class="{kind}"' if kind else "" for kind in kinds]
        tags = ["th" if i == 0 else tag for i in range(len(row))]
        made = (f"<{t}{m}>{c}</{t}>" for t, m, c in zip(tags, marks, row, strict=True))
        return f"<tr>{''.join(made)}</tr>"

    lines = "\n".join(cells(row, "td") for row in body)
    link = _csv([head, *body], caption)
    return (
        f'<div class="wide"><table><caption><span>{text(caption)} {link}</span></caption>'
        f"<thead>{cells(head, 'th')}</thead><tbody>\n{lines}\n</tbody></table></div>"
    )


def _bare(cell: str) -> str:
    """The text of an HTML cell."""
    lines = cell.replace("<br>", "; ")
    return html.unescape(re.sub(r"<[^>]*>", "", lines)).replace("\u00a0", " ").strip()


def _csv(rows: Sequence[Sequence[str]], caption: str) -> str:
    """A link that holds the rows as a CSV file."""
    stream = io.StringIO()
    bare = [[_bare(cell) for cell in row] for row in rows]
    csv.writer(stream, lineterminator="\r\n").writerows(_numbers_apart(bare))
    data = base64.b64encode(stream.getvalue().encode("utf-8-sig")).decode()
    name = _anchor(caption)[:40].strip("-") or "table"
    return (
        f'<a class="csv" download="{name}.csv" href="data:text/csv;charset=utf-8;base64,{data}">'
        "CSV</a>"
    )


def _numbers_apart(rows: list[list[str]]) -> list[list[str]]:
    """The rows, the first their heading, with numbers that a spreadsheet takes for numbers.

    A column of values and errors becomes two, one of per cent has its unit in the heading.
    """
    columns = []
    for head, *cells in zip(*rows, strict=True):
        if all(re.fullmatch(rf"{NUMBER}( ± {NUMBER})?|–", cell) for cell in cells) and any(
            "±" in cell for cell in cells
        ):
            pairs = [(*cell.split(" ± "), "")[:2] for cell in cells]
            columns += [(head, *(p[0] for p in pairs)), (f"{head} ±", *(p[1] for p in pairs))]
        elif any("%" in c for c in cells) and all(
            re.fullmatch(rf"{NUMBER} %|–", cell) for cell in cells
        ):
            columns.append((f"{head} [%]", *(cell.removesuffix(" %") for cell in cells)))
        else:
            columns.append((head, *cells))
    return [list(row) for row in zip(*columns, strict=True)]


def mark(passed: bool | None, yes: str = "met", no: str = "missed", undecided: bool = False) -> str:
    """A coloured word with a tick, a cross, or a question mark; a dash where passed is None."""
    if passed is None:
        return "–"
    kind, sign, word = ("yes", "✓", yes) if passed else ("no", "?" if undecided else "✗", no)
    return f'<span class="{kind}">{sign} {word}</span>'


def page(title: str, sections: Sequence[str]) -> str:
    """The whole page of these sections, with links to them."""
    parts = [part for part in sections if part]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark">'
        f"<title>{text(title)}</title>\n<style>{CSS}</style></head>\n<body>"
        + _navigation("".join(parts))
        + "<main>\n"
        + "\n".join(parts)
        + "\n</main></body></html>\n"
    )


def _navigation(body: str) -> str:
    """Links to the sections of a page."""
    found = re.findall(r'<section id="([^"]*)"><h2>(.*?)</h2>', body)
    links = "".join(f'<a href="#{anchor}">{title}</a>' for anchor, title in found)
    return f'<nav aria-label="Sections">{links}</nav>\n' if len(found) > 1 else ""
