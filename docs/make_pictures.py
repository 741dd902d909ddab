"""Pictures of pages, by a browser without a window: python -m docs.make_pictures RESULTS.

The first screen of the demo's report (RESULTS/coarse_sand/report.html, as `make demo` leaves it)
for the README, and the front page and the tutorial of the site (`make docs`) at three widths.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

REPO = Path(__file__).resolve().parents[1]
FIGURES = REPO / "docs" / "figures"
WIDTHS = {390: 844, 900: 1000, 1600: 1000}
"""Widths and heights [px] of a telephone, half a screen, and a screen."""
COLOURS = 64


def photograph(page: Path, picture: Path, width: int, height: int, colours: int = COLOURS) -> None:
    """The first screen of a page, with few colours, so that it is small."""
    with tempfile.TemporaryDirectory() as folder:
        shot = Path(folder) / "shot.png"
        # A window of less than 500 pixels is widened by the browser, a frame in it is not.
        frame = Path(folder) / "frame.html"
        frame.write_text(
            f'<body style="margin:0"><iframe src="{page.resolve().as_uri()}" style="border:0;'
            f'width:{width}px;height:{height}px"></iframe>'
        )
        command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
        command += ["--allow-file-access-from-files", "--virtual-time-budget=20000"]
        command += [f"--window-size={max(width, 500)},{height}", f"--screenshot={shot}"]
        subprocess.run([*command, frame.as_uri()], check=True, capture_output=True, timeout=300)
        with Image.open(shot) as image:
            seen = image.convert("RGB").crop((0, 0, width, height))
            small = seen.quantize(colours, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
            small.save(picture, optimize=True)


def main(results: Path) -> None:
    """All pictures."""
    photograph(results / "coarse_sand" / "report.html", FIGURES / "report.png", 1000, 760)
    (FIGURES / "site").mkdir(exist_ok=True)
    for name in ("index", "tutorial"):
        page = REPO / "build" / "docs" / "docs" / f"{name}.html"
        for width, height in WIDTHS.items():
            photograph(page, FIGURES / "site" / f"{name}_{width}.png", width, height)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
