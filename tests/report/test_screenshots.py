"""The pictures of the pages: small, as wide as their names say, and of what the browser shows."""

import pytest
from PIL import Image

from docs.make_pictures import photograph
from tests.report.screenshots import HEIGHTS, LARGEST, OUT
from tests.report.test_browser import WIDTHS, needs_chromium


@pytest.mark.parametrize("name", ["report", "diagnosis"])
@pytest.mark.parametrize("width", WIDTHS)
def test_the_shipped_pictures_are_small_and_as_wide_as_they_say(name, width):
    path = OUT / f"{name}_{width}.png"
    assert path.stat().st_size <= LARGEST
    assert Image.open(path).size == (width, HEIGHTS[width])


@needs_chromium
def test_a_picture_shows_the_page_at_its_width(tmp_path):
    bar = '<div style="width:100vw;height:40px;background:#d55e00"></div>'
    (tmp_path / "page.html").write_text(f'<body style="margin:0">{bar}</body>')
    photograph(tmp_path / "page.html", tmp_path / "picture.png", 390, HEIGHTS[390])
    picture = Image.open(tmp_path / "picture.png").convert("RGB")
    assert picture.size == (390, HEIGHTS[390])
    assert picture.getpixel((389, 39)) == (213, 94, 0) and picture.getpixel((0, 41))[2] > 250
