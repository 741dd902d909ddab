"""Links between the pages that lie in one folder of results."""

from __future__ import annotations

import re
from pathlib import Path

from calibrator.files import read_text, write_text

PAGES = {"report.html": "Calibration", "diagnosis.html": "Diagnosis"}
LINK = re.compile(r'<a class="page"[^>]*>[^<]*</a>')


def link_pages(folder: Path) -> None:
    """Let every page in a folder of results link to the others that are there."""
    there = [name for name in PAGES if (folder / name).is_file()]
    for name in there:
        links = "".join(
            f'<a class="page" href="{other}">{PAGES[other]}</a>' for other in there if other != name
        )
        before = read_text(folder / name, links=False)
        after = re.sub(r"(<nav[^>]*>)", rf"\1{links}", LINK.sub("", before), count=1)
        if after != before:
            write_text(folder / name, after)
