"""The gallery: an example made anew is the one that is shown, and each has its exact case."""

import re

import pytest
from PIL import Image

from docs.make_gallery import LARGEST, PAGES, PART, PICTURE, renewed, yard
from tests.docs.blocks import REPO

NUMBER = re.compile(r"(\+- )?(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)")  # an error, or a value
EXAMPLES = sorted(path for path in PAGES.glob("*.md") if path.name != "index.md")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_a_page_shows_its_files_as_they_are_and_small_pictures(path):
    page = path.read_text()
    parts = PART.findall(page)
    assert any(what.endswith(".toml") for _, kind, what, _ in parts if kind == "file")
    for _, kind, what, _ in parts:
        if kind == "file":
            assert f"\n{(REPO / what).read_text()}```\n<!-- end -->" in page
        else:
            assert f"```console\n$ {what}\n" in page
    assert page.count("<!-- end -->") == len(parts)
    for name in PICTURE.findall(page):
        assert (PAGES / name).stat().st_size <= LARGEST
        with Image.open(PAGES / name) as picture:
            assert max(picture.size) <= 1200


def test_every_example_is_on_the_list_and_every_picture_on_a_page():
    listed = re.findall(r"\]\((\w+\.md)\)", (PAGES / "index.md").read_text())
    assert sorted(listed) == [path.name for path in EXAMPLES]
    shown = {name for path in EXAMPLES for name in PICTURE.findall(path.read_text())}
    assert shown == {path.name for path in PAGES.glob("*.png")}


# `check`, which the second one calls, asks for a YADE; neither makes a run
@pytest.mark.parametrize(
    "name", ["one_test.md", pytest.param("photograph.md", marks=pytest.mark.yade)]
)
def test_an_example_made_anew_says_what_its_page_shows(name):
    """But for the last digits of its numbers, which no two processors share."""
    page = (PAGES / name).read_text()
    with yard():
        anew = renewed(page)
    assert NUMBER.sub("#", anew) == NUMBER.sub("#", page), "call python -m docs.make_gallery"
    for (is_error, ours), (_, theirs) in zip(
        NUMBER.findall(anew), NUMBER.findall(page), strict=True
    ):
        slack = 0.05 if is_error else 0.0
        assert float(ours) == pytest.approx(float(theirs), rel=0.01, abs=slack)
