"""The verb `view` on the fake YADE: what it writes, what it does not do again, what it refuses."""

import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from calibrator.cli import main
from calibrator.plan.run import collect, run_plan
from calibrator.report.page import write_report
from calibrator.runs.database import Database
from calibrator.search.calibrate import calibrate
from calibrator.search.outcome import current_calibration
from calibrator.verification.verify import verification_requests, verify
from calibrator.view.animation import LARGEST
from calibrator.view.outcome import read_view
from tests.conftest import fake_programs, space_for
from tests.view.test_vtk import poly_data


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    """A case with finished runs and a verified calibration; its path and its workspace."""
    folder = tmp_path_factory.mktemp("viewed")
    with pytest.MonkeyPatch.context() as patch:
        from tests.conftest import CASE, LAB

        patch.setenv("PATH", str(fake_programs(folder / "bin")), prepend=":")
        (folder / "lab.csv").write_text(LAB)
        case = CASE.replace("sets = 14", "sets = 8").replace("population = 60", "population = 24")
        (folder / "toy.toml").write_text(case.replace("generations = 15", "generations = 4"))
        space = space_for(folder / "toy.toml", folder / "results")
        for verb in (run_plan, collect, calibrate, verify):
            verb(space)
        yield folder, space


@pytest.fixture
def call(calibrated, capsys):
    """Call the verb; returns exit status, output and errors."""

    def called(*more):
        folder, _ = calibrated
        frames = () if "--frames" in more else ("--frames", "4")  # drawing takes a while
        arguments = ["view", str(folder / "toy.toml"), *more, *frames, "--results"]
        status = main([*arguments, str(folder / "results")])
        return status, *capsys.readouterr()

    return called


def run_ids(space):
    return sorted(Database.read(space.path / "database.csv").records)


def calls_of(space, run_id):
    path = space.path / "views" / run_id / "run" / "calls.txt"
    return len(path.read_text().split()) if path.exists() else 0


def test_it_shows_the_recommended_set_and_makes_nothing_again_that_is_there(calibrated, call):
    space = calibrated[1]
    status, said, _ = call("--json")
    made = json.loads(said)
    assert status == 0 and made == space.summary()["view"]
    (first, *_) = verification_requests(space, current_calibration(space))["compromise"]
    assert made["run_id"] == first.run_id and made["candidate"] == "compromise"
    assert made["same"] is True and made["status"] == "ok"
    with Image.open(made["picture"]) as picture:
        assert picture.format == "PNG" and picture.width > 1000
    assert call()[0] == 0 and calls_of(space, first.run_id) == 1
    assert not list((space.path / "records").glob("*.tmp"))


def test_the_animation_moves_loops_and_is_small(calibrated, call):
    made = json.loads(call("--json", "--frames", "12")[1])
    with Image.open(made["animation"]) as film:
        assert film.info["loop"] == 0 and film.n_frames == made["frames"] <= 12
        durations, frames = [], []
        for i in range(film.n_frames):
            film.seek(i)
            durations.append(film.info["duration"])
            frames.append(np.asarray(film.convert("RGB"), float))
    assert durations[-1] > 10 * min(durations)
    assert all(np.abs(a - b).max() > 50 for a, b in itertools.pairwise(frames))
    assert 1000 < Path(made["animation"]).stat().st_size <= LARGEST


def test_paraview_gets_every_frame_with_radii_speeds_and_layers(calibrated, call):
    made = json.loads(call("--json", "--frames", "10")[1])
    for kind, count in (("grains", 60), ("walls", 72)):
        collection = Path(made[kind]).read_text()
        files = re.findall(r'file="(vtk/.*?)"', collection)
        assert len(files) == made["frames"]
        folder = calibrated[1].path / "views" / made["run_id"]
        assert sorted(p.name for p in (folder / "vtk").glob(f"{kind}_*")) == sorted(
            f.removeprefix("vtk/") for f in files
        )
        points, fields, _ = poly_data((folder / files[0]).read_text())
        assert len(points) == count
        if kind == "grains":
            assert set(fields) == {"radius", "speed", "layer", "grain"}
            assert set(fields["layer"]) == set(range(6)) and np.all(fields["radius"] > 0)


def test_a_run_is_named_by_its_beginning_and_a_candidate_by_its_letter(calibrated, call):
    space = calibrated[1]
    wanted = run_ids(space)[0]
    shortest = next(
        n for n in range(1, 17) if sum(r[:n] == wanted[:n] for r in run_ids(space)) == 1
    )
    made = json.loads(call(wanted[: max(shortest, 6)], "--json")[1])
    assert (made["run_id"], made["candidate"], made["same"]) == (wanted, "", True)
    labels = [c for c in current_calibration(space).ordered if c != "compromise"]
    made = json.loads(call(labels[0].removeprefix("individual "), "--json")[1])
    assert made["candidate"] == labels[0]
    made = json.loads(call("--setup", "ledge", "--json")[1])  # held out, and not validated yet
    assert (made["setup"], made["same"]) == ("ledge", None)


