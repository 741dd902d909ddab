"""The text for a paper: this case's own numbers, and right things to cite."""

import re
from pathlib import Path

import pytest

from calibrator import __version__
from calibrator.report.methods import ENTRIES, bibliography
from calibrator.report.model import dates
from calibrator.report.page import write_report
from calibrator.report.words import number
from calibrator.runs.record import Record
from calibrator.search.outcome import current_calibration
from tests.report.made_up import calibrated, workspace
from tests.report.outline import Outline

REPO = Path(__file__).resolve().parents[2]


def test_the_text_holds_the_numbers_of_this_case_and_names_what_was_used(whole):
    space, _, page = whole
    said = (space.path / "methods.md").read_text()
    for value in current_calibration(space).compromise.parameters.values():
        assert number(value) in said
    for words in (
        "population 40, 8 generations", "seed 1", "14 sets of a Sobol sequence with 2 replicates",
        "YADE 2023.02a", "Hertz' normal force", "Mindlin's shear stiffness", "mu_r R_eff |F_n|",
        "% of the Rayleigh time", "O1, sum of the weighted relative errors", "O2, linear measure",
        "particle density", "restitution", "hourglass (", "The verification passed",
        f"DEM calibrator {__version__}", "Gaussian processes", "abc123",
    ):  # fmt: skip
        assert words in said, words
    assert " ".join(said.split()) in Outline(page).text


def test_an_unverified_set_is_not_said_to_be_verified(tmp_path):
    space = calibrated(workspace(tmp_path), curves=False)
    write_report(space)
    said = (space.path / "methods.md").read_text()
    assert "has not been verified by fresh runs" in said and "passed" not in said


def test_the_references_are_those_that_the_text_cites_each_once(whole):
    space, _, _ = whole
    said, cited = ((space.path / name).read_text() for name in ("methods.md", "references.bib"))
    keys = re.findall(r"^@\w+\{(\w+),$", cited, re.MULTILINE)
    assert sorted(keys) == sorted(set(re.findall(r"(?<=[\[ ])@(\w+)", said)))
    assert cited.count("{") == cited.count("}")
    assert bibliography("hourglass@wide_neck is no citation") == ""
    with pytest.raises(KeyError, match="nobody_1900"):
        bibliography("as [@nobody_1900] says")


def test_every_entry_names_who_when_and_where():
    for entry in re.split(r"^(?=@)", ENTRIES, flags=re.MULTILINE)[1:]:
        kind, key = re.match(r"@(\w+)\{(\w+),", entry).groups()
        wanted = {"article": ("journal", "volume", "pages", "year"), "book": ("publisher", "year")}
        for field in ("title", "author", *wanted.get(kind, ())):
            assert re.search(rf"^  {field} = \{{.+\}},?$", entry, re.MULTILINE), (key, field)
    assert "VERSION" not in ENTRIES and f"version = {{{__version__}}}" in ENTRIES


def test_project_and_method_are_cited_as_the_citation_file_says():
    asked = (REPO / "CITATION.cff").read_text()
    title, paper = re.findall(r'title: "(.+)"', asked)[:2]
    assert f"title = {{{title}}}" in ENTRIES and f"title = {{{paper}}}" in ENTRIES
    assert f"doi = {{{re.search('doi: (.+)', asked).group(1)}}}" in ENTRIES


def test_the_model_is_stated_on_the_page(whole):
    text = Outline(whole[2]).text
    for words in (
        "particle density, rho_p [kg/m³] 2650 default", "Poisson's ratio, nu 0.3 default",
        "restitution, e 0.9 default", "calibrated", "core-seconds per run", "3 4 runs",
        "time step [s]", "Contacts in YADE: Hertz' normal force",
    ):  # fmt: skip
        assert words in text, words


def test_dates_are_those_of_the_runs_that_have_one():
    def run(**provenance):
        return Record(None, "ok", provenance=provenance)

    day = 86400.0
    assert "not recorded" in dates([run(), run(yade="x")])
    assert dates([run(started=day)]) == "The 1 runs that were made here are of 1970-01-02 (UTC)."
    assert "1970-01-02 to 1970-01-11" in dates([run(started=10 * day), run(started=day)])
