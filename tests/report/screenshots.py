"""Pictures of the two pages at three widths, for the documents.

    python -m tests.report.screenshots [results/coarse_sand]

The first argument is the folder of a finished demo (`make demo`; `calibrator view` and
`calibrator report` add the picture of the run). Where it holds no diagnosis.html, the second page
is the example of the tests: a made-up laboratory in which adhesion is hidden, its runs by
formulas instead of YADE. Needs Chromium (`make chromium`).
"""

import contextlib
import io
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

from tests.report.made_up import diagnosed
from tests.report.test_browser import CHROMIUM, WIDTHS

REPO = Path(__file__).resolve().parents[2]
OUT = REPO / "docs" / "figures" / "pages"
HEIGHTS = {390: 1300, 900: 1300, 1600: 1100}
LARGEST = 150_000
"""Bytes of a picture."""
COLOURS = 256
FRAME = """<!DOCTYPE html><meta charset="utf-8"><body style="margin:0">
<iframe src="%s" style="border:0;display:block;width:%dpx;height:%dpx"></iframe></body>"""
EXAMPLE = (
    'name = "toy"',
    'name = "made_up_sand"\nabout = "An example: the laboratory and its runs are formulas, in which'
    ' adhesion is hidden"',
)


def taken(page: Path, width: int, folder: Path) -> bytes:
    """The head of a page at a width, as a PNG of few colours.

    It is shown in a frame, as no window of a browser is as narrow as a telephone.
    """
    height, shot = HEIGHTS[width], folder / "shot.png"
    (folder / "frame.html").write_text(FRAME % (f"file://{page.resolve()}", width, height))
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
    command += [f"--user-data-dir={folder / 'profile'}", f"--window-size={width},{height}"]
    command += ["--virtual-time-budget=5000", f"--screenshot={shot}"]
    subprocess.run(
        [*command, f"file://{folder / 'frame.html'}"], check=True, capture_output=True, timeout=120
    )
    image = (
        Image.open(shot)
        .convert("RGB")
        .quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    )
    stream = io.BytesIO()
    image.save(stream, "PNG", optimize=True)
    return stream.getvalue()


def example(folder: Path) -> Path:
    """The page of the diagnosis that the tests make."""
    with contextlib.chdir(folder):  # so that the page names no folder of this machine
        space, _ = diagnosed(Path(), EXAMPLE, bond_number=0.6)
        return (space.path / "diagnosis.html").resolve()


def main() -> None:
    """Write the pictures, and say how large they are."""
    results = Path(*sys.argv[1:2] or ["results/coarse_sand"])
    if CHROMIUM is None or not (results / "report.html").is_file():
        sys.exit(f"needs Chromium (make chromium) and {results}/report.html (make demo)")
    OUT.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        diagnosis = results / "diagnosis.html"
        pages = {
            "report": results / "report.html",
            "diagnosis": diagnosis if diagnosis.is_file() else example(folder),
        }
        for name, page in pages.items():
            for width in WIDTHS:
                picture = taken(page, width, folder)
                if len(picture) > LARGEST:
                    sys.exit(f"{name} at {width} px takes {len(picture)} bytes: lower COLOURS")
                (OUT / f"{name}_{width}.png").write_bytes(picture)
                print(f"{name}_{width}.png: {len(picture) // 1000} kB")


if __name__ == "__main__":
    main()
