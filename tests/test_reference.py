"""docs/case_file.md names every key of a case file, with its default."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from calibrator.case.lab import WITH_CONDITION
from calibrator.case.reference import keys_of, renewed
from calibrator.case.toml import KEYS, SECTIONS
from calibrator.errors import CalibratorError

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "case_file.md").read_text()


def test_the_page_has_every_key_with_its_default():
    assert renewed(PAGE) == PAGE, "call python -m calibrator.case.reference docs/case_file.md"
    headings = "\n".join(line for line in PAGE.splitlines() if line.startswith("## "))
    for section in {*SECTIONS, "parameters", "targets"} - {"cluster"}:
        assert re.search(rf"`\[{section}[].]", headings), f"no section on [{section}]"
    for key in KEYS:
        assert re.search(rf"`{key}`|`\[{key}[].]", PAGE), f"nothing on {key}"


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("| `samples` | 5 |", "| `sample` | 5 |", "no key sample: take its row out"),
        ("| `samples` | 5 |", "| samples | 5 |", "has a key samples: give it a row"),
    ],
)
def test_a_key_too_many_or_too_few_is_refused(old, new, why):
    assert old in PAGE
    with pytest.raises(CalibratorError, match=why):
        renewed(PAGE.replace(old, new))


def test_the_command_writes_the_defaults_and_leaves_the_words(tmp_path):
    path = tmp_path / "page.md"
    path.write_text(PAGE.replace("| `samples` | 5 |", "| `samples` | 6 |"))
    subprocess.run([sys.executable, "-m", "calibrator.case.reference", path], check=True)
    assert path.read_text() == PAGE


def test_the_example_of_the_cluster_page_has_the_defaults():
    (block,) = re.findall(r"^```toml\n(.*?)^```$", (DOCS / "cluster.md").read_text(), re.M | re.S)
    example = tomllib.loads(block)["cluster"]
    assert set(example) == SECTIONS["cluster"].__dataclass_fields__.keys() - {"shell"}
    defaults = keys_of("cluster")
    for key in ("slice_minutes", "most_tasks", "grace"):
        assert defaults[key] == f"{example[key]:g}"


def test_the_page_has_every_column_of_a_lab_file():
    assert [
        line.split("|")[1].strip()
        for line in PAGE.split("## Top")[0].splitlines()[1:]
        if line.startswith("| ")
    ] == [
        "column",
        *WITH_CONDITION,
        "days",
    ]
