"""summary.json: a published format, and each outcome survives the way to disk and back."""

import json
from pathlib import Path

import jsonschema
import pytest

from calibrator.case.codec import build, plain
from calibrator.cli import main
from calibrator.summary import OUTCOMES, schema

PUBLISHED = Path(__file__).resolve().parent.parent / "docs" / "summary.schema.json"


@pytest.fixture(scope="module")
def summary(tmp_path_factory):
    """What all verbs of a calibration note, on the fake YADE."""
    folder = tmp_path_factory.mktemp("summary")
    with pytest.MonkeyPatch.context() as patch:
        from tests.conftest import CASE, LAB, fake_programs

        patch.setenv("PATH", str(fake_programs(folder / "bin")), prepend=":")
        (folder / "lab.csv").write_text(LAB)
        (folder / "toy.toml").write_text(CASE.replace("sets = 14", "sets = 8"))
        main(["all", str(folder / "toy.toml"), "--results", str(folder)])
    return json.loads((folder / "toy" / "summary.json").read_text())


def test_the_published_schema_is_that_of_the_outcomes():
    text = json.dumps(schema(), indent=1) + "\n"
    assert PUBLISHED.read_text() == text, "run: python -m calibrator.summary > docs/" + (
        PUBLISHED.name
    )
    jsonschema.Draft202012Validator.check_schema(schema())


def test_what_the_verbs_note_follows_the_published_schema(summary):
    assert {"check", "plan", "run", "calibrate", "verify", "validate", "report"} <= set(summary)
    jsonschema.validate(summary, json.loads(PUBLISHED.read_text()))


@pytest.mark.parametrize("verb", ["check", "plan", "run", "calibrate", "verify", "validate"])
def test_an_outcome_survives_the_way_to_disk_and_back(summary, verb):
    assert plain(build(OUTCOMES[verb], summary[verb], verb)) == summary[verb]


def test_the_option_json_prints_what_is_noted(tmp_path, write_case, fake_yade, capsys):
    path, results = write_case(("sets = 14", "sets = 3")), tmp_path / "results"
    assert main(["plan", str(path), "--results", str(results), "--json"]) == 0
    noted = json.loads((results / "toy" / "summary.json").read_text())["plan"]
    assert json.loads(capsys.readouterr().out) == noted
