"""The lab file as spreadsheets and data frames save it: read, or refused line by line."""

import pytest

from calibrator.case.lab import read_lab
from calibrator.errors import CalibratorError
from tests.conftest import LAB

PLAIN = LAB.split("\n", 1)[1]  # without its note
HEADER, *ROWS = PLAIN.splitlines()


def semicolons(text):
    """As a spreadsheet saves it where decimals have commas."""
    return text.replace(",", ";").replace(".", ",")


def quoted(text):
    return "".join(
        ",".join(f'"{cell}"' for cell in line.split(",")) + "\n" for line in text.splitlines()
    )


def indexed(text):
    """As a data frame saves it, with the number of each row in a column without a name."""
    head, *rows = text.splitlines()
    return "\n".join([f",{head}", *(f"{i},{row}" for i, row in enumerate(rows))]) + "\n"


SAVED = {
    "empty cells below": PLAIN + ",,,,,,\n" * 3,
    "empty cells between": PLAIN.replace("hourglass,mass", ",,,,,,\nhourglass,mass"),
    "replicates as floats": PLAIN.replace(",8,", ",8.0,"),
    "semicolons and decimal commas": semicolons(PLAIN),
    "semicolons and decimal points": PLAIN.replace(",", ";"),
    "semicolons, named so": "sep=;\n" + semicolons(PLAIN),
    "semicolons, empty cells": semicolons(PLAIN + ",,,,,,\n"),
    "tabs": PLAIN.replace(",", "\t"),
    "tabs and decimal commas": semicolons(PLAIN).replace(";", "\t"),
    "quotation marks": quoted(PLAIN),
    "quotation marks round the header": quoted(HEADER) + "\n".join(ROWS),
    "quotation marks and semicolons": quoted(PLAIN).replace('","', '";"'),
    "a quoted note": '"# made by hand, with care"\n' + quoted(PLAIN),
    "a note with commas behind it": "# by hand,,,,,,\n" + PLAIN,
    "an empty column at the end": PLAIN.replace("\n", ",\n"),
    "an empty column at the end of the rows": HEADER + "\n" + ",,\n".join(ROWS),
    "capitals in the header": HEADER.upper() + "\n" + "\n".join(ROWS),
    "a capital letter in the header": HEADER.title() + "\n" + "\n".join(ROWS),
    "blanks round the cells": PLAIN.replace(",", " , "),
    "blanks before quotation marks": quoted(PLAIN).replace(",", ", "),
    "another system's line ends": PLAIN.replace("\n", "\r\n"),
    "an old system's line ends": PLAIN.replace("\n", "\r"),
    "a data frame's index": indexed(PLAIN),
    "no line end at the end": PLAIN.rstrip("\n"),
    "columns in another order": "\n".join(
        ",".join(reversed(line.split(","))) for line in PLAIN.splitlines()
    ),
}


@pytest.fixture
def saved(tmp_path):
    def save(text, encoding="utf-8"):
        path = tmp_path / "lab.csv"
        path.write_bytes(text.encode(encoding))
        return path

    return save


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("how", SAVED)
def test_a_lab_file_that_a_program_has_saved_means_the_same(saved, how, encoding):
    assert read_lab(saved(SAVED[how], encoding)) == read_lab(saved(PLAIN))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (PLAIN.replace("1605.6", '"1,605"'), r"line 2: '1,605' has a comma; .* decimal point"),
        (PLAIN.replace("1605.6", '"1,605.6"'), r"line 2: .*write plain numbers"),
        (PLAIN.replace("46.8", '"46,8"'), "line 3: '46,8' has a comma"),
        (PLAIN.replace("46.8", "46,8"), "line 3: 8 cells instead of 7; .*a point in decimal"),
        (semicolons(PLAIN).replace("1605,6", "1.605"), "line 2: '1.605' has a point where other"),
        (semicolons(PLAIN).replace("1605,6", "1.605,6"), "line 2: .*separators of thousands"),
        (PLAIN.replace(",8,kg/s", ",8.5,kg/s"), "line 4: '8.5' is no whole number"),
        (PLAIN.replace("46.8", "468"), "line 3: .*has a decimal point slipped. .* 0 to 90 deg"),
        (PLAIN.replace("1605.6", "-1605.6"), "line 2: .*give a value of 0 or more kg/m3"),
        (PLAIN.replace(",role\n", ",rolle\n"), "lacks role: the header must be setup,"),
        (PLAIN.replace(",role\n", ",role,role\n"), "column 7 is one too many"),
        (PLAIN.replace(",role\n", ",role,remarks\n"), "column 8 is one too many"),
        (PLAIN.replace("kg/s,calibrate", "kg/s,calibrate,?"), "line 4: 8 cells instead of 7"),
        (PLAIN.replace("\n", ",,\n").replace("calibrate,,", "calibrate,,x", 1), "line 2: 9 cells"),
        (indexed(PLAIN).replace("\n3,", "\nx,"), "line 5: 'x' has no heading"),
        (PLAIN.replace("0.0001", "nan"), "line 4: .*leave the scatter empty"),
        ("", "the header must be"),
        (
            PLAIN.replace("hourglass,mass_flow_rate,0.026", "hourglass,residual_fraction,30")
            .replace("kg/s", "1"),
            "line 4: .*divide per cents by 100",
        ),
    ],
)  # fmt: skip
def test_what_could_mean_two_things_is_refused_with_its_line(saved, text, why):
    with pytest.raises(CalibratorError, match=why):
        read_lab(saved(text))


def test_every_line_that_is_wrong_is_named(saved):
    text = PLAIN.replace("1605.6", "x").replace("46.8", "468").replace("23.4", "y")
    with pytest.raises(CalibratorError) as caught:
        read_lab(saved(text))
    first, *lines = str(caught.value).splitlines()
    assert first == "3 mistakes:"
    assert [line.split("line ")[1][0] for line in lines] == ["2", "3", "6"]
