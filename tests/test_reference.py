"""docs/case_file.md names every key of a case file, with its default."""

import dataclasses
import re
from pathlib import Path

import pytest

from calibrator.case.lab import WITH_CONDITION
from calibrator.case.problem import Parameter, Target
from calibrator.case.toml import SECTIONS

PAGE = (Path(__file__).parents[1] / "docs" / "case_file.md").read_text()
CLASSES = {
    **{name: cls for name, cls in SECTIONS.items() if name != "cluster"},
    "parameters": Parameter,
    "targets": Target,
}
# headings, lab file
NOT_KEYS = {
    "parameters": {"name"},
    "targets": {"setup", "response", "value", "scatter", "replicates"},
}


def rows(section):
    """{key: default as printed} of the tables of a section of the page."""
    parts = re.split("^## ", PAGE, flags=re.M)
    (text,) = [part for part in parts if re.search(rf"`\[{section}[].]", part.splitlines()[0])]
    cells = [line.split("|")[1:3] for line in text.splitlines() if line.startswith("| `")]
    return {
        key: default.strip() for names, default in cells for key in re.findall("`(.+?)`", names)
    }


@pytest.mark.parametrize("section", CLASSES)
def test_the_page_has_every_key_with_its_default(section):
    printed = rows(section)
    fields = [
        f for f in dataclasses.fields(CLASSES[section]) if f.name not in NOT_KEYS.get(section, ())
    ]
    assert set(printed) == {f.name for f in fields}
    for f in fields:
        own = printed[f.name]
        if isinstance(f.default, tuple):
            assert own == "all" or own == ", ".join(f.default)
        elif f.default is dataclasses.MISSING:
            assert own == ("required" if f.default_factory is dataclasses.MISSING else "none")
        else:
            assert own.split(" (")[0] == (
                "none"
                if f.default == ""
                else f"{f.default:g}"
                if isinstance(f.default, float)
                else str(f.default).lower()
            )


def test_the_page_has_every_column_of_a_lab_file():
    assert [
        line.split("|")[1].strip()
        for line in PAGE.split("## Top")[0].splitlines()[1:]
        if line.startswith("| ")
    ] == [
        "column",
        *WITH_CONDITION,
    ]
