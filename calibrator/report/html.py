"""Pieces of a self-contained HTML page: words, numbers, tables, embedded figures, and the style
sheet.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from calibrator.errors import CalibratorError
from calibrator.report.figures import style
from calibrator.report.words import text

DOTS, CSS_PIXELS = 160, 104  # per inch of a figure: in the PNG and on the page


class Album:
    """Keeps each figure as a PNG in a folder and embeds it in the page."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.paths: list[Path] = []

    def figure(self, name: str, caption: str, draw: Callable[[], style.Figure]) -> str:
        """A figure element; where there is nothing to draw, a sentence that says so."""
        try:
            picture = style.png(draw(), DOTS)
        except CalibratorError as error:
            return note(f"Figure left out: {error}")
        path = self.folder / f"{name}.png"
        path.write_bytes(picture)
        self.paths.append(path)
        source = base64.b64encode(picture).decode()
        # of the PNG header: the same text size in all figures
        width = int.from_bytes(picture[16:20], "big") * CSS_PIXELS // DOTS
        return (
            f'<figure><div class="wide"><img alt="{text(caption)}"'
            f' style="width:{width}px;min-width:{width * 5 // 8}px" '
            f'src="data:image/png;base64,{source}"></div><figcaption>{text(caption)}</figcaption></figure>'
        )


# Pieces of HTML; arguments named `body` or `cells` are HTML already, all others are escaped here


def section(title: str, *body: str) -> str:
    return (
        f"<section><h2>{text(title)}</h2>\n"
        + "\n".join(part for part in body if part)
        + "\n</section>"
    )


def paragraph(body: str, kind: str = "") -> str:
    return f'<p class="{kind}">{body}</p>' if kind else f"<p>{body}</p>"


def note(words: str) -> str:
    return paragraph(text(words), "note")


def table(
    caption: str, head: Sequence[str], rows: Iterable[Sequence[str]], strong: int | None = None
) -> str:
    """A table of HTML cells; the first cell of a row is its heading, `strong` the number of a
    column to be stressed.
    """

    def cells(row: Sequence[str], tag: str) -> str:
        marks = [' class="strong"' if i == strong else "" for i in range(len(row))]
        tags = ["th" if i == 0 else tag for i in range(len(row))]
        return (
            "<tr>"
            + "".join(f"<{t}{m}>{c}</{t}>" for t, m, c in zip(tags, marks, row, strict=True))
            + "</tr>"
        )

    body = "\n".join(cells(row, "td") for row in rows)
    return (
        "<div"
        f' class="wide"><table><caption>{text(caption)}</caption><thead>{cells(head, "th")}</thead>'
        f"<tbody>\n{body}\n</tbody></table></div>"
    )


def mark(passed: bool | None, yes: str = "met", no: str = "missed") -> str:
    if passed is None:
        return "–"
    return (
        f'<span class="{"yes" if passed else "no"}">{"✓" if passed else "✗"}'
        f" {yes if passed else no}</span>"
    )


def page(title: str, sections: Sequence[str]) -> str:
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{text(title)}</title>\n<style>{CSS}</style></head>\n<body><main>\n"
        + "\n".join(part for part in sections if part)
        + "\n</main></body></html>\n"
    )


CSS = """
:root { --ink: #222; --quiet: #5b6270; --line: #d9dce1; --wash: #f5f6f8; --good: #00704f; --bad: #b04300; }
* { box-sizing: border-box; }
body { margin: 0; color: var(--ink); background: #fff; font: 16px/1.55 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
main { max-width: 68rem; margin: 0 auto; padding: 1.5rem 1.25rem 4rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0.5rem 0 0.25rem; }
h2 { font-size: 1.3rem; margin: 2.5rem 0 0.75rem; padding-top: 0.75rem; border-top: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.5rem 0 0.5rem; }
p { margin: 0.6rem 0; max-width: 48rem; }
.about, .note, .small, figcaption, caption { color: var(--quiet); }
.note, .small, figcaption { font-size: 0.88rem; }
.answer { font-size: 1.1rem; padding: 0.9rem 1.1rem; background: var(--wash); border-left: 4px solid #0072b2; max-width: none; }
.alarm, .missing { padding: 0.8rem 1.1rem; border-left: 4px solid var(--bad); background: #fdf1e9; max-width: none; }
.alarm { font-weight: 600; font-size: 1.05rem; }
.missing { border-left-color: #c99a00; background: #fdf8e6; }
.wide { overflow-x: auto; }
figure { margin: 1.5rem 0; break-inside: avoid; }
figure img { display: block; max-width: 100%; height: auto; }
figcaption { margin-top: 0.4rem; max-width: 48rem; }
table { border-collapse: collapse; margin: 1rem 0; font-size: 0.9rem; font-variant-numeric: tabular-nums; break-inside: avoid; }
caption { text-align: left; padding-bottom: 0.35rem; font-size: 0.88rem; white-space: nowrap; }
th, td { padding: 0.32rem 0.6rem; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
th:first-child { text-align: left; padding-left: 0; font-weight: 500; white-space: normal; min-width: 8.5rem; }
th:first-child { position: sticky; left: 0; background: #fff; }
thead th { border-bottom: 2px solid #9aa1ad; font-weight: 600; vertical-align: bottom; }
.strong { background: var(--wash); font-weight: 600; }
.yes { color: var(--good); } .no { color: var(--bad); font-weight: 600; }
code, pre { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: 0.85em; }
code { background: var(--wash); padding: 0.1em 0.3em; overflow-wrap: anywhere; }
pre { background: var(--wash); padding: 1rem; overflow-x: auto; line-height: 1.4; }
@media (max-width: 40rem) { main { padding: 1rem 0.9rem 3rem; } h1 { font-size: 1.5rem; } .answer { font-size: 1rem; } }
@media print {
  body { font-size: 10pt; } main { max-width: none; padding: 0; }
  .wide { overflow: visible; } figure img { min-width: 0 !important; }
  table { font-size: 7.5pt; } h2 { break-after: avoid; } pre { white-space: pre-wrap; }
}
"""
