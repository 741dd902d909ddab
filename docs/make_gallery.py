"""Make the worked examples of docs/gallery anew.

    python -m docs.make_gallery            from the runs that are shipped; minutes, no run is made
    python -m docs.make_gallery inputs     the scale's log (one run of YADE) and the rendered heaps

The words of the pages are written by hand. Between `<!-- file PATH -->` or `<!-- run COMMAND -->`
and `<!-- end -->` stands what is put there: a file as it is, or what the command prints. A picture
`<case>_<figure>.png` of a page is a figure of that case's report.
"""

import contextlib
import io
import os
import re
import shlex
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from calibrator.cli import main as calibrator

REPO = Path(__file__).resolve().parents[1]
PAGES = REPO / "docs" / "gallery"
PART = re.compile(r"(<!-- (file|run) (.+?) -->\n).*?(<!-- end -->)", re.DOTALL)
PICTURE = re.compile(r"!\[[^]]*\]\(([\w]+\.png)\)")
LANGUAGES = {".toml": "toml", ".csv": "csv"}
LARGEST = 100_000
"""Bytes of a picture."""


@contextlib.contextmanager
def yard() -> Iterator[Path]:
    """A folder with the cases and the shipped runs, to be worked in."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        for folder in ("gallery", "cases", "grid"):
            shutil.copytree(REPO / folder, Path(name) / folder)
        os.chdir(name)
        try:
            yield Path(name)
        finally:
            os.chdir(before)


def called(command: str) -> str:
    """What a command prints; it has to end well."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        status = calibrator(shlex.split(command)[1:])
    if status:
        raise SystemExit(f"{command}: ended with {status}")
    return said.getvalue()


def made(kind: str, what: str) -> str:
    """A fenced block: a file, or a command with what it printed."""
    if kind == "file":
        text = Path(what).read_text()
        return f"```{LANGUAGES[Path(what).suffix]}\n{text}```\n"
    return f"```console\n$ {what}\n{called(what)}```\n"


def renewed(page: str) -> str:
    """The page with its parts made anew, in the present folder."""
    return PART.sub(lambda part: part[1] + made(part[2], part[3]) + part[4], page)


def figure(name: str) -> Path:
    """Where a picture of a page is among the results."""
    for case in sorted(Path("results").glob("*/")):
        if name.startswith(f"{case.name}_"):
            return case / "figures" / name.removeprefix(f"{case.name}_")
    return Path("results") / name


def shrunk(source: Path, target: Path) -> None:
    """Copy a picture with as many colours, and in such a size, as keep it small."""
    with Image.open(source) as image:
        seen = image.convert("RGB")
    seen.thumbnail((1200, 1200))
    for colours in (128, 64, 32, 16, 8):
        seen.quantize(colours, dither=Image.Dither.NONE).save(target, optimize=True)
        if target.stat().st_size <= LARGEST:
            return
    raise SystemExit(f"{target.name} is larger than {LARGEST} bytes")


def renew(name: str) -> str:
    """A page of the gallery made anew, with a report for each of its cases; its pictures too."""
    path = PAGES / name
    page = renewed(path.read_text())
    calibrated = re.findall(r"^\$ calibrator calibrate (\S+)", page, re.MULTILINE)
    for case in calibrated:
        called(f"calibrator report {case}")
    for picture in PICTURE.findall(page):
        shrunk(figure(picture), PAGES / picture)
    path.write_text(page)
    return page


def log_of_a_scale() -> None:
    """gallery/scale_log.csv: what a scale under the demo's laboratory would have shown.

    One run at the truth of the demo, read off 100 times a second to 0.01 g; the clock begins two
    seconds before the release.
    """
    from calibrator.runs.folder import RunFolder
    from calibrator.runs.local import run
    from cases.make_lab import requests

    with tempfile.TemporaryDirectory() as folder:
        request = next(r for r in requests() if r.setup == "hourglass")
        run(RunFolder(Path(folder)), [request])
        with np.load(Path(folder) / "records" / f"{request.run_id}.npz") as arrays:
            time, mass = arrays["time"], arrays["passed_mass"]
    clock = np.arange(0, 4, 0.01)
    shown = np.interp(clock - 2, time, 1e3 * mass, left=0.0)
    rows = (f"{t:.2f},{m:.2f}\n" for t, m in zip(clock, shown, strict=True))
    (REPO / "gallery" / "scale_log.csv").write_text("time [s],mass [g]\n" + "".join(rows))


def heaps() -> None:
    """gallery/heap_1.png to 3: a heap of a run, rendered from three sides, seen 8 degrees down."""
    from tests.laboratory.photographer import PIXEL, photograph
    from tests.laboratory.piles import RADIUS, pile
    from tests.laboratory.rendered import spheres

    for number, turned in enumerate((0, 60, 120), 1):
        picture, _ = spheres(pile("steep"), RADIUS, 8, PIXEL, (400, 640), turned_deg=turned)
        photograph(REPO / "gallery" / f"heap_{number}.png", picture)


def main(what: list[str]) -> None:
    """All pages, or all inputs."""
    if what == ["inputs"]:
        log_of_a_scale()
        heaps()
        return
    with yard():
        for path in sorted(PAGES.glob("*.md")):
            print(path.name, flush=True)
            renew(path.name)


if __name__ == "__main__":
    main(sys.argv[1:])
