"""The reader's test: ten questions, each answered within two clicks from the front page."""

import re

import pytest

from tests.docs.blocks import REPO
from tests.test_documents import LINK, anchors, text_of

DOCS = REPO / "docs"
FRONT, QUESTIONS = DOCS / "index.md", DOCS / "questions.md"
ROWS = re.findall(r"^\| (.+\?) \| (.+) \|$", QUESTIONS.read_text(), re.MULTILINE)
SAID = {
    "between grain and wall": r"between grains and at walls",
    "rolling friction not pinned down": r"\*\*Two parameters do the same\.\*\* Rolling and sliding",
    "Which of the candidates": r"\| compromise \| the recommendation",
    "CANNOT TELL": r"\| CANNOT TELL \| the mean of so few runs",
    "count as met": r"the mean of \$n\$ runs meets the target",
    "my heap": r"\| height of a heap \| 8 grain diameters",
    "photograph": r"`--tilt`",
    "killed": r"the driver is killed",
    "LIGGGHTS or EDEM": r"eta = mu_r/2",
    "moist": r"adhesion",
    "column of the database": r"`run_id`",
    "can it not do": r"Grains are spheres",
    "cite": r"10\.1016/j\.apt\.2018\.03\.001",
}
"""What stands on one of the pages that a question links to, by words of the question."""


def pages_of(links):
    """The pages that links in a cell lead to; the page itself where it is an anchor."""
    for link in LINK.findall(links):
        path, _, anchor = link.partition("#")
        page = DOCS / path if path else QUESTIONS
        assert not anchor or anchor in anchors(page)
        yield page


def test_there_are_ten_questions_and_the_front_page_leads_to_them():
    assert len(ROWS) >= 10 and len({question for question, _ in ROWS}) == len(ROWS)
    assert "questions.md" in LINK.findall(text_of(FRONT))


@pytest.mark.parametrize(("question", "links"), ROWS)
def test_a_question_is_answered_where_its_link_leads(question, links):
    (said,) = [words for key, words in SAID.items() if key in question]
    text = "\n".join(page.read_text() for page in pages_of(links))
    assert re.search(said, text), f"{question}: nothing of {said}"


def test_every_page_of_the_site_is_two_clicks_from_the_front_page():
    def led_to(page):
        links = (link.partition("#")[0] for link in LINK.findall(text_of(page)))
        found = ((page.parent / link).resolve() for link in links if link and ":" not in link)
        return {path for path in found if path.suffix == ".md"}

    near = led_to(FRONT)
    near |= {page for first in near for page in led_to(first)} | {FRONT}
    assert not set(DOCS.rglob("*.md")) - near