@pytest.mark.parametrize(
    ("given", "why"),
    [
        (["Z"], "unknown run or candidate"),
        (["A", "--setup", "lege"], "did you mean ledge"),
        (["--frames", "2"], "give a number from 4 to 200"),
    ],
)
def test_what_cannot_be_shown_is_one_line_with_a_remedy(call, given, why):
    status, _, error = call(*given)
    assert status == 2 and why in error and error.count("\n") == 1


def test_an_unknown_run_names_near_ones_and_an_ambiguous_one_those_that_begin_so(calibrated, call):
    known = run_ids(calibrated[1])
    wrong = known[3][:9] + ("0" if known[3][9] != "0" else "1")
    status, _, error = call(wrong)
    assert status == 2 and f"did you mean {known[3]}" in error and "database.csv" in error
    letters = [r[0] for r in known]
    shared = max(set(letters), key=letters.count)
    status, _, error = call(shared)
    assert status == 2 and "runs begin with" in error and error.count("\n") == 1
    assert "leave --setup out" in call(known[0], "--setup", "ledge")[2]


def test_a_run_of_another_version_is_refused_and_shown_where_that_is_asked_for(calibrated, call):
    space = calibrated[1]
    wanted = run_ids(space)[1]
    path = space.path / "records" / f"{wanted}.json"
    kept = path.read_text()
    noted = json.loads(kept)
    noted.pop("seal")
    noted["responses"]["bulk_density"] *= 1 + 1e-15
    noted["provenance"]["scripts"] = "0123456789ab"
    path.write_text(json.dumps(noted))
    try:
        status, _, error = call(wanted)
        last = error.splitlines()[-1]  # what comes before is the progress
        assert status == 2 and last.startswith("calibrator: ")
        assert "another version" in last and "0123456789ab" in last and "--anyway" in last
        assert not (space.path / "views" / wanted / "picture.png").exists()
        status, said, _ = call(wanted, "--anyway")
        assert status == 0 and "NOT the noted run" in said
        assert calls_of(space, wanted) == 1  # the snapshots of the first call
        assert json.loads(path.read_text()) == noted  # the record stays as it is
    finally:
        path.write_text(kept)


def test_without_yade_it_is_one_line(calibrated, call, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    status, _, error = call(run_ids(calibrated[1])[2])
    assert status == 2 and "is not installed" in error and error.count("\n") == 1


def test_a_damaged_snapshot_is_one_line_and_lost_ones_are_made_again(calibrated, call):
    space = calibrated[1]
    wanted = run_ids(space)[4]
    assert call(wanted)[0] == 0
    shots = sorted((space.path / "views" / wanted / "run" / "snapshots").iterdir())
    shots[3].write_bytes(shots[3].read_bytes()[:100])
    status, _, error = call(wanted)
    assert status == 2 and "delete its folder" in error and error.count("\n") == 1
    for shot in shots:
        shot.unlink()
    assert call(wanted)[0] == 0 and calls_of(space, wanted) == 2


def test_a_run_that_cannot_be_made_says_why(calibrated, call):
    space = calibrated[1]
    wanted = run_ids(space)[5]
    (space.path / "views" / wanted / "run").mkdir(parents=True)
    trouble = space.path / "views" / wanted / "run" / "misbehave.json"
    trouble.write_text(json.dumps({"all": "crash"}))
    status, _, error = call(wanted)
    assert status == 2 and "could not be made again: crash" in error
    trouble.unlink()
    assert call(wanted)[0] == 0  # nothing is left of the failure


def test_a_view_that_was_not_finished_is_none(calibrated, call, monkeypatch):
    space = calibrated[1]
    wanted = run_ids(space)[6]
    monkeypatch.setattr("calibrator.view.view.animation", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        call(wanted)
    assert read_view(space.path / "views" / wanted) is None
    monkeypatch.undo()


def test_the_report_opens_with_the_picture_or_says_in_one_line_how_to_get_it(calibrated, call):
    space = calibrated[1]
    made = json.loads(call("--json")[1])
    page = write_report(space).page.read_text()
    first = page.index("<img")
    assert first < page.index("<h2>What was asked")
    (seen,) = re.findall(r'<img alt="([^"]*)"', page[first : first + 600])
    assert seen == made["seen"] and "60 grains when it is filled" in seen
    assert "To see the recommended set" not in page
    (space.path / "views" / made["run_id"] / "view.json").unlink()
    page = write_report(space).page.read_text()
    assert "<h2>What was asked" in page[: page.index("<img")]
    assert f"<code>{space.command('view')}</code>" in page
