"""The verb `card` on the toy case, and the cards that the project ships."""

import json
from pathlib import Path

import jsonschema
import pytest

from calibrator.case.codec import build, plain
from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.handover.card import CITATION, Card
from calibrator.handover.card_page import card_page
from calibrator.handover.write_card import make_card, schema, write_card
from calibrator.plan.run import collect, run_plan
from calibrator.search.calibrate import calibrate
from calibrator.search.outcome import rests_on
from calibrator.verification.verify import validate, verify
from tests.conftest import LAB, space_for

REPO = Path(__file__).resolve().parents[2]
PUBLISHED = REPO / "docs" / "card.schema.json"
CARDS = sorted((REPO / "cards").glob("*.json"))
AGAIN = "python -m calibrator.cli card cases/{}.toml --out cards, after the verb all on it"


def test_the_published_schema_is_that_of_the_card():
    text = json.dumps(schema(), indent=1) + "\n"
    assert PUBLISHED.read_text() == text, (
        "run: python -m calibrator.handover > docs/card.schema.json"
    )
    jsonschema.Draft202012Validator.check_schema(schema())


def test_a_card_says_what_was_done_and_what_was_not(space):
    with pytest.raises(CalibratorError, match="calibrate has not been done yet"):
        make_card(space)
    found = calibrate(space)
    card = make_card(space)
    assert card.verified is None and card.validated is None
    assert {c.verdict for c in card.compared} == {"no fresh run"}
    roles = {c.key: c.role for c in card.compared}
    assert (
        roles["hourglass.bulk_density"] == "calibrate"
        and list(roles.values()).count("held_out") == 2
    )
    assert all((c.predicted is None) == (c.role == "held_out") for c in card.compared)
    values = {v.name: v for v in card.values}
    for profile in found.identifiability.parameters:
        own = values[profile.name]
        assert own.calibrated and own.interval_95 == profile.interval_95
        assert own.value == found.compromise.parameters[profile.name]
    assert values["restitution"].interval == "given" and values["restitution"].pinned is None
    assert card.reproduce[0] == "calibrator all toy.toml", "no folder of this machine"


def test_verdicts_and_what_follows_from_them_stand_on_the_card(space):
    calibrate(space)
    verified, validated = verify(space), validate(space)
    card = make_card(space)
    verdict = verified.candidates["compromise"]
    assert card.verified == verdict.passed and card.validated == validated.passed
    rows = {c.key: c for c in card.compared}
    for one in (*verdict.responses, *validated.responses):
        row = rows[one.key]
        assert (row.simulated, row.verdict, row.runs) == (one.simulated, one.verdict, one.runs)
        said = " ".join(card.valid_for if one.verdict == "met" else card.not_calibrated_for)
        assert one.key in said
    passed = {m.label: m.verified for m in card.family if not m.label.startswith("accepted")}
    assert passed == {n: v.passed for n, v in verified.candidates.items()}


def test_the_family_is_spread_over_what_the_targets_accept(space):
    found = calibrate(space)
    card, names = make_card(space, "B"), space.case.problem.names
    assert card.candidate == "individual B" == card.family[0].label
    accepted = [m for m in card.family if m.label.startswith("accepted")]
    assert len(accepted) == 8
    clouds = found.identifiability.accepted
    for member in accepted:
        point = [member.parameters[n] for n in names]
        assert (abs(clouds / point - 1).max(axis=1) < 1e-4).any()
    for i, name in enumerate(names):
        own = [m.parameters[name] for m in accepted]
        assert max(own) - min(own) > 0.5 * (clouds[:, i].max() - clouds[:, i].min())


def test_where_no_set_agrees_with_the_targets_there_is_no_family(write_case, tmp_path, fake_yade):
    path = write_case(("sets = 14", "sets = 8"), lab=LAB.replace("1605.6", "1800"))
    space = space_for(path, tmp_path / "results")
    for verb in (run_plan, collect, calibrate):
        verb(space)
    card = make_card(space)
    assert not any(m.label.startswith("accepted") for m in card.family)
    assert "No parameter set agrees" in card.family_note
    assert all(v.interval_95 is None for v in card.values)


