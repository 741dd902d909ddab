"""Cheap runs carry dear ones, from the case file to the page, in a world with a known answer."""

import json
import math

import pytest

from calibrator.case.toml import read_case
from calibrator.check import check_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.plan.requests import cheap_share, plan_requests
from calibrator.plan.run import all_records, cheap_records, database_records, run_plan
from calibrator.search.calibrate import calibrate
from tests import fake_yade
from tests.conftest import space_for
from tests.stand_in import World, put_in_place

FINE, COARSE = 1e-3, 2e-3
TRUTH = {"rolling_friction": 0.17, "sliding_friction": 0.58}
KEYS = ("hourglass.mass_flow_rate", "hourglass.drained_equivalent_angle_deg")
CASE = """
name = "toy"
measured = "lab.csv"
[parameters.rolling_friction]
low = 0.05
high = 0.45
[parameters.sliding_friction]
low = 0.2
high = 0.7
[fixed]
young_modulus = 3e6
[plan]
design = "{design}"
sets = {sets}
replicates = 2
replicated_sets = 4
most_runs = 300
[fidelity]
dear_sets = 5
dear_runs = 60
[fidelity.values]
particle_radius = 2e-3
[search]
population = 60
generations = 15
repeats = 1
[verify]
replicates = 4
spread_replicates = 0
[run]
jobs = 1
"""


def like(setup, p, seed):
    """Coarse grains stand steeper and pack looser, by a share that depends on friction a little."""
    found = fake_yade.responses_of(setup, p)
    if p["particle_radius"] == COARSE:
        found = {
            n: v * (1.15 + 0.1 * p["rolling_friction"]) if "angle" in n else 0.97 * v
            for n, v in found.items()
        }
    return found


def unlike(setup, p, seed):
    """Coarse grains bridge, and say nothing of what fine ones do."""
    found = fake_yade.responses_of(setup, p)
    if p["particle_radius"] == COARSE:
        wave = (37 * p["rolling_friction"] % 1) + (23 * p["sliding_friction"] % 1)
        found = {n: v * (0.8 + 0.2 * wave) for n, v in found.items()}
    return found


def bumpy(setup, p, seed):
    """A rougher surface, which both kinds share."""
    found = fake_yade.responses_of(setup, p)
    wave = 1 + 0.15 * math.sin(14 * p["rolling_friction"] + 6 * p["sliding_friction"])
    return {n: v * wave if "angle" in n else v for n, v in found.items()}


def lab(of=like):
    """What a laboratory with fine grains measured, without noise."""
    p = {**TRUTH, "young_modulus": 3e6}
    rows = [
        ("hourglass", "mass_flow_rate", "kg/s", "calibrate"),
        ("hourglass", "drained_equivalent_angle_deg", "deg", "calibrate"),
        ("conical_pile", "pile_equivalent_angle_deg", "deg", "held_out"),
    ]
    lines = ["setup,response,value,scatter,replicates,unit,role"]
    for setup, name, unit, role in rows:
        value = of(setup, {**p, "particle_radius": FINE}, 0)[name]
        lines.append(f"{setup},{name},{value!r},{0.004 * value:.3g},8,{unit},{role}")
    return "\n".join(lines) + "\n"


def write(folder, *changes, design="sobol", sets=24, of=like):
    """The case and its lab file, with replacements [(old, new), ...]; returns the case's path."""
    text = CASE.format(design=design, sets=sets)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "lab.csv").write_text(lab(of))
    path = folder / "toy.toml"
    path.write_text(text)
    return path


