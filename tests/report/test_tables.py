"""Tables of a page: sentences wrap, numbers stay numbers, and each is a CSV file on demand."""

import base64
import csv
import io
import re

from calibrator.case.problem import Target
from calibrator.report.html import folded, mark, page, section, table
from calibrator.report.overview import _compared, _in_errors
from calibrator.report.words import number
from calibrator.verification.outcome import Comparison

DASH = number(None)
ROWS = [
    ["rolling <b>friction</b>", "0.26", "a sentence that is far too long for one line of a table"],
    ["density [kg/m³]", "-1590", '<span class="no">✗ no, &quot;not&quot; at all</span>'],
]


def test_a_table_holds_its_rows_as_csv_without_marks():
    made = table("Values", ["name", "value", "meaning"], ROWS)
    data = re.search(r'href="data:text/csv;charset=utf-8;base64,([^"]+)"', made).group(1)
    read = list(csv.reader(io.StringIO(base64.b64decode(data).decode("utf-8-sig"))))
    assert read[0] == ["name", "value", "meaning"]
    assert read[1][:2] == ["rolling friction", "0.26"]
    assert read[2] == ["density [kg/m³]", "-1590", '✗ no, "not" at all']
    assert float(read[2][1]) == -1590
    assert 'download="values.csv"' in made


def test_two_lines_of_a_cell_stay_apart_in_the_csv():
    made = table("Values", ["name", "value"], [["a", "1589 ± 4<br>+0.06 %"]])
    data = re.search(r'href="data:text/csv;charset=utf-8;base64,([^"]+)"', made).group(1)
    assert "1589 ± 4; +0.06 %" in base64.b64decode(data).decode("utf-8-sig")


def test_values_with_errors_and_per_cents_are_numbers_in_the_csv():
    rows = [["a", "1588.4 ± 0.9", "+0.3\u00a0%", "5 of 5"], ["b", DASH, "-3.6\u00a0%", "4 of 5"]]
    made = table("Values", ["name", "measured", "off by", "runs"], rows)
    data = re.search(r'href="data:text/csv;charset=utf-8;base64,([^"]+)"', made).group(1)
    read = list(csv.reader(io.StringIO(base64.b64decode(data).decode("utf-8-sig"))))
    assert read[0] == ["name", "measured", "measured ±", "off by [%]", "runs"]
    assert read[1] == ["a", "1588.4", "0.9", "+0.3", "5 of 5"] and read[2][1:3] == [DASH, ""]


def test_columns_of_sentences_are_set_as_sentences_and_no_others():
    made = table("Values", ["name", "value", "meaning"], ROWS)
    assert made.count('class="words"') == 3  # a heading and two cells
    assert '<td class="words">a sentence' in made and "<td>0.26</td>" in made


def test_a_page_links_to_its_sections_and_folds_what_is_asked():
    made = page(
        "Title", [section("The answer", "<p>a</p>"), section("What for?", folded("More", "b"))]
    )
    assert '<a href="#the-answer">The answer</a><a href="#what-for">What for?</a>' in made
    assert '<section id="what-for">' in made and "<details><summary>More</summary>" in made


def comparison(**changed):
    base = dict(
        key="hourglass.bulk_density",
        target=1600.0,
        target_error=3.0,
        scale=1600.0,
        predicted=1601.0,
        predicted_error=2.0,
        simulated=1610.0,
        scatter=8.0,
        standard_error=4.0,
        runs=5,
        attempted=6,
        relative_error=10 / 1600,
        band=16.0,
        passed=True,
        undecided=False,
        reported_only=False,
        promise_kept=True,
    )
    return Comparison(**{**base, **changed})


def test_the_overview_says_how_far_a_target_is_off_in_its_errors():
    target = Target("hourglass", "bulk_density", 1600.0, 6.0, 4)
    row = _compared(target, comparison(), "calibrate")
    assert row[2:] == ["1600 ± 3", "1610 ± 4", "+0.6\u00a0%", "+2.0", "5 of 6", "calibrate"]
    assert "met" in row[1]
    unknown = _compared(target, comparison(standard_error=None), "calibrate")
    assert unknown[5] == DASH and unknown[3] == "1610"
    none = _compared(target, comparison(simulated=None, relative_error=None, passed=False), "x")
    assert "not measured" in none[1] and none[3:6] == [DASH] * 3
    undecided = _compared(target, comparison(passed=False, undecided=True), "x")
    assert "cannot tell" in undecided[1]
    assert _in_errors(1.0, 0.0, 0.0) == DASH


def test_a_verdict_that_is_open_bears_no_cross():
    assert "? cannot tell" in mark(False, "met", "cannot tell", undecided=True)
    assert "✗ missed" in mark(False) and "✓ met" in mark(True)
