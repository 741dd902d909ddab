"""Pictures of the two pages at three widths, for the documents.

    python -m tests.report.screenshots [results/coarse_sand]

The first argument is the folder of a finished demo (`make demo`; `calibrator view` and
`calibrator report` add the picture of the run). Where it holds no diagnosis.html, the second page
is the example of the tests: a made-up laboratory in which adhesion is hidden, its runs by
formulas instead of YADE. Needs Chromium (`make chromium`).
"""

import contextlib
import sys
import tempfile
from pathlib import Path

from docs.make_pictures import photograph
from tests.report.made_up import diagnosed
from tests.report.test_browser import CHROMIUM, WIDTHS

REPO = Path(__file__).resolve().parents[2]
OUT = REPO / "docs" / "figures" / "pages"
HEIGHTS = {390: 1300, 900: 1300, 1600: 1100}
LARGEST = 150_000
"""Bytes of a picture."""
COLOURS = 256
EXAMPLE = (
    'name = "toy"',
    'name = "made_up_sand"\nabout = "An example: the laboratory and its runs are formulas, in which'
    ' adhesion is hidden"',
)


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
                picture = OUT / f"{name}_{width}.png"
                photograph(page, picture, width, HEIGHTS[width], COLOURS)
                if (size := picture.stat().st_size) > LARGEST:
                    sys.exit(f"{name} at {width} px takes {size} bytes: lower COLOURS")
                print(f"{picture.name}: {size // 1000} kB")


if __name__ == "__main__":
    main()