def test_the_command_writes_a_card_that_can_be_read_again_and_its_page(space, tmp_path, capsys):
    calibrate(space)
    out = tmp_path / "cards"
    results = ["--results", str(space.path.parent)]
    assert main(["card", str(space.case.path), *results, "--out", str(out)]) == 0
    assert "NOT VERIFIED" in capsys.readouterr().out
    table = json.loads((out / "toy.json").read_text())
    jsonschema.validate(table, json.loads(PUBLISHED.read_text()))
    card = build(Card, table, "card")
    assert plain(card) == table == plain(make_card(space))
    page = (out / "toy.html").read_text()
    assert page == card_page(card) and "NOT VERIFIED" in page
    done = write_card(space)
    assert done.card == space.path / "card.json" and done.page.exists()


def test_what_is_to_be_cited_is_what_the_project_asks_for():
    asked = (REPO / "CITATION.cff").read_text()
    for word in ("10.1016/j.apt.2018.03.001", "yade-dem.org", "The DEM calibrator developers"):
        assert word in asked
        assert word in " ".join(CITATION.text) and word in CITATION.bibtex
    for line in asked.splitlines():
        if line.strip().startswith("title:"):
            assert line.partition('"')[2].removesuffix('"') in CITATION.bibtex


# The cards that come with the project


def test_the_demo_has_a_card():
    assert "coarse_sand" in {path.stem for path in CARDS}


@pytest.mark.parametrize("path", CARDS, ids=lambda p: p.stem)
def test_a_shipped_card_follows_the_schema_and_fits_its_page_and_its_case(path):
    again = AGAIN.format(path.stem)
    table = json.loads(path.read_text())
    jsonschema.validate(table, json.loads(PUBLISHED.read_text()))
    card, case = build(Card, table, "card"), read_case(REPO / "cases" / f"{path.stem}.toml")
    assert path.with_suffix(".html").read_text() == card_page(card), again
    now = rests_on(case, [])
    was = card.provenance.fingerprint
    assert {n: h for n, h in was.items() if n != "runs"} == {
        n: h for n, h in now.items() if n != "runs"
    }, again
    assert card.reproduce[0] == f"calibrator all cases/{path.name.replace('.json', '.toml')}"


@pytest.mark.yade
@pytest.mark.slow
def test_the_demo_s_card_is_made_again_from_its_shipped_runs(tmp_path):
    """All but the fresh runs; one run takes the place of one that clogged, and is made here."""
    space = space_for(REPO / "cases" / "coarse_sand.toml", tmp_path)
    for verb in (run_plan, collect, calibrate):
        verb(space)
    made = plain(make_card(space))
    shipped = json.loads((REPO / "cards" / "coarse_sand.json").read_text())
    assert made["provenance"] == shipped["provenance"]
    assert made["vessels"] == shipped["vessels"]
    for ours, theirs in zip(made["values"], shipped["values"], strict=True):
        for key in ("value", "interval_95", "searched"):
            assert close(ours[key], theirs[key]), ours["name"]
    # which members of the front stand for it hangs on last digits, which no two processors share
    assert [one["label"] for one in made["family"]] == [one["label"] for one in shipped["family"]]
    bounds = {one["name"]: one["searched"] for one in shipped["values"]}
    compromise = shipped["family"][0]["parameters"]
    assert made["family"][0]["parameters"] == pytest.approx(compromise, rel=1e-3)
    for one in made["family"]:
        for name, value in one["parameters"].items():
            assert bounds[name][0] <= value <= bounds[name][1]
    for ours, theirs in zip(made["compared"], shipped["compared"], strict=True):
        for key in ("key", "measured", "role", "predicted", "predicted_error"):
            assert close(ours[key], theirs[key])


def close(ours, theirs):
    """Equal, or numbers that agree to a thousandth."""
    plain_kinds = (str, type(None))
    if isinstance(ours, plain_kinds) or isinstance(theirs, plain_kinds):
        return ours == theirs
    return ours == pytest.approx(theirs, rel=1e-3)
