"""What the documents point to is there: files, headings, and commands that can be called."""

import importlib.util
import re
from pathlib import Path

import pytest

from calibrator.cli import main
from calibrator.options import parser
from calibrator.verbs import DIAGNOSIS, HANDED_ON, LOOKED_AT, VERBS

REPO = Path(__file__).resolve().parent.parent
DOCUMENTS = sorted(
    [*REPO.glob("*.md"), *(REPO / "docs").rglob("*.md"), *(REPO / "grid").glob("*.md")]
)
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
COMMAND = re.compile(r"python -m ((?:benchmarks|delivery|tests\.campaigns)[\w.]*)")
# a path in backquotes or bare, of what tests and benchmarks have
PLACE = re.compile(
    r"(?<![\w/.])((?:tests|benchmarks|delivery|calibrator|yade_scripts|grid|cases)/[\w./<>*-]*\w)"
)


def named(document):
    return str(document.relative_to(REPO))


def text_of(document):
    """The document without its blocks of code, in which a bracket means something else."""
    return re.sub(r"^```.*?^```$", "", document.read_text(), flags=re.MULTILINE | re.DOTALL)


def anchors(document):
    """What a link can end in: the headings as GitHub makes anchors of them."""
    headings = re.findall(r"^#+ (.+?)\s*$", document.read_text(), flags=re.MULTILINE)
    words = [re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings]
    return {heading.replace(" ", "-") for heading in words}


@pytest.mark.parametrize("document", DOCUMENTS, ids=named)
def test_every_link_leads_to_a_file_and_a_heading_that_exist(document):
    for link in LINK.findall(text_of(document)):
        if re.match(r"[a-z]+:", link):
            continue  # another site
        path, _, heading = link.partition("#")
        target = (document.parent / path).resolve() if path else document
        assert target.exists(), f"{link}: no such file"
        assert target.is_relative_to(REPO), f"{link} leads out of the repository"
        if heading:
            assert heading in anchors(target), f"{link}: no such heading"


def test_the_links_of_the_documents_are_seen():
    """Else the test above would pass whatever they are."""
    links = [link for document in DOCUMENTS for link in LINK.findall(text_of(document))]
    assert len(links) > 20
    assert any("#" in link for link in links)


def commands():
    """{module that a document, the Makefile or a benchmark tells somebody to call: where}."""
    python = [p for f in ("tests", "benchmarks", "cases") for p in (REPO / f).rglob("*.py")]
    tables = [*(REPO / "grid").glob("*.csv"), *(REPO / "cases").glob("*.csv")]
    found = {}
    for path in [*DOCUMENTS, REPO / "Makefile", *python, *tables]:
        for module in COMMAND.findall(path.read_text()):
            found.setdefault(module.rstrip("."), named(path))
    return found


@pytest.mark.parametrize("module", sorted(commands()))
def test_every_command_that_is_named_can_be_called(module):
    spec = importlib.util.find_spec(module)
    assert spec is not None, f"{commands()[module]}: no module {module}"
    if spec.submodule_search_locations is None:
        assert '__name__ == "__main__"' in Path(spec.origin).read_text(), f"{module} does nothing"
    else:
        assert importlib.util.find_spec(f"{module}.__main__"), f"{module} is a folder"


@pytest.mark.parametrize("document", DOCUMENTS, ids=named)
def test_every_place_of_the_repository_that_is_named_exists(document):
    for place in PLACE.findall(document.read_text()):
        pattern = re.sub(r"<[\w-]+>", "*", place)  # benchmarks/results/<name>.json
        assert list(REPO.glob(pattern)), f"{place}: no such file or folder"


def test_the_options_of_the_commands_are_those_that_the_page_names():
    """Also which verbs take the options that not all take, and every exit status."""
    page = (REPO / "docs" / "case_file.md").read_text()
    (section,) = re.findall(r"^## Options of the commands\n(.*)", page, re.M | re.S)
    (verbs,) = (a for a in parser()._actions if a.dest == "verb")
    taken = {
        verb: {s for a in own._actions for s in a.option_strings if s.startswith("--")} - {"--help"}
        for verb, own in verbs.choices.items()
    }
    above = {s for a in parser()._actions for s in a.option_strings if s.startswith("--")}
    named_options = set(re.findall(r"--[a-z][a-z-]+", section))
    assert named_options == set.union(*taken.values()) | above - {"--help", "--version"}
    for option, named_verbs in re.findall(r"`(--\w+)(?: [A-Z]+)?` \(([a-z, ]+)\)", section):
        assert {v for v, own in taken.items() if option in own} == set(named_verbs.split(", "))
    statuses = re.findall(r"^\| (\d+) \|", section, re.M)
    assert statuses == re.findall(r"\b\d+\b", main.__doc__)


def test_the_verbs_are_those_that_the_readme_names():
    text = (REPO / "README.md").read_text()
    named_verbs = re.findall(r"^calibrator (\w+) my_sand.toml", text, re.M)
    assert named_verbs == [*VERBS, "all", *LOOKED_AT, *DIAGNOSIS, *HANDED_ON]


def test_the_readme_is_short_and_shows_the_report_first():
    lines = (REPO / "README.md").read_text().splitlines()
    assert len(lines) <= 150
    assert any(line.startswith("![") for line in lines[:20])
