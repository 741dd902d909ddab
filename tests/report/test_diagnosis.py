"""The page of a diagnosis: verdict first, every observable in one table, nothing left to guess."""

import base64
import csv
import dataclasses
import io
import re
import shutil

import pytest

from calibrator.diagnosis.verdict import AMBIGUOUS, UNKNOWN
from calibrator.report.beside import link_pages
from calibrator.report.diagnosis import write_diagnosis
from calibrator.report.page import write_report
from calibrator.report.verdict import doubts, how_sure, next_of, verdict_of
from calibrator.report.words import key_words
from calibrator.runs.workspace import Workspace
from tests.report.made_up import diagnosed
from tests.report.outline import Outline


def answer_of(page):
    return Outline(re.search(r'<div class="answer">.*?</div>', page, re.DOTALL).group(0)).text


def test_the_first_screen_has_verdict_certainty_doubts_and_the_next_step(named):
    _, found, page = named
    size = found.explanations[1].amplitudes["bond_number"]
    said = answer_of(page)
    assert "Missing from the model: adhesion (bond_number = 0." in said and size.error
    for words in (
        "How sure: A disagreement as large comes by chance with p =",
        "Probability among",
        "Doubtful: ",
        "Next: calibrate with it, by calibrator run",
        "refuted if",
    ):
        assert words in said, words
    assert page.index('class="answer"') < page.index("<table") < page.index("<img")


def test_one_table_has_every_observable_without_and_with_the_effect(named):
    _, found, page = named
    data = re.search(
        r'download="every-observable[^"]*" href="data:text/csv;charset=utf-8;base64,([^"]+)"', page
    ).group(1)
    head, *rows = csv.reader(io.StringIO(base64.b64decode(data).decode("utf-8-sig")))
    assert head == [
        "observable",
        "used to",
        "measured",
        "measured ±",
        "model as it is",
        "off by, in standard errors",
        "with adhesion",
        "off by, in standard errors",
    ]
    assert len(rows) == len(found.observables)
    for row, one in zip(rows, found.observables, strict=True):
        assert row[0].startswith(key_words(one.key))
        assert row[1] == ("fit" if one.used else "check" if one.held_out else "not used")
        assert float(row[4]) == pytest.approx(one.simulated[0], rel=2e-3)
        assert [float(row[5]), float(row[7])] == pytest.approx(one.z[:2], abs=0.051)
    assert any(abs(float(row[5])) > 2 for row in rows)
    assert page.count('<span class="no">') >= sum(abs(o.z[0]) > 2 for o in found.observables)


def test_the_page_needs_nothing_but_itself_and_every_figure_says_what_it_shows(named):
    space, _, page = named
    outline = Outline(page)
    assert not outline.outside("diagnosis_figures")
    said = " ".join(a["alt"] for tag, a in outline.tags if tag == "img")
    assert len(list((space.path / "diagnosis_figures").glob("*.png"))) == page.count("<img")
    for words in (
        "observables are more than 2 off, most of all",
        "with adhesion, ",
        "experiments disagree with the others",
        "standard errors, of",
        "Most alike are",
        "The most probable explanation is adhesion with probability",
        "removes",
        "noise alone would leave",
        "would be seen",
    ):
        assert words in said, words
    assert "<details>" in page and page.count('class="csv"') >= 5


@pytest.mark.parametrize("page", ["whole", "named"])
def test_numbers_of_tables_stay_numbers_when_they_are_copied(request, page):
    cells = re.findall(r"<td[^>]*>(.*?)</td>", request.getfixturevalue(page)[2])
    values = [cell for cell in cells if re.search("[0-9]", cell)]
    other = "[\\u2212\\u2070\\u00b9\\u00b2\\u00b3\\u2074-\\u2079\\u207b]"  # minus, superscripts
    assert len(values) > 50 and not [cell for cell in values if re.search(other, cell)]


def test_nothing_missing_and_a_box_that_is_too_small_are_said_first(tmp_path):
    for name, hidden, words in (
        ("none", {}, "Nothing is missing: the model meets the measurements"),
        ("far", {"rolling_friction": 0.6}, "Out of bounds: within its bounds"),
    ):
        (tmp_path / name).mkdir()
        space, _ = diagnosed(tmp_path / name, **hidden)
        said = answer_of((space.path / "diagnosis.html").read_text())
        assert words in said and "Next: " in said
        assert ("widen the bounds" in said) is (name == "far")
        assert ("would have been seen" in said) is (name == "none")


def test_what_cannot_be_told_is_not_told_as_a_name(named):
    space, found, _ = named
    for verdict, effects, words in (
        (AMBIGUOUS, ("bond_number", UNKNOWN), "adhesion or something unknown"),
        (UNKNOWN, (), "no effect of the library explains it"),
    ):
        other = dataclasses.replace(found, verdict=verdict, effects=effects, following="")
        assert words in verdict_of(other) and "Missing from" not in verdict_of(other)
        assert "Probability" not in how_sure(other) and "measure" in next_of(space, other)
    noted = dataclasses.replace(found, notes=("a", "b"))
    assert "2 notes stand at the end" in doubts(noted)


def test_the_two_pages_of_a_folder_link_to_each_other(whole, named, tmp_path):
    shutil.copytree(whole[0].path, tmp_path / "results")
    space = Workspace(whole[0].case, tmp_path / "results")
    report, diagnosis = space.path / "report.html", space.path / "diagnosis.html"
    assert "diagnosis.html" not in report.read_text()
    write_diagnosis(space, named[1])
    assert '<a class="page" href="diagnosis.html">Diagnosis</a>' in report.read_text()
    assert '<a class="page" href="report.html">Calibration</a>' in diagnosis.read_text()
    write_report(space)
    assert report.read_text().count('href="diagnosis.html"') == 1
    diagnosis.unlink()
    link_pages(space.path)
    assert "diagnosis.html" not in report.read_text()