def radii(records):
    return {r.request.value("particle_radius") for r in records}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The results of all verbs."""
    folder = tmp_path_factory.mktemp("fidelity")
    with pytest.MonkeyPatch.context() as patch:
        made = put_in_place(patch, World(like))
        path = write(folder)
        assert main(["all", str(path), "--results", str(folder / "results")]) == 0
    return space_for(path, folder / "results"), made.made


def summary_of(space):
    return json.loads((space.path / "summary.json").read_text())


def test_many_cheap_runs_and_few_full_ones_find_the_frictions(done):
    space, made = done
    found = summary_of(space)["calibrate"]
    for profile in found["identifiability"]["parameters"]:
        low, high = profile["interval_95"]
        assert low <= TRUTH[profile["name"]] <= high
        assert profile["pinned"]
    assert found["statuses"] == {"ok": 9}  # five sets in full, four of them twice
    assert len(made) == 9 + 28 + 4 + 3  # and cheap ones, verification, validation


def test_verification_is_on_full_runs(done):
    space, made = done
    fresh = [r for r in made if int(r.parameters["seed"]) >= 500_000 and "sets" not in r.setup]
    fresh = [r for r in fresh if int(r.parameters["seed"]) < 1_000_000]
    assert len(fresh) == 7 and {r.value("particle_radius") for r in fresh} == {FINE}
    assert summary_of(space)["verify"]["passed"]


def test_the_two_kinds_are_told_apart_and_share_no_seed(done):
    space, _ = done
    full, cheap = database_records(space), cheap_records(space)
    assert radii(full) == {FINE} and radii(cheap) == {COARSE}
    assert len(full) == 9 and len(cheap) == 28
    assert len(all_records(space)) == 37
    seeds = [{r.request.parameters["seed"] for r in own} for own in (full, cheap)]
    assert not seeds[0] & seeds[1]


def test_the_outcome_and_the_page_say_what_each_kind_said(done):
    space, _ = done
    kinds = {one["key"]: one for one in summary_of(space)["calibrate"]["fidelity"]}
    angle = kinds["hourglass.drained_equivalent_angle_deg"]
    assert angle["full"] == 9 and angle["cheap"] == 28
    assert angle["slope"] == pytest.approx(1 / 1.17, abs=0.1)
    assert angle["difference"] == pytest.approx(-0.17 * 45, abs=2)
    assert angle["error_with"] < angle["error_without"]
    assert angle["cost"] == pytest.approx(cheap_share(space.case)) and angle["cost"] < 0.25
    page = (space.path / "report.html").read_text()
    assert "Full and cheap runs" in page and "left out" in page
    said = (space.path / "methods.md").read_text()
    assert "The plan was 5 sets of a Sobol sequence" in said
    assert "28 cheaper runs with particle radius 0.002 m" in said
    assert "kennedy_ohagan_2000" in (space.path / "references.bib").read_text()
    assert "9 good runs at 5 parameter sets beside 28 cheap ones" in page


def test_the_database_holds_both_and_serves_as_a_start(done, tmp_path, monkeypatch):
    space, _ = done
    made = put_in_place(monkeypatch, World(like))
    text = (space.path / "database.csv").read_text()
    (tmp_path / "runs.csv").write_text(text)
    path = write(tmp_path, ("jobs = 1", 'jobs = 1\nshipped = "runs.csv"'))
    again = space_for(path, tmp_path / "results")
    assert run_plan(again).from_shipped_database == 37 and not made.made
    first = summary_of(space)["calibrate"]["candidates"]["compromise"]["parameters"]
    assert calibrate(again).compromise.parameters == first


def test_cheap_runs_that_mislead_are_named_and_left_aside(tmp_path, monkeypatch):
    put_in_place(monkeypatch, World(unlike))
    path = write(
        tmp_path, ("dear_sets = 5", "dear_sets = 16"), ("dear_runs = 60", "dear_runs = 99")
    )
    space = space_for(path, tmp_path / "results")
    run_plan(space)
    found = calibrate(space)
    assert [kinds.misleads for kinds in found.fidelity] == [True, True]
    assert sum("mislead" in line for line in found.lines()) == 2
    for profile in found.identifiability.parameters:
        low, high = profile.interval_95
        assert low <= TRUTH[profile.name] <= high


def test_an_adaptive_design_spends_cheap_runs_where_they_tell_more(tmp_path, monkeypatch):
    made = put_in_place(monkeypatch, World(bumpy, noise=0.002))
    narrow = "\n".join(f'[targets."{key}"]\ntolerance = 0.01' for key in KEYS)
    changes = ("dear_sets = 5", "dear_sets = 3"), ("[search]", f"{narrow}\n[search]")
    path = write(tmp_path, *changes, design="adaptive", sets=5, of=bumpy)
    space = space_for(path, tmp_path / "results")
    outcome = run_plan(space)
    assert outcome.ended == "confirmed"
    lines = [json.loads(x) for x in (space.path / "proposals.jsonl").read_text().splitlines()]
    own = [{r["parameters"].get("particle_radius", FINE) for r in x["requests"]} for x in lines]
    assert {COARSE} in own
    for kinds, line in zip(own, lines, strict=True):
        assert ("a cheap run" in line["sentence"]) == (kinds == {COARSE})
        assert line["kind"] == "explore" or kinds == {FINE}
    before = len(made.made)
    assert run_plan(space) == outcome and len(made.made) == before


def test_full_runs_are_never_more_than_asked_for(tmp_path, monkeypatch):
    made = put_in_place(monkeypatch, World(like, noise=0.03))
    changes = ("dear_runs = 60", "dear_runs = 12"), ("dear_sets = 5", "dear_sets = 4")
    space = space_for(write(tmp_path, *changes, design="adaptive", sets=6), tmp_path / "results")
    run_plan(space)
    assert sum(r.value("particle_radius") == FINE for r in made.made) <= 12


def test_check_and_plan_count_both_kinds(tmp_path, monkeypatch):
    put_in_place(monkeypatch, World(like))
    path = write(tmp_path)
    checked = check_case(space_for(path, tmp_path / "results"))
    assert checked.runs == 37 == len(plan_requests(read_case(path)))
    main(["plan", str(path), "--results", str(tmp_path / "results")])
    tables = {p.name for p in (tmp_path / "results" / "toy" / "plan").iterdir()}
    assert tables == {"hourglass.table", "cheap_hourglass.table"}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("particle_radius = 2e-3", ""), r"fidelity\.values is empty"),
        (("particle_radius = 2e-3", "particle_radios = 2e-3"), "did you mean particle_radius"),
        (("particle_radius = 2e-3", "particle_radius = -1.0"), "particle_radius"),
        (("particle_radius = 2e-3", "particle_radius = 1e-3"), "change nothing in hourglass"),
        (("particle_radius = 2e-3", "drum_depth = 5e-3"), "change nothing in hourglass"),
        (("particle_radius = 2e-3", "rolling_friction = 0.1"), "is calibrated"),
        (("particle_radius = 2e-3", "seed = 3"), "what the plan sets"),
        (("dear_sets = 5", "dear_sets = 2"), "give 3 or more"),
        (("dear_sets = 5", "dear_sets = 50"), r"plan\.sets = 24 is below"),
        (("dear_sets = 5", "cheap_sets = 5"), "unknown key"),
        (('design = "sobol"', 'design = "grid"'), r"needs plan\.design"),
        (("replicates = 2", "replicates = 2\nseed = 29_000_000"), r"takes plan\.seed up to"),
        (("[search]", "[interpolation]\nsimilarity = true\n[search]"), r"\[interpolation\]"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_a_remedy(tmp_path, change, said):
    with pytest.raises(CalibratorError, match=said):
        read_case(write(tmp_path, change))


def test_cheap_runs_that_no_vessel_holds_are_refused_before_any_is_made(tmp_path, monkeypatch):
    put_in_place(monkeypatch, World(like))
    path = write(tmp_path, ("particle_radius = 2e-3", "particle_radius = 20e-3"))
    with pytest.raises(CalibratorError, match="cheap"):
        check_case(space_for(path, tmp_path / "results"))


def test_cheap_runs_that_all_fail_are_said_to_be_the_cheap_ones(tmp_path, monkeypatch):
    def clogs(setup, p, seed):
        return "clogged" if p["particle_radius"] == COARSE else "ok"

    put_in_place(monkeypatch, World(like, status_of=clogs))
    space = space_for(write(tmp_path), tmp_path / "results")
    run_plan(space)
    with pytest.raises(
        CalibratorError, match=r"no cheap run is good \(all 56 hourglass runs clogged"
    ):
        calibrate(space)
